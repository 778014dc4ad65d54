#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""How long a link has listened in vain."""

from __future__ import annotations

import time

#: Most seconds by which a look for messages may last longer than it was to and count in full. What is above that a
#: program did not listen: it was stopped, or its computer asleep.
_SLACK_S = 0.25


class Silence:
    """Seconds since the device was last heard, those left out in which nobody listened."""

    def __init__(self) -> None:
        self.seconds  = 0.0
        self._seen_at = time.monotonic()

    def end(self) -> None:
        """Takes in that the device is there, or that an answer has been due only from now on."""
        self.seconds  = 0.0
        self._seen_at = time.monotonic()

    def listened(self, wait_s: float) -> None:
        """Takes in that until now messages were waited for, for at most `wait_s`."""
        now = time.monotonic()
        self.seconds += min(now - self._seen_at, wait_s + _SLACK_S)
        self._seen_at = now
