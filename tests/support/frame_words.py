#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Items of stream cores as integers per field, and Ethernet frames as the words that the network makes of them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

Layout = Sequence[tuple[str, int]]


def packed(layout: Layout, items: Iterable[Sequence[int]]) -> np.ndarray:
    """Return items, a value per field each, as words for `StreamCore.run`."""
    count = -(-sum(bits for _, bits in layout)//32)
    rows  = []
    for item in items:
        number = place = 0
        for (_, bits), value in zip(layout, item, strict=True):
            number |= value << place
            place  += bits
        rows.append([number >> 32*index & 0xffffffff for index in range(count)])
    return np.array(rows, np.uint32).reshape(-1, count)


def unpacked(layout: Layout, words: np.ndarray) -> list[tuple[int, ...]]:
    """Return the fields of the items that `StreamCore.run` captured."""
    items = []
    for row in words:
        number = sum(int(word) << 32*index for index, word in enumerate(row))
        item   = []
        for _, bits in layout:
            item.append(number & (1 << bits) - 1)
            number >>= bits
        items.append(tuple(item))
    return items


def frame_words(frame: bytes, filling: bytes = b"\x55") -> list[tuple[int, int]]:
    """Return a frame as words behind two bytes of padding, with the number of the last byte in the last one."""
    data  = bytes(2) + frame
    count = -(-len(data)//4)
    words = np.frombuffer(data.ljust(4*count, filling), "<u4")
    return [(int(word), (len(data) - 1) % 4) for word in words]


def marks(lengths: Iterable[int]) -> np.ndarray:
    """Return the marks `last` of frames of so many items."""
    flags = [index == length - 1 for length in lengths for index in range(length)]
    return np.array(flags, bool)


def split(items: Sequence, last: Sequence[bool]) -> list[list]:
    """Return items as frames, each up to its mark; the last one may lack it."""
    frames: list[list] = [[]]
    for item, mark in zip(items, last, strict=True):
        frames[-1].append(item)
        if mark:
            frames.append([])
    return frames if frames[-1] else frames[:-1]
