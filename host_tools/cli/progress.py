#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Progress on stderr, if that is a terminal."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator

import rich.console
import rich.progress

from ..devices.base import Progress


def terminal_bars(*columns: rich.progress.ProgressColumn) -> rich.progress.Progress:
    """Return bars on stderr, which disappear at the end; none are shown if stderr is not a terminal."""
    # Redirected text appears above the bars, on stderr: not what a file or another program is to get.
    return rich.progress.Progress(*columns, console=rich.console.Console(stderr=True), transient=True,
                                  disable=not sys.stderr.isatty(), redirect_stdout=sys.stdout.isatty())


@contextlib.contextmanager
def progress_bars() -> Iterator[Progress]:
    """Yield a callback that shows progress, with a bar for each phase; it shows nothing if stderr is not a terminal."""
    with terminal_bars() as bars:
        yield _Bars(bars)


class _Bars:
    def __init__(self, bars: rich.progress.Progress) -> None:
        self._bars = bars
        self._tasks: dict[str, rich.progress.TaskID] = {}

    def __call__(self, phase: str, done: int, total: int) -> None:
        if phase not in self._tasks:
            self._tasks[phase] = self._bars.add_task(phase, total=total)
        self._bars.update(self._tasks[phase], completed=done, total=total)
