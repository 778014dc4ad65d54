#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Pairs of image files: two files, or folders whose files match by their names."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from ...core.errors import ImageError
from ...core.images import read_grey
from .base import Shot, Source, shot

#: Endings of image files, in lower case.
_ENDINGS = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".pgm", ".ppm", ".webp")

#: The part of a file's name that differs between left and right.
_SIDE = re.compile(r"left|right", re.IGNORECASE)


@dataclass(frozen=True)
class PairFiles:
    """Files of one pair."""

    name:  str
    left:  Path
    right: Path


def _images(folder: Path) -> list[Path]:
    if not folder.is_dir():
        raise ImageError(f"{folder}: there is no such folder")
    # left10.png comes after left9.png.
    return sorted((path for path in folder.iterdir() if path.suffix.lower() in _ENDINGS),
                  key=lambda path: [int(part) if part.isdecimal() else part
                                    for part in re.split(r"(\d+)", path.name)])


def _key(path: Path) -> str:
    """Return the common part of the names of a pair's files: "_07" of "left_07.png" and "right_07.jpg"."""
    return _SIDE.sub("", path.stem)


def _pairs(left: list[Path], right: list[Path], where: str) -> list[PairFiles]:
    by_key = {_key(path): path for path in right}
    pairs  = [PairFiles(_key(path).strip("_-. ") or path.stem, path, by_key[_key(path)])
              for path in left if _key(path) in by_key]
    alone  = {*map(_key, left)} ^ by_key.keys()
    if alone:
        lone = next(path for path in [*left, *right] if _key(path) in alone)
        raise ImageError(f"{lone}: has no partner by its name, nor have {len(alone) - 1} others: the files of a "
                         "pair have the same name except for left and right")
    if not pairs:
        raise ImageError(f"{where}: no pairs of images there")
    return pairs


def pair_files(left: Path, right: Path) -> list[PairFiles]:
    """Find the pairs of two folders; raise ImageError if there are none, or a file has no partner."""
    return _pairs(_images(left), _images(right), f"{left} and {right}")


def pair_files_of_one(folder: Path) -> list[PairFiles]:
    """Find the pairs of one folder: in its folders `left` and `right`, or by left and right in the files' names.

    Raises
    ------
    ImageError
        There are none, or a file has no partner.
    """
    if (folder / "left").is_dir() and (folder / "right").is_dir():
        return pair_files(folder / "left", folder / "right")
    images      = _images(folder)
    left, right = ([path for path in images if side in path.stem.lower()] for side in ("left", "right"))
    return _pairs(left, right, str(folder))


class FileSource(Source):
    """Pairs in image files, each once."""

    def __init__(self, files: list[PairFiles]) -> None:
        self._files = files
        self.length = len(files)
        self.picture_notices: list[str] = []

    def __iter__(self) -> Iterator[Shot]:
        for files in self._files:
            (left, left_notices), (right, right_notices) = read_grey(files.left), read_grey(files.right)
            self.picture_notices += left_notices + right_notices
            yield shot(files.name, (left, right))
