#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Made-up pairs in the folder layouts of the usual data sets."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from .pairs import generator, textured_pair

#: Size of the pairs in pixels, and their disparity everywhere.
WIDTH, HEIGHT, SHIFT = 120, 50, 7

CALIB = f"""\
cam0=[500.5 0 60.25; 0 500.5 24.5; 0 0 1]
cam1=[500.5 0 63.5; 0 500.5 24.5; 0 0 1]
doffs=3.25
baseline=120.5
width={WIDTH}
height={HEIGHT}
ndisp=20
"""


def write(folder: Path, images: dict[str, NDArray[np.generic]]) -> None:
    """Write images, by their names, into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, image in images.items():
        assert cv2.imwrite(str(folder / name), image)


def pair(salt: int) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Return a left and a right image, `SHIFT` pixels apart."""
    return textured_pair(WIDTH, HEIGHT, generator(70, salt), SHIFT)


def everywhere(value: float, dtype: type[np.generic]) -> NDArray[np.generic]:
    """Return an image of one value, whose last column is 0: unknown."""
    image         = np.full((HEIGHT, WIDTH), value, dtype)
    image[:, -1:] = 0
    return image


def litestereo(folder: Path, salt: int = 0) -> Path:
    """Write a pair in the project's layout, without masks; return `folder`."""
    left, right = pair(salt)
    write(folder, {"left.png": left, "right.png": right, "disp_left_u16.png": everywhere(256*SHIFT, np.uint16)})
    return folder


def middlebury_2014(folder: Path, salt: int = 0) -> Path:
    """Write a pair in Middlebury's layout of 2014; return `folder`."""
    left, right = pair(salt)
    mask        = np.full(left.shape, 128, np.uint8)
    mask[:, 40:] = 255
    write(folder, {"im0.png": left, "im1.png": right, "disp0GT.pfm": everywhere(SHIFT, np.float32),
                   "mask0nocc.png": mask})
    (folder / "calib.txt").write_text(CALIB)
    return folder


def middlebury_v2(folder: Path, salt: int = 0) -> Path:
    """Write a pair in Middlebury's layout before 2014, with the truth of the right image; return `folder`."""
    left, right = pair(salt)
    write(folder, {"im2.ppm": np.dstack([left]*3), "im6.ppm": np.dstack([right]*3),
                   "disp2.pgm": everywhere(8*SHIFT, np.uint8), "disp6.pgm": everywhere(8*SHIFT, np.uint8)})
    return folder


def kitti(folder: Path, count: int = 2, names: Sequence[str] = ("image_2", "image_3", "disp_occ_0", "disp_noc_0")
          ) -> Path:
    """Write pairs in KITTI's layout, by default of 2015; both cameras see the right half. Return `folder`."""
    for number in range(count):
        left, right = pair(number)
        name        = f"{number:06}_10.png"
        noc         = everywhere(256*SHIFT, np.uint16)
        noc[:, :60] = 0
        for part, image in zip(names, (left, right, everywhere(256*SHIFT, np.uint16), noc), strict=True):
            write(folder / "training" / part, {name: image})
        # The next frame of a sequence, without truth.
        write(folder / "training" / names[0], {f"{number:06}_11.png": left})
    return folder
