#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Videos of made-up pairs, and cameras that are not there."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]


def write_video(path: Path, images: Sequence[Image]) -> None:
    """Writes grey images (uint8, H x W) as motion JPEG in an AVI, which OpenCV has a codec of its own for."""
    height, width = images[0].shape
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 25, (width, height))
    writer.set(cv2.VIDEOWRITER_PROP_QUALITY, 100)
    assert writer.isOpened()
    for image in images:
        writer.write(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR))
    writer.release()


class FakeCapture:
    """In place of `cv2.VideoCapture`: cameras that show `scenes`, by their numbers, over and over up to `frames`."""

    scenes: dict[int, Image] = {}
    frames: int              = 1 << 30
    opened: list[Any]        = []

    def __init__(self) -> None:
        self._image: Image | None = None
        self._left  = self.frames

    def open(self, number: int) -> bool:
        """Opens camera `number` if there is one."""
        self._image = self.scenes.get(number)
        self.opened.append(self)
        return self._image is not None

    def set(self, name: int, value: float) -> bool:
        """Takes any property."""
        return True

    def grab(self) -> bool:
        """Takes a frame, while there are some."""
        self._left -= 1
        return self._left >= 0

    def retrieve(self) -> tuple[bool, Image | None]:
        """The frame that was taken, in colour as cameras give it."""
        return True, cv2.cvtColor(self._image, cv2.COLOR_GRAY2BGR)

    def release(self) -> None:
        """Is open no more."""
        if self in self.opened:
            self.opened.remove(self)
