#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Videos of made-up pairs, and fake cameras."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]


def write_video(path: Path, images: Sequence[Image]) -> None:
    """Write grey images (uint8, H x W) as motion JPEG in an AVI, for which OpenCV has a built-in codec."""
    height, width = images[0].shape
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 25, (width, height))
    writer.set(cv2.VIDEOWRITER_PROP_QUALITY, 100)
    assert writer.isOpened()
    for image in images:
        writer.write(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR))
    writer.release()


class FakeCapture:
    """Replacement of `cv2.VideoCapture`: cameras that show `scenes`, by their numbers, in a loop up to `frames`."""

    scenes: dict[int, Image] = {}
    frames: int              = 1 << 30
    opened: list[Any]        = []

    def __init__(self) -> None:
        self._image: Image | None = None
        self._remaining           = self.frames

    def open(self, number: int) -> bool:
        """Open camera `number` if it exists."""
        self._image = self.scenes.get(number)
        self.opened.append(self)
        return self._image is not None

    def set(self, name: int, value: float) -> bool:
        """Accept any property."""
        return True

    def grab(self) -> bool:
        """Take a frame, while any remain."""
        self._remaining -= 1
        return self._remaining >= 0

    def retrieve(self) -> tuple[bool, Image | None]:
        """Return the frame that was taken, in colour as cameras deliver it."""
        return True, cv2.cvtColor(self._image, cv2.COLOR_GRAY2BGR)

    def release(self) -> None:
        """Close the camera."""
        if self in self.opened:
            self.opened.remove(self)
