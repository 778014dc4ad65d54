#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Finds the files that belong together by their names.

The names of a pair are equal except for one word that says the side. A word is a letter case, digits or separators
away from its neighbours: `left` is a word of `left_07`, `img-Left`, `leftImage` and `left07`, and none of `bright`. In
separate folders the names may also be equal altogether. The sides are, the first ones that a file has:

| left                     | right                      |
|--------------------------|----------------------------|
| `left`, `camleft`, ...   | `right`, `camright`, ...   |
| `l`                      | `r`                        |
| `cam0`, `im0`, `image_0` | `cam1`, `im1`, `image_1`   |

What could be paired in two ways is not paired at all, but refused.
"""

from __future__ import annotations

import collections
import os
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from ...core.errors import ImageError

#: Endings of image files, in lower case.
ENDINGS = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".pgm", ".ppm", ".webp")

#: Words, digits and what separates them: LeftImage07 is Left, Image, 07.
_FIELDS = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[^\W\d_A-Z]+|\d+|[\W_]+")

_NOUN  = r"(?:cam|camera|im|img|image|frame|view|eye|lens|stereo)?"
_SIDES = (
    (re.compile(rf"{_NOUN}left{_NOUN}", re.I), re.compile(rf"{_NOUN}right{_NOUN}", re.I)),
    (re.compile(r"l", re.I),                   re.compile(r"r", re.I)),
)
_NUMBERED = re.compile(r"cam|camera|im|img|image", re.I)

#: What replaces a side in what the names of a pair have in common; no name has it.
_GAP = "\0"


@dataclass(frozen=True)
class PairFiles:
    """Files of one pair."""

    name:  str
    left:  Path
    right: Path


def check_distinct(left: Path, right: Path) -> None:
    """Raise ImageError if two paths are of one file."""
    if left.exists() and right.exists() and os.path.samefile(left, right):
        also = "" if left == right else f", which is {right} too"
        raise ImageError(f"{left}{also}: would be left and right image at the same time")


def visible(folder: Path) -> list[Path]:
    """Return what is in a folder, without the hidden files of file managers (`._01.png`); 10 comes after 9.

    Raises
    ------
    ImageError
        There is no such folder, or it cannot be read.
    """
    if not folder.is_dir():
        raise ImageError(f"{folder}: there is no such folder")
    try:
        paths = [path for path in folder.iterdir() if not path.name.startswith(".")]
    except OSError as error:
        raise ImageError(f"{folder}: cannot be read: {error.strerror or error}") from None
    return sorted(paths, key=lambda path: [int(part) if part.isdecimal() else part
                                           for part in re.split(r"(\d+)", path.name)])


def image_files(folder: Path) -> list[Path]:
    """Return the images of a folder; raise ImageError as `visible`."""
    return [path for path in visible(folder) if path.suffix.lower() in ENDINGS and not path.is_dir()]


def _commons(stem: str, kind: int, side: int) -> set[str]:
    """Return what a name leaves in common with its partner, for each word that may be the side: 0 left, 1 right.

    `kind` is the row of the table of sides.
    """
    if kind == len(_SIDES):
        return {common for common, number in _numbers(stem) if number == str(side)}
    fields = _FIELDS.findall(stem)
    found  = set()
    for index, field in enumerate(fields):
        if _SIDES[kind][side].fullmatch(field):
            # Of camleft and camright, cam has to be equal too.
            rest = re.sub(r"left|right", "", field, flags=re.I).lower() if kind == 0 else ""
            found.add("".join([*fields[:index], rest, _GAP, *fields[index + 1:]]))
    return found


def _numbers(stem: str) -> list[tuple[str, str]]:
    """Return what is common to a series of numbered cameras or images, and the number: of `image_2` "image_", "2"."""
    fields = _FIELDS.findall(stem)
    found  = []
    for index, field in enumerate(fields):
        before = [other for other in fields[max(index - 2, 0):index] if other not in ("_", "-", ".", " ")]
        if field.isdecimal() and before and _NUMBERED.fullmatch(before[-1]):
            found.append(("".join([*fields[:index], _GAP, *fields[index + 1:]]), field))
    return found


def _clean(common: str) -> str:
    """Return the name of a pair: what is common, without the gap and the separators next to it."""
    before, _, after = common.partition(_GAP)
    if before.endswith(("_", "-", ".", " ")) and after.startswith(("_", "-", ".", " ")):
        after = after[1:]
    return f"{before}{after}".strip("_-. ")


def _side_kinds() -> range:
    return range(len(_SIDES) + 1)


def sides_of(stem: str) -> set[int]:
    """Return which sides a name may be of: 0 left, 1 right."""
    return {side for kind in _side_kinds() for side in (0, 1) if _commons(stem, kind, side)}


def _match(left: Sequence[Path], right: Sequence[Path], commons: list[dict[Path, set[str]]]
           ) -> list[tuple[str, Path, Path]]:
    """Pair the files that have something in common; raise ImageError if a file has two partners."""
    by_common = collections.defaultdict[str, list[Path]](list)
    for path in right:
        for common in commons[1].get(path, ()):
            by_common[common].append(path)
    found    = list[tuple[str, Path, Path]]()
    partners = collections.defaultdict[Path, set[Path]](set)
    for path in left:
        for common in sorted(commons[0].get(path, ())):
            for other in by_common[common]:
                found.append((common, path, other))
                partners[path].add(other)
                partners[other].add(path)
    for path, others in partners.items():
        if len(others) > 1:
            first, second = sorted(others)[:2]
            raise ImageError(f"{first} and {second} are both partners of {path} by their names: leave one of each pair "
                             "in the folder, or put the images of the two cameras into two folders, with equal "
                             "names")
    return found


def pair_names(left: Sequence[Path], right: Sequence[Path], equal: bool) -> list[PairFiles]:
    """Pair the files of two lists by their names.

    Parameters
    ----------
    left, right
        Files of either side; both may be one list.
    equal
        Whether equal names are a pair.

    Returns
    -------
    The pairs in the order of `left`, with different names.

    Raises
    ------
    ImageError
        A file has two partners, none, or itself.
    """
    _check_twins(left)
    _check_twins(right)
    found: list[tuple[str, Path, Path]] = []
    rest  = [list(left), list(right)]
    tries = [[{path: {path.stem} for path in paths} for paths in rest]] if equal else []
    tries += [[{path: _commons(path.stem, kind, side) for path in paths} for side, paths in enumerate(rest)]
              for kind in _side_kinds()]
    for commons in tries:
        more   = _match(rest[0], rest[1], commons)
        paired = {path for _, *pair in more for path in pair}
        found += more
        rest   = [[path for path in paths if path not in paired] for paths in rest]
    alone = list(dict.fromkeys([*rest[0], *rest[1]]))
    if alone:
        raise ImageError(f"{alone[0]}: has no partner by its name, nor have {len(alone) - 1} others: the files of a "
                         "pair have the same name except for left and right")
    order = {path: index for index, path in enumerate(left)}
    found = sorted(found, key=lambda one: order[one[1]])
    names = [_clean(common) or path.stem for common, path, _ in found]
    if len(set(names)) < len(names):
        names = [path.stem for _, path, _ in found]
    for _, path, other in found:
        check_distinct(path, other)
    return [PairFiles(name, path, other) for name, (_, path, other) in zip(names, found, strict=True)]


def _check_twins(paths: Iterable[Path]) -> None:
    """Raise ImageError if two files differ in their endings only."""
    seen = dict[str, Path]()
    for path in paths:
        other = seen.setdefault(path.stem, path)
        if other != path:
            raise ImageError(f"{min(other, path)} and {max(other, path)} are both partners of one image by their "
                             "names: leave one of them in the folder")


def pair_files(left: Path, right: Path) -> list[PairFiles]:
    """Find the pairs of two folders, or of one that is given twice.

    Raises
    ------
    ImageError
        There are none, a file has no partner, two of them, or itself.
    """
    if left.is_dir() and right.is_dir() and os.path.samefile(left, right):
        return pair_files_of_one(left)[0]
    images = [image_files(folder) for folder in (left, right)]
    # Of two files for one name, name the one that both are partners of.
    for one, other in (images, images[::-1]):
        twins = collections.Counter(path.stem for path in one)
        for path in other:
            if twins[path.stem] > 1:
                both = [str(twin) for twin in one if twin.stem == path.stem]
                raise ImageError(f"{both[0]} and {both[1]} are both partners of {path}: leave one of them in the "
                                 "folder")
    pairs = pair_names(images[0], images[1], equal=True)
    if not pairs:
        raise ImageError(f"{left} and {right}: no pairs of images there")
    return pairs


def pair_files_of_one(folder: Path) -> tuple[list[PairFiles], int]:
    """Find the pairs of one folder: in its folders for left and right, or by left and right in the files' names.

    Returns
    -------
    The pairs, and the number of images that have no side in their names, which are not used.

    Raises
    ------
    ImageError
        As `pair_files`.
    """
    within = {path.name.lower(): path for path in visible(folder) if path.is_dir()}
    if "left" in within and "right" in within:
        return pair_files(within["left"], within["right"]), 0
    images = image_files(folder)
    sided  = [path for path in images if sides_of(path.stem)]
    pairs  = pair_names(sided, sided, equal=False)
    if not pairs:
        raise ImageError(f"{folder}: no pairs of images there")
    _check_series(pairs, images)
    return pairs, len(images) - len(sided)


def _check_series(pairs: list[PairFiles], images: list[Path]) -> None:
    """Raise ImageError if images 0 and 1 are a pair by their numbers only, and there are more of them."""
    series = {common for pair in pairs for common, number in _numbers(pair.left.stem) if number == "0"}
    by_words = {path for pair in pairs for path in (pair.left, pair.right)
                if any(_commons(path.stem, kind, side) for kind in range(len(_SIDES)) for side in (0, 1))}
    for path in images:
        if path not in by_words and any(common in series and number not in "01" for common, number in
                                        _numbers(path.stem)):
            raise ImageError(f"{path}: is of a series of images, of which 0 and 1 need not be a pair: put the images "
                             "of the two cameras into two folders, with equal names")
