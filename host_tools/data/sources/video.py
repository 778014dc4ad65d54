#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Pairs from video files and cameras, read with OpenCV."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from ...core.errors import ImageError
from ...core.images import quiet_stderr
from .base import Shortfall, Shot, Source, grey, halves, shot

#: Endings of the files whose headers have the number of frames.
_COUNTED = (".avi", ".mp4", ".m4v", ".mov")

#: Longest time for counting the frames of a file that have no partner, in seconds.
_REST_LIMIT_S = 10.0

#: Images that a camera's driver queues: with one the newest image is read.
_CAMERA_BUFFERS = 1


class VideoSource(Source):
    """Pairs from one video with both images side by side, or from two videos.

    Parameters
    ----------
    inputs
        Files, or OpenCV's numbers of cameras: one with both images, or left and right.

    Raises
    ------
    ImageError
        An input cannot be opened.
    """

    def __init__(self, inputs: list[Path | int]) -> None:
        self._inputs   = inputs
        self._captures = [cv2.VideoCapture() for _ in inputs]
        try:
            for place, capture in zip(inputs, self._captures, strict=True):
                _open(capture, place)
        except BaseException:
            self.close()
            raise
        self.live     = any(isinstance(place, int) for place in inputs)
        self.files    = [place for place in inputs if isinstance(place, Path)]
        self._taken   = [0 for _ in inputs]
        self._damaged = [False for _ in inputs]
        # Numbers of images by the headers of the files, 0 if a file has no number.
        self._counts  = [0 if self.live else max(int(capture.get(cv2.CAP_PROP_FRAME_COUNT)), 0)
                         for capture in self._captures]
        self.length   = min(self._counts) or None

    def __iter__(self) -> Iterator[Shot]:
        number = 0
        while (frames := self._take()) is not None:
            images, taken_at_s = frames
            name               = f"{number:06}"
            pair               = halves(images[0], name_of(self._inputs[0])) if len(images) == 1 else images
            yield shot(name, (pair[0], pair[1]), taken_at_s)
            number += 1
        if not number:
            raise ImageError(f"{name_of(self._inputs[0])}: has no frames that can be read")
        self.shortfalls = self._missing(number)

    def _missing(self, pairs: int) -> list[Shortfall]:
        """Return what is missing at the end of the files: frames of the longer one, and the end of a file cut short."""
        found = []
        rests = [_rest(capture) for capture in self._captures]
        for index, (place, taken, count) in enumerate(zip(self._inputs, self._taken, self._counts, strict=True)):
            name  = name_of(place)
            rest  = rests[index]
            total = None if rest is None else taken + rest
            if total is None or total > pairs:
                number = None if total is None else total - pairs
                reason = f"without a partner: {name_of(self._inputs[1 - index])} has {pairs}"
                if self._damaged[index] or len(self._inputs) == 1:
                    reason = f"not matched: frame {pairs} cannot be decoded"
                found.append(Shortfall(name, number, reason))
            # Other containers have no number of frames: it is computed from the duration, and often off by some.
            if total is not None and total < count and Path(name).suffix.lower() in _COUNTED:
                found.append(Shortfall(name, count - total, "of its header cannot be read: is it cut short?"))
        return found

    def _take(self) -> tuple[list[NDArray[np.uint8]], float] | None:
        """Read the next image of each input; return them and when they were taken, None at the end."""
        # All are grabbed before any is decoded, so that both cameras' images are of the same moment.
        with quiet_stderr():
            grabbed = [capture.grab() for capture in self._captures]
            at_s    = time.monotonic()
            frames  = [capture.retrieve() for capture in self._captures] if all(grabbed) else []
        self._taken = [taken + good for taken, good in zip(self._taken, grabbed, strict=True)]
        self._damaged = [not good for good, _ in frames] or [False for _ in grabbed]
        if not frames or any(self._damaged):
            if self.live:
                raise ImageError(f"{name_of(self._inputs[grabbed.index(False) if False in grabbed else 0])}: gives no "
                                 "more frames, is it still plugged in?")
            return None
        return [grey(np.asarray(frame, np.uint8)) for _, frame in frames], at_s

    def close(self) -> None:
        """Release the files and cameras."""
        for capture in self._captures:
            capture.release()


def _rest(capture: cv2.VideoCapture) -> int | None:
    """Count the remaining frames of a file; None if that takes too long."""
    number, end_s = 0, time.monotonic() + _REST_LIMIT_S
    with quiet_stderr():
        while capture.grab():
            number += 1
            if time.monotonic() > end_s:
                return None
    return number


def name_of(place: Path | int) -> str:
    """Return the name of an input on the command line."""
    return f"camera:{place}" if isinstance(place, int) else str(place)


def _open(capture: cv2.VideoCapture, place: Path | int) -> None:
    """Open a capture; raise ImageError if it cannot be opened."""
    opened = False
    with quiet_stderr(), contextlib.suppress(cv2.error, UnicodeError, SystemError):
        opened = capture.open(place if isinstance(place, int) else str(place))
    if not opened and isinstance(place, int):
        raise ImageError(f"camera:{place}: cannot be opened: is it plugged in, and not used by another program?")
    if not opened:
        raise ImageError(f"{place}: is not a video that OpenCV can read")
    if isinstance(place, int):
        capture.set(cv2.CAP_PROP_BUFFERSIZE, _CAMERA_BUFFERS)
