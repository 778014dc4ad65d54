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

from ..core.errors import DatasetError, ImageError
from ..core.images import read_grey
from .map_files import read_truth
from .regions import regions

#: Value of a pixel of the region in a mask of Middlebury; other values say why a pixel is not in it.
_IN_MASK = 255

#: Values of a mask without a pixel in the region, and of one whose values are true and false.
_NONE_IN_MASK = (0, 128)
_TRUE_FALSE   = (0, 1)

#: Most values of a mask: more are of a photo, or of a lossy format.
_MASK_VALUES = 4

#: Notices that say nothing about a result, because each pair of some data sets has them.
_EXPECTED = ("converted to grey", "converted to 8 bits")


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
    notes
        What the files were read as, where that is not the convention of their layout; a line each.
    """

    name:    str
    left:    NDArray[np.uint8]
    right:   NDArray[np.uint8]
    truth:   NDArray[np.float32]
    regions: dict[str, NDArray[np.bool_]]
    notes:   tuple[str, ...] = ()


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
        Divisor from the truths' values to pixels; None for the default of `read_truth`.
    scale_given
        Whether the user gave the scale; a scale by the layout is checked against the images.
    notes
        What was guessed to find the pair, a line each.
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
    scale_given:  bool = False
    notes:        tuple[str, ...] = ()

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
            A file is missing or has another format, the scale of a truth is not known, or the images contradict it.
        DatasetError
            The files are of different sizes.
        """
        left, notices = read_grey(self.left)
        right, more   = read_grey(self.right)
        notices      += more

        def fitting(image: NDArray[Any], path: Path) -> NDArray[Any]:
            if image.shape != left.shape:
                raise DatasetError(f"{path}: is {image.shape[1]}x{image.shape[0]} pixels, the left image of the pair "
                                   f"{left.shape[1]}x{left.shape[0]}")
            return image

        def truth(path: Path) -> NDArray[np.float32]:
            read = read_truth(path, self.scale)
            fitting(read.pixels, path)
            if path == self.truth:
                read = read if self.scale_given else read.agreeing(left, right, "--ground-truth-scale")
                # A scale that was found by the images has a note already.
                notices.extend(read.notices if self.scale_given or self.scale is None else [] if self.notes else
                               [read.note])
            return read.pixels

        def mask(path: Path | None) -> NDArray[np.bool_] | None:
            if path is None:
                return None
            found, more = _mask(path)
            notices.extend(more)
            return np.asarray(fitting(found, path))

        fitting(right, self.right)
        left_truth  = truth(self.truth)
        right_truth = None if self.right_truth is None else truth(self.right_truth)
        nonocc      = mask(self.nonocc) if self.nonocc_truth is None else np.isfinite(truth(self.nonocc_truth))
        found       = regions(left_truth, right_truth, nonocc, mask(self.disc))
        notes       = [note for note in notices if not note.endswith(_EXPECTED)]
        return Sample(self.name, left, right, left_truth, found, (*self.notes, *notes))


def _mask(path: Path) -> tuple[NDArray[np.bool_], list[str]]:
    """Read a mask: bool, H x W, and what is to be said of it; raise ImageError if it is not certain what is in it."""
    image  = read_grey(path)[0]
    values = np.unique(image).tolist()
    if values[-1] == _TRUE_FALSE[1]:
        return image == 1, [f"{path}: read as a mask of 0 and 1, with 1 in the region"]
    if len(values) > _MASK_VALUES or not (values[-1] == _IN_MASK or set(values) <= {*_NONE_IN_MASK}):
        raise ImageError(f"{path}: is no mask: it has {len(values)} values from {values[0]} to {values[-1]}, 255 "
                         "(or 1, beside 0 alone) means in the region")
    return image == _IN_MASK, []
