#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Finds stereo pairs in folders, in the layouts of the usual data sets.

| layout          | images                                | truth of the left image, and of the right one            |
|-----------------|---------------------------------------|----------------------------------------------------------|
| LiteStereo      | left, right                           | disp_left_u16, 256 times the disparity                   |
| Middlebury 2014 | im0, im1                              | disp0GT or disp0, disp1GT or disp1; ndisp from calib.txt |
| Middlebury 2005 | view1, view5                          | disp1, disp5                                             |
| Middlebury v2   | im2 and im6, or imL and imR           | disp2, truedisp or groundtruth, disp6                    |
| Tsukuba of 2001 | scene1.row3.col3 and col4             | truedisp.row3.col3                                       |
| KITTI           | image_2 and image_3, or image_0 and 1 | disp_occ_0 or disp_occ; disp_noc_0 or disp_noc: "nonocc" |

In all but KITTI masks are in the same folder: nonocc or mask0nocc, and disc.
"""

from __future__ import annotations

import collections
import dataclasses
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..cameras.calib_txt import read_calib
from ..core.errors import DatasetError
from ..core.images import read_grey, read_image
from .consistency import agreeing_scale
from .map_files import read_truth
from .samples import SampleFiles
from .sources.pairing import visible

_IMAGES = (".png", ".ppm", ".pgm", ".jpg")
_TRUTHS = (".pfm", *_IMAGES)

#: Names of the masks, without endings; a derived mask replaces one that the data set lacks.
_NONOCC = ("mask0nocc", "nonocc", "nonocc_derived")
_DISC   = ("disc", "disc_derived")


@dataclass(frozen=True)
class _Layout:
    """Names of files without endings; the first one that exists is taken."""

    left:        tuple[str, ...]
    right:       tuple[str, ...]
    truth:       tuple[str, ...]
    right_truth: tuple[str, ...]
    scales:      Mapping[tuple[int, int], float] | None = None


#: Any size in a table of scales.
_ANY = 0

#: Scales of Middlebury's old 8-bit truths by width and height in pixels, from its pages of the data sets: the full,
#: half and quarter size of 2003, Tsukuba, and the six pairs of 2001. Widths suffice.
_SCALES_V2 = {(1800, _ANY): 1.0, (900, _ANY): 2.0, (450, _ANY): 4.0, (384, _ANY): 16.0,
              **{(width, _ANY): 8.0 for width in (430, 432, 433, 434, 435, 284)}}

#: Those of 2005 and 2006: all have 1110 rows at full size, and the sizes are a half and a third of it.
_SCALES_2005 = {(_ANY, 1110): 1.0, (_ANY, 555): 2.0, (_ANY, 370): 3.0}

_LAYOUTS = (
    _Layout(("left",),      ("right",),     ("disp_left_u16",),                     ()),
    _Layout(("im0",),       ("im1",),       ("disp0GT", "disp0"),                   ("disp1GT", "disp1")),
    _Layout(("im2", "imL"), ("im6", "imR"), ("disp2", "truedisp", "groundtruth"),   ("disp6",),
            _SCALES_V2),
    _Layout(("view1",), ("view5",), ("disp1",), ("disp5",), _SCALES_2005),
    _Layout(("scene1.row3.col3",), ("scene1.row3.col4",), ("truedisp.row3.col3",), (), _SCALES_V2),
)

#: KITTI of 2015 and of 2012, colour first: left and right images, all true disparities, those that both cameras see.
_KITTI = (
    ("image_2",   "image_3",   "disp_occ_0", "disp_noc_0"),
    ("image_0",   "image_1",   "disp_occ_0", "disp_noc_0"),
    ("colored_0", "colored_1", "disp_occ",   "disp_noc"),
    ("image_0",   "image_1",   "disp_occ",   "disp_noc"),
)


def find_samples(paths: Iterable[Path], scale: float | None = None) -> list[SampleFiles]:
    """Find the pairs at `paths`: each is the folder of a pair, a folder of such folders, or a folder of KITTI.

    A pair is named by its folder, with the parent folder if two pairs have the same name.

    Parameters
    ----------
    scale
        Divisor from the truths' values to pixels. None is 256 for 16-bit images; for the 8-bit images of Middlebury
        that of the data set by the size of the images or, if they have another size, the one that the images agree
        with; for all other files that of `read_truth`.

    Raises
    ------
    DatasetError
        There is no pair at a path, some of the images of KITTI are missing, or the scale of its truth is not known.
    ImageError, GeometryError
        A file that gives the scale or the number of disparities is damaged.
    """
    found: list[SampleFiles] = []
    for path in paths:
        if not path.is_dir():
            raise DatasetError(f"{path}: there is no such folder")
        samples = _samples_of(path.resolve(), scale)
        if not samples:
            raise DatasetError(f"{path}: has no stereo pair with true disparities: left.png, right.png and "
                               "disp_left_u16.png, or the files of Middlebury or KITTI, see --help")
        found += samples
    # A pair that is found twice, by two of the paths, is one pair.
    found = list({sample.truth: sample for sample in found}.values())
    for parents in (1, 2):
        names = collections.Counter(sample.name for sample in found)
        found = [sample if names[sample.name] == 1 else dataclasses.replace(sample, name=_long_name(sample, parents))
                 for sample in found]
    return found


def _long_name(sample: SampleFiles, parents: int) -> str:
    """Return the name of a pair with that of the folder above its own, or with all folders above."""
    folder = sample.truth.parent
    return f"{folder.parent.name}/{sample.name}" if parents == 1 else str(folder/sample.truth.stem)


def _samples_of(folder: Path, scale: float | None) -> list[SampleFiles]:
    own = _pair(folder, scale)
    if own is not None:
        return [own]
    kitti = _kitti(folder, scale) or _kitti(folder / "training", scale)
    if kitti:
        return kitti
    below = (_pair(path, scale) for path in sorted(visible(folder)) if path.is_dir())
    return [sample for sample in below if sample is not None]


def _pair(folder: Path, scale: float | None) -> SampleFiles | None:
    for layout in _LAYOUTS:
        left, right = _file(folder, layout.left, _IMAGES), _file(folder, layout.right, _IMAGES)
        truth       = _file(folder, layout.truth, _TRUTHS)
        if left is None or right is None or truth is None:
            continue
        found, notes = (scale, ()) if scale is not None else _scale_of(layout, left, right, truth)
        calib        = folder / "calib.txt"
        return SampleFiles(
            name        = folder.name,
            left        = left,
            right       = right,
            truth       = truth,
            right_truth = _file(folder, layout.right_truth, _TRUTHS),
            nonocc      = _file(folder, _NONOCC, _IMAGES),
            disc        = _file(folder, _DISC, _IMAGES),
            scale       = found,
            scale_given = scale is not None,
            notes       = notes,
            ndisp       = read_calib(calib).ndisp if calib.is_file() else None,
        )
    return None


def _scale_of(layout: _Layout, left: Path, right: Path, truth: Path) -> tuple[float | None, tuple[str, ...]]:
    """Return the scale of a truth, None for that of its format, and a note if it was guessed."""
    if layout.scales is None or truth.suffix == ".pfm" or read_image(truth).dtype != np.uint8:
        return None, ()
    # With a scale of 1 these are the file's own values.
    values = read_truth(truth, 1.0).pixels
    images = read_grey(left)[0], read_grey(right)[0]
    height, width = values.shape
    for (of_width, of_height), scale in layout.scales.items():
        if of_width in (_ANY, width) and of_height in (_ANY, height):
            return scale, ()
    same    = all(image.shape == values.shape for image in images)
    guessed = agreeing_scale(*images, values) if same else None
    if guessed is None:
        raise DatasetError(f"{truth}: no pair of Middlebury with such names has {width}x{height} pixels, so the scale "
                           "is not known: give --ground-truth-scale, the divisor from its values to pixels")
    levels = f"{guessed:g} level{'s'*(guessed != 1)} per pixel"
    return guessed, (f"{truth}: {levels} is what the images agree with, {width}x{height} pixels are no size of "
                     "Middlebury: if it is wrong give --ground-truth-scale",)


def _file(folder: Path, names: tuple[str, ...], endings: tuple[str, ...]) -> Path | None:
    candidates = (folder / f"{name}{ending}" for name in names for ending in endings)
    return next((path for path in candidates if path.is_file()), None)


def _kitti(folder: Path, scale: float | None) -> list[SampleFiles]:
    for left, right, occ, noc in _KITTI:
        if not all((folder / name).is_dir() for name in (left, right, occ)):
            continue
        samples = []
        alone   = []
        for truth in sorted(path for path in visible(folder / occ) if path.suffix == ".png"):
            images = folder / left / truth.name, folder / right / truth.name
            seen   = folder / noc / truth.name
            if all(image.is_file() for image in images):
                samples.append(SampleFiles(truth.stem, *images, truth, scale=scale, scale_given=scale is not None,
                                           nonocc_truth=seen if seen.is_file() else None))
            else:
                alone.append(truth)
        if samples and alone:
            raise DatasetError(f"{alone[0]}: has no images in {left} and {right}, nor have {len(alone) - 1} others: "
                               "complete the data set, or remove these")
        if samples:
            return samples
    return []
