#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Stereo pairs from outside the checkout."""

from __future__ import annotations

import functools
import os
import subprocess
import tempfile
from pathlib import Path

import pytest

from litestereo.host_tools.core.errors import DatasetError
from litestereo.host_tools.core.images import read_grey
from litestereo.host_tools.data.datasets import StereoPair, load_motorcycle
from litestereo.host_tools.data.ground_truth import read_ground_truth
from litestereo.soc.build.paths import build_directory

#: Folder with one folder per pair: left.png, right.png, and the truth times 256 in disp_left_u16.png.
DATA_FOLDER = Path(os.environ.get("LITESTEREO_DATA")
                   or Path(__file__).parents[3] / "shared" / "data" / "stereo")

#: Pairs that `stereo_pair` finds there.
FOLDERS = ("tsukuba", "venus", "teddy", "cones")

#: All pairs that `stereo_pair` knows.
PAIRS = (*FOLDERS, "motorcycle", "aloe")

#: Debian's package of OpenCV's samples, and the Aloe pair in that package.
ALOE_PACKAGE = "opencv-doc"
ALOE_FOLDER  = "usr/share/doc/opencv-doc/examples/data"
ALOE_FILES   = ("aloeL.jpg", "aloeR.jpg", "aloeGT.png")


def stereo_folder(name: str) -> Path:
    """Return the folder of the pair `name`, one of `FOLDERS`; skip the test if it does not exist."""
    folder = DATA_FOLDER / name
    if not (folder / "left.png").is_file():
        pytest.skip(f"the pair {name} is not in {DATA_FOLDER}: set LITESTEREO_DATA to the pairs' folder")
    return folder


@functools.lru_cache(maxsize=2)
def stereo_pair(name: str) -> StereoPair:
    """Return the grey pair `name` with its truth; skip the test if it is neither here nor can be fetched."""
    if name == "motorcycle":
        try:
            return load_motorcycle(build_directory() / "datasets" / "motorcycle")
        except DatasetError as error:
            pytest.skip(str(error))
    if name == "aloe":
        left, right, truth = (_aloe_folder() / file for file in ALOE_FILES)
    else:
        folder             = stereo_folder(name)
        left, right, truth = (folder / file for file in ("left.png", "right.png", "disp_left_u16.png"))
    return StereoPair(read_grey(left)[0], read_grey(right)[0], read_ground_truth(truth))


def _aloe_folder() -> Path:
    """Return the folder where the package is installed, or the part of it that was fetched into the build folder."""
    for folder in (Path("/") / ALOE_FOLDER, build_directory() / "datasets" / "aloe"):
        if all((folder / name).is_file() for name in ALOE_FILES):
            return folder
    with tempfile.TemporaryDirectory() as scratch:
        try:
            subprocess.run(["apt-get", "download", "-qq", ALOE_PACKAGE], cwd=scratch, check=True, capture_output=True,
                           timeout=300)
            (package,) = Path(scratch).glob("*.deb")
            subprocess.run(["dpkg-deb", "-x", package.name, "unpacked"], cwd=scratch, check=True, capture_output=True)
            folder.mkdir(parents=True, exist_ok=True)
            for name in ALOE_FILES:
                (folder / name).write_bytes((Path(scratch) / "unpacked" / ALOE_FOLDER / name).read_bytes())
        except (OSError, ValueError, subprocess.SubprocessError):
            pytest.skip(f"the pair aloe is not here, and apt-get cannot fetch {ALOE_PACKAGE}, which holds it")
    return folder
