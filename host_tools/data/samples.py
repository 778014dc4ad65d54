#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""A stereo pair of a data set: its files, and their contents."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.errors import DatasetError
from ..core.images import read_grey, read_image
from .ground_truth import read_ground_truth
from .regions import regions

#: Value of a pixel of the region in a mask of Middlebury; other values say why a pixel is not in it.
_IN_MASK = 255


@dataclass(frozen=True)
class Sample:
    """A pair with its true disparities and regions.

    Parameters
    ----------
    name
        Name of the pair.
    left, right
        uint8, H x W.
    truth
        True disparities: float32, H x W, in pixels, nan where they are unknown.
    regions
        bool, H x W, by name, see `regions.regions`.
    """

    name:    str
    left:    NDArray[np.uint8]
    right:   NDArray[np.uint8]
    truth:   NDArray[np.float32]
    regions: dict[str, NDArray[np.bool_]]


@dataclass(frozen=True)
class SampleFiles:
    """Files of a pair.

    Parameters
    ----------
    name
        Name of the pair.
    left, right, truth
        Files of the images and of the true disparities of the left one.
    right_truth
        File of the true disparities of the right image; None if there is none.
    nonocc, disc
        Files of the masks, 255 in the region; None if there is none.
    nonocc_truth
        File of the true disparities of only the pixels that both cameras see: KITTI has it instead of a mask.
    scale
        Divisor from the truths' values to pixels; None for the default of `read_ground_truth`.
    ndisp
        Upper bound for the number of disparities, by the data set; None if it has none.
    """

    name:         str
    left:         Path
    right:        Path
    truth:        Path
    right_truth:  Path | None  = None
    nonocc:       Path | None  = None
    disc:         Path | None  = None
    nonocc_truth: Path | None  = None
    scale:        float | None = None
    ndisp:        int | None   = None

    @property
    def files(self) -> list[Path]:
        """The files that are read, with the one that gives `ndisp`; some need not exist."""
        named = (self.left, self.right, self.truth, self.right_truth, self.nonocc, self.disc, self.nonocc_truth)
        return [path for path in named if path is not None] + [self.left.parent/"calib.txt"]

    def load(self) -> Sample:
        """Read the files.

        Raises
        ------
        ImageError
            A file is missing, or has another format.
        DatasetError
            The files are of different sizes.
        """
        left = read_grey(self.left)[0]

        def fitting(image: NDArray[Any], path: Path) -> NDArray[Any]:
            if image.shape != left.shape:
                raise DatasetError(f"{path}: is {image.shape[1]}x{image.shape[0]} pixels, the left image of the pair "
                                   f"{left.shape[1]}x{left.shape[0]}")
            return image

        def truth(path: Path) -> NDArray[np.float32]:
            return fitting(read_ground_truth(path, self.scale), path)

        def mask(path: Path | None) -> NDArray[np.bool_] | None:
            return None if path is None else np.asarray(fitting(read_grey(path)[0], path) == _IN_MASK)

        right       = fitting(read_grey(self.right)[0], self.right)
        left_truth  = truth(self.truth)
        right_truth = None if self.right_truth is None else truth(self.right_truth)
        nonocc      = mask(self.nonocc) if self.nonocc_truth is None else np.isfinite(truth(self.nonocc_truth))
        return Sample(self.name, left, right, left_truth, regions(left_truth, right_truth, nonocc, mask(self.disc)))


def image_size(path: Path) -> tuple[int, int]:
    """Return width and height of the image in a file, in pixels; raise ImageError if it is not an image."""
    height, width = read_image(path).shape[:2]
    return width, height
