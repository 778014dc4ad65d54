#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The one reader of disparity maps and true disparities: what a file's values mean, and which of them mean none.

| file                      | values                                 | without a disparity                             |
|---------------------------|----------------------------------------|-------------------------------------------------|
| image of 16 bits          | 256 times the disparity (KITTI)        | 0                                               |
| int16                     | sixteenths of a pixel (LiteStereo, cv2)| (min_disparity - 1)*16                          |
| floating point, and PFM   | pixels                                 | nan, inf; a value below those searched          |
| image or array of 8 bits  | pixels, of a truth only                | 0                                               |
| other whole numbers       | not known: the scale must be given     | 0                                               |

In a truth 0 and less is unknown, in every file.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core import arrays
from ..core.errors import ImageError
from ..core.images import KITTI_SCALE, read_file, read_image
from ..core.settings import DISPARITY_SCALE
from .consistency import SCALES, agreeing_scale, is_upside_down

#: Values that a note lists at most.
_LISTED = 3


@dataclass(frozen=True, eq=False)
class MapFile:
    """A map that was read from a file, and what it was read as.

    Parameters
    ----------
    path
        The file.
    pixels
        float32, H x W, in pixels, nan where there is no disparity.
    values
        The same, before the division by `scale`.
    scale
        Divisor from the values to pixels.
    note
        What the file was read as, in one line.
    usual
        Whether the file is as `match` writes it, or in the same convention: then there is nothing to say.
    rows_from_top
        Whether a PFM's rows are from the top, because its header is like Photoshop's.
    """

    path:          Path
    pixels:        NDArray[np.float32]
    values:        NDArray[np.float32]
    scale:         float
    note:          str
    usual:         bool
    rows_from_top: bool = False

    @property
    def notices(self) -> list[str]:
        """The note, unless there is nothing to say."""
        return [] if self.usual else [self.note]

    def agreeing(self, left: NDArray[np.uint8], right: NDArray[np.uint8], option: str) -> MapFile:
        """Check a truth, whose scale was not given, against the pair that it is of.

        Parameters
        ----------
        left, right
            uint8, H x W, as the truth.
        option
            The option that gives the scale, for the error.

        Returns
        -------
        The map, with its rows in the other order if a PFM of Photoshop needs that.

        Raises
        ------
        ImageError
            The images agree with another scale.
        """
        found = self
        if self.rows_from_top and is_upside_down(left, right, self.pixels):
            found = replace(self, pixels=self.pixels[::-1], values=self.values[::-1], rows_from_top=False,
                            note=self.note.replace(_FROM_TOP, "rows from the bottom, as the images have it"))
        scale = agreeing_scale(left, right, found.values, sorted({*SCALES, self.scale}))
        if scale is not None and scale != self.scale:
            raise ImageError(f"{self.path}: was read as {_unit(self.scale)}, but the images agree with {scale:g}: "
                             f"give {option} {scale:g}, or {option} {self.scale:g} if that is right")
        return found


def _unit(scale: float) -> str:
    """Return a scale in words."""
    return "in pixels" if scale == 1 else f"{scale:g} levels per pixel"


_FROM_TOP = "rows from the top, as Photoshop writes them"


def read_truth(path: Path, scale: float | None = None, option: str = "--ground-truth-scale") -> MapFile:
    """Read true disparities; 0 or less, infinite or nan means unknown.

    Parameters
    ----------
    path
        See the table above.
    scale
        Divisor from the file's values to pixels, above 0; None for that of the table.
    option
        The option that gives it, for errors.

    Raises
    ------
    ImageError
        The file is missing or has another format, its scale is not known, or the scale is not above 0.
    """
    if scale is not None and not 0 < scale < float("inf"):
        raise ImageError(f"the scale of the ground truth must be above 0, not {scale:g}")
    read    = _read(path)
    divisor = scale or read.truth_scale
    if divisor is None:
        raise ImageError(f"{path}: holds whole numbers of type {read.raw.dtype}, whose scale is not known: give "
                         f"{option}, the divisor from its values to pixels")
    none    = _Marks(read.raw)
    none.take(~np.isfinite(read.raw))
    with np.errstate(invalid="ignore", over="ignore"):
        # Also what is 0 only after the division.
        none.take((read.raw <= 0) | (read.raw.astype(np.float32)/np.float32(divisor) <= 0))
    if read.is_sixteenths and scale is None and (mark := _framed(read.raw)) is not None:
        none.take(read.raw == mark)
    negative = none.values()[none.values() < 0]
    # An image of 16 bits has its own mark, and floats have two; 0 is unknown by the definition of a truth.
    known    = scale is not None or read.raw.dtype == np.uint16 or read.raw.dtype.kind == "f"
    usual    = known and not read.converted and not read.rows_from_top and not negative.size
    return _finish(path, read, divisor, none, usual, scale is not None)


def read_map(path: Path, min_disparity: int = 0, scale: float | None = None, none_values: Sequence[float] = (),
             scale_option: str = "--map-scale", none_option: str = "--none-value") -> MapFile:
    """Read a disparity map that `match` has written, or another program.

    Parameters
    ----------
    path
        See the table above.
    min_disparity
        Smallest disparity that was searched, in pixels.
    scale
        Divisor from the file's values to pixels, above 0; None for that of the table.
    none_values
        Values of the file that mean no disparity, with nan and inf; without any they are found.
    scale_option, none_option
        The options that give these, for errors.

    Raises
    ------
    ImageError
        The file is missing or has another format, or it is not certain what its values mean.
    """
    read    = _read(path)
    divisor = scale or read.map_scale
    if divisor is None:
        raise ImageError(f"{path}: is no disparity map: {_NEEDED}, or {scale_option} with the divisor from its values "
                         "to pixels")
    none   = _Marks(read.raw)
    finite = none.take(~np.isfinite(read.raw))
    if read.raw.dtype.kind == "u":
        none.take(read.raw == 0)
        largest = int(np.iinfo(read.raw.dtype).max)
        full    = int((read.raw == largest).sum())
        if full and not none_values:
            raise ImageError(f"{path}: has {full} pixels of {largest}, the largest value, which may mean none: give "
                             f"{none_option} {largest} for none, or {none_option} nan for a disparity")
    if none_values:
        # As the file holds them: -0.1 of float32 is not -0.1.
        kind = read.raw.dtype if read.raw.dtype.kind == "f" else np.float64
        none.take(np.isin(read.raw.astype(kind), np.asarray(none_values, kind)))
    elif read.raw.dtype.kind != "u":
        _find_marks(path, read.raw, divisor, min_disparity, none, none_option)
        if read.raw.dtype.kind == "f" and scale is None:
            _refuse_sixteenths(path, read.raw, none, scale_option)
    found = _finish(path, read, divisor, none, usual=False, scale_given=scale is not None)
    most  = float(np.nanmax(found.pixels)) if np.isfinite(found.pixels).any() else 0.0
    if most >= found.pixels.shape[1]:
        raise ImageError(f"{path}: has disparities up to {most:g} pixels, more than its width of "
                         f"{found.pixels.shape[1]}: give {scale_option}, the divisor from its values to pixels, or "
                         f"{none_option}, a value that means none")
    values = none.values()
    usual  = scale is None and not none_values and not read.converted and not read.rows_from_top and (
        read.raw.dtype.kind == "u" or not np.isfinite(values).any()
        or (read.is_sixteenths and values.tolist() == [(min_disparity - 1)*DISPARITY_SCALE]))
    return replace(found, usual=usual or (finite and not none.any()))


_NEEDED = ("a .npy of int16 in sixteenths of a pixel or of floating point in pixels, a .pfm, or a grey image of 16 "
           "bits is needed, one number per pixel")


@dataclass(frozen=True, eq=False)
class _Read:
    """Values of a file, H x W, and what kind of file it is."""

    raw:           NDArray[Any]
    kind:          str
    converted:     bool = False
    rows_from_top: bool = False

    @property
    def is_sixteenths(self) -> bool:
        """Whether these are the values of our own maps, and of cv2.StereoBM."""
        return self.raw.dtype == np.int16

    @property
    def map_scale(self) -> float | None:
        """Divisor from the values of a map to pixels; None if it is not known."""
        if self.raw.dtype.kind == "f":
            return 1.0
        if self.is_sixteenths:
            return float(DISPARITY_SCALE)
        return float(KITTI_SCALE) if self.raw.dtype == np.uint16 and self.kind == "image" else None

    @property
    def truth_scale(self) -> float | None:
        """Divisor from the values of a truth to pixels; None if it is not known."""
        return 1.0 if self.raw.dtype == np.uint8 else self.map_scale


def _read(path: Path) -> _Read:
    """Read the values of a file; raise ImageError if it has not one number per pixel."""
    data, suffix = read_file(path), path.suffix.lower()
    decoders: dict[str, Callable[[bytes, str], NDArray[Any]]] = {
        ".npy": arrays.decode_npy, ".npz": arrays.decode_npz, ".pfm": arrays.decode_pfm}
    if suffix == ".npy" and data.startswith(arrays.NPZ):
        raise ImageError(f"{path}: is an archive, not a .npy: {_NEEDED}")
    converted = False
    if suffix in decoders:
        raw, kind = decoders[suffix](data, str(path)), suffix
    elif data.startswith(arrays.PFM):
        # OpenCV would read it too, and multiply it by its scale.
        raw, kind = arrays.decode_pfm(data, str(path)), ".pfm"
    else:
        raw, kind = read_image(path), "image"
        if raw.ndim == 3 and (raw[:, :, :min(raw.shape[2], 3)] == raw[:, :, :1]).all():
            converted = raw.shape[2] > 1
            raw       = raw[:, :, 0]
    if raw.ndim != 2 or raw.dtype.kind not in "iuf" or not raw.size:
        raise ImageError(f"{path}: is no disparity map: {_NEEDED}, not {raw.dtype} {raw.shape}")
    return _Read(raw, kind, converted, kind == ".pfm" and arrays.is_photoshop(data))


class _Marks:
    """The pixels of a map that have no disparity: bool, H x W."""

    def __init__(self, raw: NDArray[Any]) -> None:
        self._raw  = raw
        self.where = np.zeros(raw.shape, bool)

    def take(self, where: NDArray[np.bool_]) -> bool:
        """Add pixels; return whether there are none of them."""
        self.where |= where
        return not where.any()

    def any(self) -> bool:
        """Return whether a pixel has no disparity."""
        return bool(self.where.any())

    def values(self) -> NDArray[Any]:
        """Return the values that mean none, each once."""
        return np.unique(self._raw[self.where])


def _find_marks(path: Path, raw: NDArray[Any], divisor: float, min_disparity: int, none: _Marks, option: str) -> None:
    """Find the values of a signed map that mean none; raise ImageError if that is not certain."""
    # Float arithmetic of this kind is exact: divisors and the smallest disparity are small.
    with np.errstate(invalid="ignore"): # A signalling nan.
        pixels = np.where(none.where, np.nan, raw.astype(np.float64)/divisor)
    known   = ~none.where
    if not known.any():
        return
    least   = float(np.nanmin(pixels))
    corner  = float(pixels[0, 0])
    sixteen = raw.dtype.kind == "i"
    # No block fits into the corner, so its value means no disparity. If that is not the one below the smallest
    # disparity, all pixels with it would become a wall of one depth.
    zero    = least == corner == 0 and not sixteen and min_disparity == 0 and not none.any()
    wrong   = corner == least and corner.is_integer() and corner != min_disparity - 1 and not zero
    if wrong and (sixteen or (corner >= min_disparity and not none.any() and _framed(raw, divisor) is not None)):
        given = f"looks like a map that was matched with --min-disparity {corner + 1:.0f}, not {min_disparity}"
        raise ImageError(f"{path}: {given}: give that" if corner >= -1 else
                         f"{path}: {given}: add {-corner - 1:.0f} pixels to its disparities, none may be below 0")
    below = known & (pixels <= min_disparity - 1)
    if not below.any() and corner == least < min_disparity:
        below = known & (pixels == corner)
    marks = np.unique(pixels[below])
    if len(marks) > 1:
        raise ImageError(f"{path}: has {len(marks)} values below the smallest disparity {min_disparity}, from "
                         f"{marks[0]*divisor:g} to {marks[-1]*divisor:g}: give the --min-disparity that it was matched "
                         f"with, or {option} for each value that means none")
    zeros = known & (pixels == 0) if min_disparity == 0 else np.zeros(raw.shape, bool)
    if zeros.any() and not below.any() and not none.any():
        # Nothing else means none. A map of blocks has none in its corner.
        if not zero:
            raise ImageError(f"{path}: has {zeros.sum()} pixels of 0, which may mean a disparity of 0 or none: give "
                             f"{option} 0 for none, or {option} nan for a disparity")
        below = zeros
    none.take(below)


def _framed(raw: NDArray[Any], divisor: float = DISPARITY_SCALE) -> Any:
    """Return the value that all pixels at the border of a map have, if others are larger by a pixel or more."""
    mark   = raw[0, 0]
    border = (raw[0], raw[-1], raw[:, 0], raw[:, -1])
    others = raw[raw != mark]
    if not others.size or not all((line == mark).all() for line in border):
        return None
    with np.errstate(invalid="ignore"):
        return mark if float(others.min()) - float(mark) >= divisor else None


def _refuse_sixteenths(path: Path, raw: NDArray[Any], none: _Marks, option: str) -> None:
    """Raise ImageError if floats look like the whole numbers of cv2.StereoBM's map."""
    marks = [value for value in none.values() if np.isfinite(value)]
    known = raw[~none.where]
    if marks and marks[0] <= -DISPARITY_SCALE and marks[0] % DISPARITY_SCALE == 0 and (known == np.rint(known)).all():
        raise ImageError(f"{path}: looks like a map in sixteenths of a pixel, as cv2.StereoBM returns it: give "
                         f"{option} {DISPARITY_SCALE}, or {option} 1 if it is in pixels")


def _finish(path: Path, read: _Read, divisor: float, none: _Marks, usual: bool, scale_given: bool) -> MapFile:
    """Divide, and write the note."""
    with np.errstate(over="ignore", invalid="ignore"):
        values = read.raw.astype(np.float32)
        pixels = values/np.float32(divisor)
    # Values that float32 does not hold, before or after the division.
    none.where |= ~np.isfinite(pixels)
    values[none.where] = np.nan
    pixels[none.where] = np.nan
    names  = [f"{value:g}" for value in none.values()]
    listed = ", ".join(names if len(names) <= _LISTED else [*names[:_LISTED - 1], "...", names[-1]])
    kind   = f"{8*read.raw.dtype.itemsize}-bit image" if read.kind == "image" and read.raw.dtype.kind == "u" else (
        f"{read.raw.dtype.name} in {'an image' if read.kind == 'image' else read.kind}")
    unit   = "in sixteenths of a pixel" if read.is_sixteenths and not scale_given else _unit(divisor)
    rows   = f", {_FROM_TOP}" if read.rows_from_top else ""
    count  = int(none.where.sum())
    note   = f"{path}: read as {kind}, {unit}{rows}; {count} pixels without a disparity" + (
        f" (values {listed})" if count else "")
    return MapFile(path, pixels, values, divisor, note, usual, read.rows_from_top)
