#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The calibration record: what a device keeps of two cameras. docs/rectification.md has its layout."""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..core.errors import GeometryError
from ..core.geometry import StereoGeometry
from ..core.grid import STEP, Grid, GridPair, grid_crc, grid_shape, row_budget
from .camera_info import CameraInfo, pair_geometry
from .rectify import Rectifier

MAGIC   = b"LSCA"
VERSION = 1

#: Most bytes of a record that a device's flash has room for.
MOST_BYTES = 20224

#: Bytes of a camera's name.
_NAME_BYTES = 32

#: Coefficients of a camera's distortion that a record has room for.
_MOST_COEFFICIENTS = 14

#: Names of the distortion models by their numbers.
_MODELS = ("plumb_bob", "rational_polynomial", "equidistant", "none", "")

_HEAD   = struct.Struct("<4sHHIHHHHHHI6f12x")
_CAMERA = struct.Struct(f"<{_NAME_BYTES}sBB6x9d{_MOST_COEFFICIENTS}d9d12d")
_CRC    = struct.Struct("<I")

#: Number of fields of the head that are whole numbers.
_WHOLE = 11

_HEADER_BYTES = _HEAD.size + 2*_CAMERA.size


@dataclass(frozen=True, eq=False)
class CalibrationRecord:
    """A calibrated pair of cameras, and the grids that rectify its images.

    Raises
    ------
    GeometryError
        The cameras are no rectified pair, or the grids are for images of another size.
    """

    cameras: tuple[CameraInfo, CameraInfo]
    grids:   GridPair

    def __post_init__(self) -> None:
        geometry = self.geometry
        for grid in self.grids:
            if (grid.width, grid.height) != (geometry.width, geometry.height):
                raise GeometryError(f"a grid is for images of {grid.width}x{grid.height} pixels, the cameras have "
                                    f"{geometry.width}x{geometry.height}")

    @property
    def geometry(self) -> StereoGeometry:
        """The geometry of the pair."""
        return pair_geometry(*self.cameras)

    @property
    def length(self) -> int:
        """The bytes of the record."""
        return _HEADER_BYTES + sum(grid.nodes.nbytes for grid in self.grids) + _CRC.size

    @classmethod
    def of(cls, rectifier: Rectifier) -> CalibrationRecord:
        """Return the record of a rectifier's cameras; raise GeometryError if no device can rectify for them."""
        pair = rectifier.pair
        if pair.grids is None:
            raise GeometryError(f"no device can rectify for these cameras: {pair.no_grids}")
        return cls(rectifier.cameras, pair.grids.grids)

    def encode(self) -> bytes:
        """Return the record as bytes.

        Raises
        ------
        GeometryError
            No device has room for it, or its baseline does not fit its place.
        """
        if self.length > MOST_BYTES:
            raise GeometryError(f"a calibration of {self.geometry.width}x{self.geometry.height} pixels has "
                                f"{self.length} bytes, a device has room for {MOST_BYTES}: use smaller images")
        nodes = b"".join(grid.nodes.astype("<i2").tobytes() for grid in self.grids)
        body  = self._head() + b"".join(map(_packed, self.cameras)) + nodes
        return body + _CRC.pack(zlib.crc32(body))

    def _head(self) -> bytes:
        geometry, budget = self.geometry, row_budget(self.grids)
        try:
            return _HEAD.pack(MAGIC, VERSION, _HEADER_BYTES, self.length, geometry.width, geometry.height, STEP,
                              budget.span, max(budget.delay, 0), budget.steady_lead, grid_crc(self.grids),
                              geometry.focal_px, geometry.focal_y_px, geometry.cx_left_px, geometry.cy_px,
                              -geometry.zero_px, geometry.baseline_m)
        except OverflowError:
            raise GeometryError(f"a baseline of {geometry.baseline_m:g} m does not fit a calibration record") from None

    @classmethod
    def decode(cls, data: bytes) -> CalibrationRecord:
        """Return the record that bytes are.

        Raises
        ------
        GeometryError
            They are none, or are damaged, or its numbers contradict each other.
        """
        if not data.startswith(MAGIC) or len(data) < _HEAD.size + _CRC.size:
            raise GeometryError("is no calibration record")
        if len(data) > MOST_BYTES:
            raise GeometryError(f"a calibration record has at most {MOST_BYTES} bytes, not {len(data)}")
        _, version, header, length, width, height, step, *_ = _HEAD.unpack_from(data)
        if version != VERSION:
            raise GeometryError(f"is a calibration record of version {version}, these host tools know {VERSION}")
        if len(data) != length:
            raise GeometryError(f"a calibration record of {length} bytes has {len(data)}")
        if _CRC.unpack_from(data, length - _CRC.size)[0] != zlib.crc32(data[:-_CRC.size]):
            raise GeometryError("the CRC of the calibration record is wrong: it is damaged")
        rows, columns = grid_shape(width, height)
        if header != _HEADER_BYTES or step != STEP or length != header + 8*rows*columns + _CRC.size:
            raise GeometryError(f"a calibration record for {width}x{height} pixels cannot have {length} bytes, "
                                f"{header} of them before the nodes, which are {step} pixels apart")
        nodes = np.frombuffer(data, "<i2", 4*rows*columns, header).reshape(2, rows, columns, 2).astype(np.int16)
        left, right = (_unpacked(data, _HEAD.size + number*_CAMERA.size, width, height) for number in range(2))
        record = cls((left, right), (Grid(width, height, nodes[0]), Grid(width, height, nodes[1])))
        own, found = (_HEAD.unpack_from(head) for head in (record._head(), data))
        # The last ones are rounded, and depend on the computer in their last bits.
        if own[:_WHOLE] != found[:_WHOLE] or not np.allclose(own[_WHOLE:], found[_WHOLE:], rtol=1e-6, atol=1e-6):
            raise GeometryError("the first numbers of the calibration record are not those of its cameras and grids")
        return record


def _packed(camera: CameraInfo) -> bytes:
    """Return a camera as bytes; a name that is too long is cut between characters."""
    name  = camera.name.encode("utf-8", "replace")[:_NAME_BYTES].decode("utf-8", "ignore").encode("utf-8")
    count = len(camera.distortion)
    return _CAMERA.pack(name, _MODELS.index(camera.distortion_model), count, *camera.camera_matrix.flat,
                        *camera.distortion, *[0.0]*(_MOST_COEFFICIENTS - count), *camera.rectification.flat,
                        *camera.projection.flat)


def _unpacked(data: bytes, offset: int, width: int, height: int) -> CameraInfo:
    """Return the camera at an offset; raise GeometryError if its numbers are not those of a camera."""
    name, model, count, *numbers = _CAMERA.unpack_from(data, offset)
    if model >= len(_MODELS) or count > _MOST_COEFFICIENTS:
        raise GeometryError(f"a camera of the calibration record has the distortion model {model} with {count} "
                            "coefficients")
    values: NDArray[np.float64] = np.array(numbers, np.float64)
    k, d, r, p = np.split(values, np.cumsum([9, _MOST_COEFFICIENTS, 9]))
    return CameraInfo(_text(name), width, height, k.reshape(3, 3), _MODELS[model], d[:count].copy(), r.reshape(3, 3),
                      p.reshape(3, 4))


def _text(name: bytes) -> str:
    """Return a camera's name; raise GeometryError if it is no text that may be printed."""
    text = name.rstrip(b"\0").decode("utf-8", "replace")
    if not text.isprintable() or "\ufffd" in text:
        raise GeometryError("a camera of the calibration record has a name that is not text")
    return text
