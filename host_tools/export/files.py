#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Encodes maps, depths and clouds as files. Maps and depths are float32, H x W, nan where there is no value."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.images import KITTI_SCALE, encode_png
from ..core.outputs import DEPTH_PNG, DISPARITY_PNG, Kind

_MILLIMETRES = 1000
_MAX_UINT16  = (1 << 16) - 1

#: A vertex of a PLY file, and how its header names the types.
_POINT     = [("x", "<f4"), ("y", "<f4"), ("z", "<f4")]
_COLOUR    = [("red", "u1"), ("green", "u1"), ("blue", "u1")]
_PLY_TYPES = {"<f4": "float", "u1": "uchar"}


def kitti_png(disparity_px: NDArray[np.float32]) -> bytes:
    """Encode a map as KITTI's PNG: 16 bits, 256 times the disparity, 0 where there is none; 0 pixels become 1."""
    return _png16(disparity_px*KITTI_SCALE, 1, _MAX_UINT16, DISPARITY_PNG)


def depth_npy(depth_m: NDArray[np.float32]) -> bytes:
    """Encode a depth in metres as .npy: float32 (32FC1), nan where there is none, inf where it is infinite."""
    buffer = io.BytesIO()
    np.save(buffer, depth_m.astype(np.float32))
    return buffer.getvalue()


def depth_png(depth_m: NDArray[np.float32]) -> bytes:
    """Encode a depth as PNG of 16 bits: millimetres, 0 where there is none, and from 65.5355 metres on."""
    near = np.where(depth_m*_MILLIMETRES < _MAX_UINT16 + 0.5, depth_m, np.nan)
    return _png16(near*_MILLIMETRES, 1, _MAX_UINT16, DEPTH_PNG)


def _png16(values: NDArray[Any], least: int, most: int, kind: Kind) -> bytes:
    """Encode values, rounded and clipped to their limits, as a 16-bit PNG; nan becomes 0."""
    image = np.rint(values).clip(least, most)
    image[np.isnan(values)] = 0
    return encode_png(image.astype(np.uint16), kind)


def ply(points_m: NDArray[np.float32], image: NDArray[np.uint8] | None = None) -> bytes:
    """Encode a cloud as a binary PLY.

    Parameters
    ----------
    points_m
        float32, H x W x 3, in metres; points with a nan are omitted.
    image
        Colours of the points: uint8, H x W x 3, BGR. None for a cloud without colours.
    """
    there    = np.isfinite(points_m).all(axis=-1)
    fields   = _POINT if image is None else _POINT + _COLOUR
    vertices = np.empty(int(there.sum()), fields)
    for axis, (name, _) in enumerate(_POINT):
        vertices[name] = points_m[there][:, axis]
    if image is not None:
        for channel, (name, _) in enumerate(_COLOUR):
            vertices[name] = image[there][:, 2 - channel]
    header = ["ply", "format binary_little_endian 1.0", "comment metres, x to the right, y down, z ahead",
              f"element vertex {len(vertices)}", *(f"property {_PLY_TYPES[kind]} {name}" for name, kind in fields),
              "end_header", ""]
    return "\n".join(header).encode("ascii") + vertices.tobytes()
