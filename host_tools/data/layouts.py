#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Finds stereo pairs in folders, in the layouts of the usual data sets.

| layout          | images                                | truth of the left image, and of the right one            |
|-----------------|---------------------------------------|----------------------------------------------------------|
| LiteStereo      | left, right                           | disp_left_u16, 256 times the disparity                   |
| Middlebury 2014 | im0, im1                              | disp0GT or disp0, disp1GT or disp1; ndisp from calib.txt |
| Middlebury v2   | im2 and im6, or imL and imR           | disp2, truedisp or groundtruth, disp6                    |
| KITTI           | image_2 and image_3, or image_0 and 1 | disp_occ_0 or disp_occ; disp_noc_0 or disp_noc: "nonocc" |

In the first three layouts masks are in the same folder: nonocc or mask0nocc, and disc.
"""

from __future__ import annotations

import collections
import dataclasses
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from ..cameras.calib_txt import read_calib
from ..core.errors import DatasetError
from .samples import SampleFiles, image_size
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
    scaled:      bool = False


_LAYOUTS = (
    _Layout(("left",),      ("right",),     ("disp_left_u16",),                     ()),
    _Layout(("im0",),       ("im1",),       ("disp0GT", "disp0"),                   ("disp1GT", "disp1")),
    _Layout(("im2", "imL"), ("im6", "imR"), ("disp2", "truedisp", "groundtruth"),   ("disp6",), scaled=True),
)

#: KITTI of 2015 and of 2012, colour first: left and right images, all true disparities, those that both cameras see.
_KITTI = (
    ("image_2",   "image_3",   "disp_occ_0", "disp_noc_0"),
    ("image_0",   "image_1",   "disp_occ_0", "disp_noc_0"),
    ("colored_0", "colored_1", "disp_occ",   "disp_noc"),
    ("image_0",   "image_1",   "disp_occ",   "disp_noc"),
)

#: Scale of Middlebury's old 8-bit truths, by their width in pixels: those of 2003, and Tsukuba. All others have 8.
_SCALES        = {450: 4.0, 900: 2.0, 1800: 1.0, 384: 16.0}
_DEFAULT_SCALE = 8.0


def find_samples(paths: Iterable[Path], scale: float | None = None) -> list[SampleFiles]:
    """Find the pairs at `paths`: each is the folder of a pair, a folder of such folders, or a folder of KITTI.

    A pair is named by its folder, with the parent folder if two pairs have the same name.

    Parameters
    ----------
    scale
        Divisor from the truths' values to pixels. None is 256 for 16-bit images; for the 8-bit images of Middlebury 4,
        2 or 1 if they are 450, 900 or 1800 pixels wide, 16 if 384 (Tsukuba), else 8; for all other files 1.

    Raises
    ------
    DatasetError
        There is no pair at a path, or some of the images of KITTI are missing.
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
        if scale is None and layout.scaled and truth.suffix != ".pfm":
            scale = _SCALES.get(image_size(left)[0], _DEFAULT_SCALE)
        calib = folder / "calib.txt"
        return SampleFiles(
            name        = folder.name,
            left        = left,
            right       = right,
            truth       = truth,
            right_truth = _file(folder, layout.right_truth, _TRUTHS),
            nonocc      = _file(folder, _NONOCC, _IMAGES),
            disc        = _file(folder, _DISC, _IMAGES),
            scale       = scale,
            ndisp       = read_calib(calib).ndisp if calib.is_file() else None,
        )
    return None


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
                samples.append(SampleFiles(truth.stem, *images, truth, scale=scale,
                                           nonocc_truth=seen if seen.is_file() else None))
            else:
                alone.append(truth)
        if samples and alone:
            raise DatasetError(f"{alone[0]}: has no images in {left} and {right}, nor have {len(alone) - 1} others: "
                               "complete the data set, or remove these")
        if samples:
            return samples
    return []
