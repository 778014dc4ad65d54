#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Ctrl-C as the ordinary end of a command that otherwise runs for ever."""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Iterator
from types import FrameType


class Stop:
    """Flag that Ctrl-C has been pressed; calling it returns the flag."""

    def __init__(self) -> None:
        self.requested = False

    def __call__(self) -> bool:
        return self.requested


@contextlib.contextmanager
def stopped_by_ctrl_c() -> Iterator[Stop]:
    """Yield a `Stop` that the first Ctrl-C sets; the second one raises KeyboardInterrupt as usual."""
    stop = Stop()

    def first(number: int, frame: FrameType | None) -> None:
        stop.requested = True
        signal.signal(signal.SIGINT, before)

    # Only the main thread may install signal handlers.
    if threading.current_thread() is not threading.main_thread():
        yield stop
        return
    before = signal.signal(signal.SIGINT, first)
    try:
        yield stop
    finally:
        signal.signal(signal.SIGINT, before)
