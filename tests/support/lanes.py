#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Items of the cores' streams as NumPy arrays, and the positions of a frame's pixels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def pack(endpoint, fields: dict[str, NDArray]) -> NDArray[np.uint32]:
    """Words of an endpoint's items: N values per field, or N x lanes for a field of many lanes; absent ones are 0."""
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
    """Fields of an endpoint's items, as `pack` takes them."""
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


def positions(width: int, height: int, disparities: int, block_size: int) -> dict[str, NDArray[np.bool_]]:
    """What the raster says of each pixel of a frame, in raster order: see `Raster`."""
    row, column = (index.ravel() for index in np.indices((height, width)))
    return {
        "column":       column,
        "row_first":    row == 0,
        "row_old":      row >= block_size,
        "column_first": column == 0,
        "column_old":   column >= block_size,
        "complete":     (row >= block_size - 1) & (column >= disparities + block_size - 2),
    }
