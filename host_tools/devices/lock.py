#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Whose turn it is: a device that several threads use, one at a time."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Iterator

from ..core.errors import DeviceError

#: Longest wait in seconds for another thread: a stream may go on for ever.
PATIENCE_S = 60.0


class Turns:
    """Gives a device to one thread at a time.

    A thread that has it may take it again: streams may be told apart or mixed by one thread as it likes.
    """

    def __init__(self) -> None:
        self._lock  = threading.Lock()
        self._owner = 0
        self._depth = 0

    @contextlib.contextmanager
    def turn(self) -> Iterator[None]:
        """A turn; waits for that of another thread, and raises DeviceError if that takes too long."""
        if self._owner != threading.get_ident():
            if not self._lock.acquire(timeout=PATIENCE_S):
                raise DeviceError(f"another thread has used the device for {PATIENCE_S:g} s: end its stream first, or "
                                  "give each thread a device")
            self._owner = threading.get_ident()
        self._depth += 1
        try:
            yield
        finally:
            # Maybe in another thread: a stream that nobody wants any more ends wherever it is collected.
            self._depth -= 1
            if not self._depth:
                self._owner = 0
                self._lock.release()
