#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Pairs of image files."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from ...core.images import read_grey
from .base import Shot, Source, shot
from .pairing import PairFiles


class FileSource(Source):
    """Pairs in image files, each once; `notices` are what was found with them."""

    def __init__(self, files: list[PairFiles], notices: Sequence[str] = ()) -> None:
        self._files  = files
        self.length  = len(files)
        self.names   = [one.name for one in files]
        self.files   = [path for one in files for path in (one.left, one.right)]
        self.notices = tuple(notices)
        self.picture_notices: list[str] = []

    def __iter__(self) -> Iterator[Shot]:
        for files in self._files:
            (left, left_notices), (right, right_notices) = read_grey(files.left), read_grey(files.right)
            self.picture_notices += left_notices + right_notices
            yield shot(files.name, (left, right))
