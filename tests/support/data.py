#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Stereo pairs from outside of the checkout."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from litestereo.host_tools.datasets import StereoPair
from litestereo.host_tools.ground_truth import read_ground_truth
from litestereo.host_tools.images import read_grey

#: Folder with one folder per pair: left.png, right.png, and the truth times 256 in disp_left_u16.png.
DATA_FOLDER = Path(os.environ.get("LITESTEREO_DATA")
                   or Path(__file__).parents[3] / "shared" / "data" / "stereo")


def stereo_folder(name: str) -> Path:
    """Folder of the pair `name` (tsukuba, venus, teddy, cones); skips the test if it is not there."""
    folder = DATA_FOLDER / name
    if not (folder / "left.png").is_file():
        pytest.skip(f"the pair {name} is not in {DATA_FOLDER}: set LITESTEREO_DATA to the pairs' folder")
    return folder


def stereo_pair(name: str) -> StereoPair:
    """The pair `name` in grey, with its truth; skips the test if it is not there."""
    folder = stereo_folder(name)
    return StereoPair(read_grey(folder / "left.png")[0], read_grey(folder / "right.png")[0],
                      read_ground_truth(folder / "disp_left_u16.png"))
