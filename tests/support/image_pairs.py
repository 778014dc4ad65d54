#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Pairs that are awkward for a matcher, each in a different way."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from .pairs import textured_pair

Image = NDArray[np.uint8]


def awkward_pairs(rng: np.random.Generator, width: int, height: int) -> Iterator[tuple[str, Image, Image]]:
    """Yield name, left and right image (uint8, H x W) of every kind."""
    noise, other = (rng.integers(0, 256, (height, width), np.uint8) for _ in range(2))
    left, right  = textured_pair(width, height, rng, int(rng.integers(1, 17)))
    row, column  = np.mgrid[:height, :width]
    black, white = np.zeros((height, width), np.uint8), np.full((height, width), 255, np.uint8)
    spot         = black.copy()
    spot[rng.integers(height), rng.integers(width)] = 255
    yield "textured", left, right
    yield "noise", noise, other
    yield "equal", noise, noise
    yield "flat", white // 3, white // 3
    yield "black against white", black, white
    yield "white against black", white, black
    yield "bright pixel", spot, np.roll(spot, -3, axis=1)
    yield "dark pixel", 255 - spot, np.roll(255 - spot, -3, axis=1)
    for period in (1, 2, 3, 8):
        stripes = (255*(column // period % 2)).astype(np.uint8)
        yield f"upright stripes of {period}", stripes, np.roll(stripes, -1, axis=1)
    level = (255*(row // 2 % 2)).astype(np.uint8)
    yield "level stripes", level, level
    board = (255*((row + column) % 2)).astype(np.uint8)
    yield "chequers", board, 255 - board
    yield "few values", left // 128 * 255, right // 128 * 255
    yield "faint", left // 64, right // 64
    ramp = (column*255 // width).astype(np.uint8)
    yield "ramp", ramp, np.roll(ramp, -2, axis=1)
    yield "half flat", np.where(column < width // 2, left, 90), np.where(column < width // 2, right, 90)
