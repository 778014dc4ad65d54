#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""`calib.txt` of Middlebury's data sets since 2014: cameras, baseline, number of disparities."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..core.errors import GeometryError
from ..core.geometry import StereoGeometry
from ..core.images import read_file
from .check import check_matrix, check_size, rectified_geometry
from .numbers import decode_text, parse_number, quote

#: Largest difference of doffs and of the columns of the principal points, in pixels: both are rounded.
_DOFFS_TOLERANCE_PX = 0.1

#: Largest number of disparities.
_MOST_DISPARITIES = 1 << 16


@dataclass(frozen=True)
class Calib:
    """Contents of a calib.txt; `ndisp` is an upper bound for the number of disparities, None if it is not given."""

    geometry: StereoGeometry
    ndisp:    int | None


def read_calib(path: Path) -> Calib:
    """Read the calibration of a pair from a calib.txt of Middlebury.

    Raises
    ------
    ImageError
        The file cannot be read.
    GeometryError
        A value is missing in it, is not a number, cannot be that of a camera, or contradicts another.
    """
    try:
        return parse_calib(read_file(path))
    except GeometryError as error:
        raise GeometryError(f"{path}: {error}") from None


def parse_calib(data: bytes) -> Calib:
    """Return the contents of a calib.txt; raise GeometryError as `read_calib`, without the name of a file."""
    values        = _values(data)
    left, right   = _camera(values, "cam0"), _camera(values, "cam1")
    width, height = _whole(values, "width"), _whole(values, "height")
    for name, size in (("width", width), ("height", height)):
        check_size(name, size)
    for name, matrix in (("cam0", left), ("cam1", right)):
        check_matrix(name, matrix, width, height)
    baseline_mm = _numbers(values, "baseline", 1)[0]
    if baseline_mm <= 0:
        raise GeometryError(f"'baseline=' must be above 0, in millimetres, not {baseline_mm:g}")
    if "doffs" in values:
        doffs_px, apart_px = _numbers(values, "doffs", 1)[0], right[0, 2] - left[0, 2]
        if abs(doffs_px - apart_px) > _DOFFS_TOLERANCE_PX:
            raise GeometryError(f"'doffs=' is {doffs_px:g}, but the principal points of cam1 and cam0 are "
                                f"{apart_px:g} columns apart: one of them is wrong")
    ndisp = _whole(values, "ndisp") if "ndisp" in values else None
    if ndisp is not None and not 1 <= ndisp <= _MOST_DISPARITIES:
        raise GeometryError(f"'ndisp=' must be from 1 to {_MOST_DISPARITIES}, not {ndisp}")
    shifts       = np.zeros((2, 3, 1))
    shifts[1, 0] = -right[0, 0]*baseline_mm/1000
    geometry     = rectified_geometry(width, height, np.hstack([left, shifts[0]]), np.hstack([right, shifts[1]]),
                                      ("cam0", "cam1"))
    return Calib(geometry, ndisp)


def _values(data: bytes) -> dict[str, str]:
    """Return the values by their names."""
    try:
        lines = decode_text(data).splitlines()
    except UnicodeDecodeError:
        raise GeometryError("is not text, this is no calib.txt of Middlebury") from None
    values = dict[str, str]()
    for line in lines:
        name, equals, value = (part.strip() for part in line.partition("="))
        if equals and values.setdefault(name, value) != value:
            raise GeometryError(f"has two different values of {quote(name)}")
    return values


def _numbers(values: dict[str, str], name: str, count: int) -> list[float]:
    texts = [text for text in re.split(r"[\s,;\[\]]+", values.get(name, "")) if text]
    try:
        found = [parse_number(text) for text in texts]
    except ValueError:
        found = []
    if len(found) != count:
        raise GeometryError(f"'{name}=' with {count} number{'s'*(count > 1)} is missing, this is no calib.txt of "
                            "Middlebury")
    if not all(map(math.isfinite, found)):
        raise GeometryError(f"'{name}=' has a number that is not finite: {quote(values[name])}")
    return found


def _whole(values: dict[str, str], name: str) -> int:
    number = _numbers(values, name, 1)[0]
    if number != int(number):
        raise GeometryError(f"'{name}=' must be a whole number, not {number:g}")
    return int(number)


def _camera(values: dict[str, str], name: str) -> NDArray[np.float64]:
    return np.array(_numbers(values, name, 9), np.float64).reshape(3, 3)
