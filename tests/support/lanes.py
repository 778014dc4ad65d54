#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Items of the cores' streams as NumPy arrays, and the positions of the pixels of a frame."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def pack(endpoint, fields: dict[str, NDArray]) -> NDArray[np.uint32]:
    """Return the words of an endpoint's items: N values per field, N x lanes for one of lanes; absent fields are 0."""
    count = len(next(iter(fields.values())))
    bits  = []
    for name, width, *_ in endpoint.description.payload_layout:
        values = np.asarray(fields.get(name, np.zeros(count)), np.uint64).reshape(count, -1)
        lane   = width//values.shape[1]
        bits.append((values[:, :, None] >> np.arange(lane, dtype=np.uint64) & 1).astype(np.uint8).reshape(count, width))
    flat    = np.concatenate(bits, axis=1)
    flat    = np.pad(flat, ((0, 0), (0, -flat.shape[1] % 32)))
    return np.packbits(flat, axis=1, bitorder="little").view(np.uint32)


def unpack(endpoint, words: NDArray[np.uint32], lanes: dict[str, int] | None = None) -> dict[str, NDArray[np.uint64]]:
    """Return the fields of an endpoint's items, as `pack` takes them."""
    bits   = np.unpackbits(np.ascontiguousarray(words).view(np.uint8), axis=1, bitorder="little")
    result = {}
    start  = 0
    for name, width, *_ in endpoint.description.payload_layout:
        count        = (lanes or {}).get(name, 1)
        lane         = bits[:, start:start + width].reshape(len(words), count, width//count).astype(np.uint64)
        values       = (lane << np.arange(width//count, dtype=np.uint64)).sum(axis=2)
        result[name] = values if name in (lanes or {}) else values[:, 0]
        start       += width
    return result


def steps(width: int, height: int, disparities: int, block_size: int, min_disparity: int = 0, outer: int = 0,
          ahead: int = 1) -> dict[str, NDArray[np.int64]]:
    """Return the marks and positions of each step of a frame, in order: see `Raster`. Fields of one bit are 0 or 1."""
    slot, row   = (index.ravel() for index in np.meshgrid(np.arange(width + ahead + 2*outer),
                                                          np.arange(height + ahead)))
    column, line = slot - ahead, row - ahead
    first        = min_disparity + disparities - 1
    fields = {
        "column":      slot,
        "take":        (slot < width) & (row < height),
        "pixel":       (line >= 0) & (column >= 0) & (column < width),
        "pixel_first": column == 0,
        "pixel_last":  column == width - 1,
        "row_first":   line == 0,
        "row_last":    line == height - 1,
        "row_flat":    (line == height - 1) & (height % 2 == 1),
        "row_old":     line >= block_size,
        "late":        column > first,
        "move_left":   column < width + outer,
        "move_right":  ((column <= first) | (column > first + outer)) & (column < width + outer + min_disparity),
        "cost":        (line >= 0) & (column >= first),
        "cost_column": np.maximum(column - first, 0),
        "cost_first":  column == first,
        "cost_old":    column - first >= block_size,
        "complete":    (line >= block_size - 1) & (column - first >= block_size - 1),
    }
    return {name: values.astype(np.int64) for name, values in fields.items()}
