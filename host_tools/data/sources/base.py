#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The interface of all sources of pairs."""

from __future__ import annotations

import abc
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

import cv2
import numpy as np
from numpy.typing import NDArray

from ...core.errors import ImageError
from ...devices.base import Pair, check_pair

if TYPE_CHECKING:
    from typing_extensions import Self


@dataclass(frozen=True, eq=False)
class Shot:
    """A pair of images (uint8, H x W), its name, and when it was taken, in seconds of this host's `time.monotonic`."""

    name:       str
    left:       NDArray[np.uint8]
    right:      NDArray[np.uint8]
    taken_at_s: float = field(default_factory=time.monotonic)

    @property
    def pair(self) -> Pair:
        """Both images."""
        return self.left, self.right


@dataclass(frozen=True)
class Shortfall:
    """Frames of a file that were not matched: `frames` of them, None if their number is unknown, and why."""

    file:   str
    frames: int | None
    reason: str

    def __str__(self) -> str:
        number = "frames" if self.frames is None else f"{self.frames} frame{'s'*(self.frames != 1)}"
        return f"{self.file}: {number} {self.reason}"


class Source(abc.ABC):
    """A sequence of pairs of grey images. Use it as a context manager, or `close` it.

    `length` is the number of pairs and `names` are their names, None if that is unknown. `files` are the files that are
    read, `notices` are lines about what was found and is not read. `picture_notices` is what was done to the pictures
    read so far: a line each, see `images.read_grey`. After the last pair `shortfalls` says which frames had no partner
    or could not be read; it is empty if all frames became pairs, or the iteration ended early.
    """

    length:          int | None           = None
    names:           Sequence[str] | None = None
    files:           Sequence[Path]       = ()
    notices:         Sequence[str]        = ()
    picture_notices: Sequence[str]        = ()
    shortfalls:      Sequence[Shortfall]  = ()

    @abc.abstractmethod
    def __iter__(self) -> Iterator[Shot]:
        """Iterate over the pairs; each is taken when the iterator is advanced.

        Raises
        ------
        ImageError
            A file is damaged, the images of a pair differ in size, or a camera delivers no frame.
        """

    def close(self) -> None:  # noqa: B027 - sources that hold nothing do not override it
        """Release files and cameras; a second call has no effect."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        self.close()


def grey(frame: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Convert an image of a video (uint8, H x W x 3 or H x W) to luma: uint8, H x W."""
    if frame.ndim == 3 and frame.shape[2] == 1:
        frame = frame[:, :, 0]
    return frame if frame.ndim == 2 else np.asarray(cv2.cvtColor(frame, cv2.COLOR_BGR2GRAY), np.uint8)


def halves(frame: NDArray[np.uint8], name: str) -> Pair:
    """Split a grey image (uint8, H x 2W) of both cameras into left and right; raise ImageError if its width is odd."""
    width = frame.shape[1]
    if width % 2:
        raise ImageError(f"{name}: frames {width} pixels wide are no two images side by side")
    return np.ascontiguousarray(frame[:, :width//2]), np.ascontiguousarray(frame[:, width//2:])


def shot(name: str, pair: Pair, taken_at_s: float | None = None) -> Shot:
    """Build a shot of a pair that is checked; raise ImageError, with its name, if the images differ in size."""
    try:
        check_pair(*pair)
    except ImageError as error:
        raise ImageError(f"{name}: {error}") from None
    return Shot(name, *pair) if taken_at_s is None else Shot(name, *pair, taken_at_s)
