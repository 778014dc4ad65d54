#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Progress bars on the terminal."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

import rich.console
import rich.progress

from ..devices.base import Progress


@contextlib.contextmanager
def progress_bars() -> Iterator[Progress]:
    """Yield a callback that shows progress, with a bar for each phase; it shows nothing if stderr is not a terminal."""
    terminal = rich.console.Console(stderr=True)
    with rich.progress.Progress(console=terminal, transient=True, disable=not terminal.is_terminal) as bars:
        yield _Bars(bars)


class _Bars:
    def __init__(self, bars: rich.progress.Progress) -> None:
        self._bars = bars
        self._tasks: dict[str, rich.progress.TaskID] = {}

    def __call__(self, phase: str, done: int, total: int) -> None:
        if phase not in self._tasks:
            self._tasks[phase] = self._bars.add_task(phase, total=total)
        self._bars.update(self._tasks[phase], completed=done, total=total)
