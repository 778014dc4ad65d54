#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The Middlebury pairs, from the folder that LITESTEREO_DATA names."""

from __future__ import annotations

import os
from pathlib import Path

from ...host_tools.core.errors import DatasetError
from ...host_tools.core.images import read_grey
from ...host_tools.data.datasets import StereoPair
from ...host_tools.data.ground_truth import read_ground_truth
from ...soc.build.paths import content_key

#: Pairs that the figures of the thesis show.
PAIRS = ("tsukuba", "venus", "cones")

#: Files of a pair: left and right image, and the true disparities of the left one.
FILES = ("left.png", "right.png", "disp_left_u16.png")

#: Credit that the terms of the data sets require.
CREDIT = ("Tsukuba (images and truth by Y. Ohta, University of Tsukuba) and Venus: D. Scharstein, R. Szeliski: "
          "A taxonomy and evaluation of dense two-frame stereo correspondence algorithms. IJCV 47, 2002. Cones: "
          "D. Scharstein, R. Szeliski: High-accuracy stereo depth maps using structured light. CVPR 2003.")


def pair_files(name: str) -> list[Path]:
    """Return the files of a pair, in the order of `FILES`.

    Raises
    ------
    DatasetError
        LITESTEREO_DATA is not set, or a file is missing.
    """
    wanted = f"the folder of the Middlebury pairs {', '.join(PAIRS)}, each a folder with {', '.join(FILES)}"
    folder = os.environ.get("LITESTEREO_DATA")
    if not folder:
        raise DatasetError(f"LITESTEREO_DATA is not set: set it to {wanted}")
    paths = [Path(folder) / name / file for file in FILES]
    for path in paths:
        if not path.is_file():
            raise DatasetError(f"{path} is missing: set LITESTEREO_DATA to {wanted}")
    return paths


def stereo_pair(name: str) -> StereoPair:
    """Read a pair in grey, with its true disparities; raise DatasetError as `pair_files` does."""
    left, right, truth = pair_files(name)
    return StereoPair(read_grey(left)[0], read_grey(right)[0], read_ground_truth(truth))


def data_key() -> str:
    """Return a hash of all pairs; raise DatasetError as `pair_files` does."""
    return content_key(path.read_bytes() for name in PAIRS for path in pair_files(name))
