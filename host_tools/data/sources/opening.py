#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Opens sources by their names on the command line."""

from __future__ import annotations

import contextlib
from pathlib import Path

import cv2

from ...core.errors import ImageError, UsageError
from ...core.images import quiet_stderr
from .base import Source
from .files import FileSource
from .pairing import ENDINGS, PairFiles, check_distinct, pair_files, pair_files_of_one
from .recording import RecordingSource
from .video import VideoSource

_CAMERA = "camera:"

#: Ending of recordings, in lower case.
_RECORDING = ".mcap"

#: Endings of video files, in lower case. OpenCV is asked what a file with another ending is.
_VIDEOS = (".avi", ".mp4", ".mkv", ".mov", ".m4v", ".webm", ".mpg", ".mpeg", ".mjpeg", ".mjpg", ".ts", ".mts", ".m2ts",
           ".h264", ".264", ".h265", ".265", ".hevc", ".wmv", ".flv", ".ogv", ".3gp", ".y4m")

#: Examples of names, and what they mean.
EXAMPLES = {
    "left/ right/":       "two folders, whose files match by their names",
    "pairs/":             "a folder with left/ and right/, or with left and right in its files' names",
    "left.png right.png": "one pair of images",
    "left.avi right.avi": "two videos",
    "both.avi":           "a video with both images side by side",
    "recorded.mcap":      "a recording of `litestereo stream --record`",
    "camera:0 camera:1":  "two cameras, by OpenCV's numbers",
    "camera:0":           "a camera with both images side by side",
}


def open_source(names: list[str]) -> Source:
    """Open the source with one or two names; see `EXAMPLES`.

    Raises
    ------
    UsageError
        The names do not fit each other, or a camera's number is not a number.
    ImageError
        A file or folder is missing, or cannot be read.
    """
    if not 1 <= len(names) <= 2:
        raise UsageError(f"a source has one or two names, not {len(names)}")
    places = [_place(name) for name in names]
    paths  = [place for place in places if isinstance(place, Path)]
    for path in paths:
        if not path.exists():
            raise ImageError(f"{path}: there is no such file or folder")
    kinds = {_kind(place) for place in places}
    if len(kinds) > 1:
        raise UsageError(f"{names[0]} is {_kind(places[0])}, {names[1]} {_kind(places[1])}: a source is of one kind")
    kind = kinds.pop()
    if len(places) == 2 and kind != "a folder":
        if places[0] == places[1] and isinstance(places[0], int):
            raise UsageError(f"{names[0]} is the left and the right camera at the same time")
        if len(paths) == 2:
            check_distinct(*paths)
    if kind == "a folder":
        return _folders(paths)
    if kind == "a recording":
        if len(paths) == 2:
            raise UsageError(f"{paths[0]} has both images of each pair: a recording is a source alone")
        return RecordingSource(paths[0])
    if kind == "an image":
        if len(paths) == 1:
            raise UsageError(f"{paths[0]} is one image, its right one is missing")
        return FileSource([PairFiles(paths[0].stem, *paths)])
    return VideoSource(places)


def _folders(paths: list[Path]) -> Source:
    """Open one or two folders of images."""
    if len(paths) == 2 and not paths[0].samefile(paths[1]):
        return FileSource(pair_files(*paths))
    pairs, unused = pair_files_of_one(paths[0])
    text          = "images without a side in their names are" if unused > 1 else "image without a side in its name is"
    return FileSource(pairs, [f"{paths[0]}: {unused} {text} not read"]*(unused > 0))


def _place(name: str) -> Path | int:
    """Return a path, or the number of a camera; raise UsageError if it is not a number."""
    if not name.startswith(_CAMERA):
        return Path(name)
    number = name.removeprefix(_CAMERA)
    if not number.isdecimal():
        raise UsageError(f"a camera is named by OpenCV's number for it, as {_CAMERA}0, not '{name}'")
    return int(number)


def _kind(place: Path | int) -> str:
    if isinstance(place, int):
        return "a camera"
    if place.is_dir():
        return "a folder"
    ending = place.suffix.lower()
    if ending == _RECORDING:
        return "a recording"
    if ending in _VIDEOS:
        return "a video"
    if ending in ENDINGS or _is_image(place):
        return "an image"
    if _is_video(place):
        return "a video"
    raise ImageError(f"{place}: is neither an image nor a video that OpenCV can read; endings of images are "
                     f"{', '.join(ENDINGS)}, of videos {', '.join(_VIDEOS)}")


def _is_image(path: Path) -> bool:
    with quiet_stderr(), contextlib.suppress(cv2.error, UnicodeError, SystemError):
        return bool(cv2.haveImageReader(str(path)))
    return False


def _is_video(path: Path) -> bool:
    with quiet_stderr(), contextlib.suppress(cv2.error, UnicodeError, SystemError):
        capture = cv2.VideoCapture(str(path))
        try:
            return bool(capture.isOpened())
        finally:
            capture.release()
    return False
