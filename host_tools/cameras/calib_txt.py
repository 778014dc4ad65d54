#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""`calib.txt` of Middlebury's data sets since 2014: cameras, baseline, number of disparities."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from ..core.errors import GeometryError
from ..core.geometry import StereoGeometry
from ..core.images import read_file


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
        A value is missing in it, or is not a number.
    """
    lines  = read_file(path).decode("utf-8", "replace").splitlines()
    values = {name.strip(): value.strip() for name, equals, value in (line.partition("=") for line in lines) if equals}

    def numbers(name: str, count: int) -> list[float]:
        try:
            found = [float(number) for number in re.split(r"[\s;\[\]]+", values.get(name, "")) if number]
        except ValueError:
            found = []
        if len(found) != count:
            raise GeometryError(f"{path}: '{name}=' with {count} number{'s'*(count > 1)} is missing, this is no "
                                "calib.txt of Middlebury")
        return found

    left, right = numbers("cam0", 9), numbers("cam1", 9)
    ndisp       = int(numbers("ndisp", 1)[0]) if "ndisp" in values else None
    geometry    = StereoGeometry(
        width       = int(numbers("width", 1)[0]),
        height      = int(numbers("height", 1)[0]),
        focal_px    = left[0],
        baseline_m  = numbers("baseline", 1)[0]/1000,  # Millimetres in the file.
        cx_left_px  = left[2],
        cy_px       = left[5],
        cx_right_px = right[2],
    )
    return Calib(geometry, ndisp)
