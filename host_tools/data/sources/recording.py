#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Pairs of recordings."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from pathlib import Path

from ..recordings import RecordingReader
from .base import Shortfall, Shot, Source, shot


class RecordingSource(Source):
    """The pairs of a recording, as they were taken.

    Raises
    ------
    ImageError
        The file cannot be read, or is no recording of a stream.
    MissingExtraError
        rosbags, which has the messages, is not installed.
    """

    def __init__(self, path: Path) -> None:
        self._reader = RecordingReader(path)
        self._frames = self._reader.frames()
        self._first  = next(self._frames, None)
        self.files   = [path]
        if self._reader.cameras is not None:
            self.notices = [f"{path}: was recorded with a calibration, and is matched as then with --calibration; "
                            "`litestereo play` writes that calibration"]

    def __iter__(self) -> Iterator[Shot]:
        number = 0
        for frame in itertools.chain([] if self._first is None else [self._first], self._frames):
            yield shot(f"{frame.number:06}", (frame.left, frame.right))
            number += 1
        if self._reader.cut:
            self.shortfalls = [Shortfall(str(self._reader.path), None, f"after the first {number} cannot be read: the "
                                                                       "recording was not finished")]
