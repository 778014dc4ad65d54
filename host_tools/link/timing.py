#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""How long replies may take, measured on a serial line or a network, and how long a device has been silent."""

from __future__ import annotations

import time
from typing import Protocol

#: Share of one sample in the time per byte of a line.
_BYTE_WEIGHT = 0.125

#: Multiple of the measured time that the bytes in flight on a line may take.
_LINE_MARGIN = 4

#: Longest wait of a repeated try on a line, as a multiple of the first: a noisy line needs many tries in a short time.
_LINE_BACKOFF = 2.0

#: Time limit in seconds on a network before the first sample, and the shortest and the longest one after it.
_FIRST_S   = 0.25
_FLOOR_S   = 0.01
_LONGEST_S = 2.0

#: Share of one sample in the mean round trip and in its mean deviation, and how many deviations are allowed.
_MEAN_WEIGHT   = 0.125
_SPREAD_WEIGHT = 0.25
_TRIP_MARGIN   = 4

#: Allowed lateness of a poll in seconds. Anything above means that the process was suspended, and does not count as
#: silence.
_SLACK_S = 0.25


class Timing(Protocol):
    """An estimate of how long replies take."""

    def sample(self, seconds: float, byte_count: int) -> None:
        """Record that a request and its reply, `byte_count` bytes together, took `seconds`."""

    def sample_repeated(self, since_first_s: float, since_last_s: float) -> None:
        """Record a reply to a request that was sent more than once: it may belong to any of the copies."""

    def allowed_s(self, bytes_in_flight: int, tries: int) -> float:
        """Return the seconds after which a request that was sent `tries` times counts as lost."""


class Pace:
    """Time limits of a serial line, from its measured time per byte.

    Parameters
    ----------
    floor_s
        Seconds that are always allowed, however little is in flight.
    initial_bytes_per_s
        Assumed speed before the first sample.
    """

    def __init__(self, floor_s: float, initial_bytes_per_s: float) -> None:
        self.s_per_byte = 1/initial_bytes_per_s
        self._floor_s   = floor_s
        self._measured  = False

    def sample(self, seconds: float, byte_count: int) -> None:
        """Record that `byte_count` bytes, both ways together, took `seconds`."""
        # Noise may delay a reply, which says nothing about the speed: a single sample must not count for much.
        sample = min(seconds/byte_count, 2*self.s_per_byte)
        weight = _BYTE_WEIGHT if self._measured else 1.0
        self.s_per_byte += weight*(sample - self.s_per_byte)
        self._measured   = True

    def sample_repeated(self, since_first_s: float, since_last_s: float) -> None:
        """Record nothing: most of that time was spent waiting for a reply that was lost."""

    def allowed_s(self, bytes_in_flight: int, tries: int) -> float:
        """Return the seconds without progress after which a request that was sent `tries` times counts as lost."""
        # Each try waits a little longer than the one before: the device may have become slower.
        backoff = min(_LINE_BACKOFF, 1.25**(tries - 1))
        return backoff*(self._floor_s + _LINE_MARGIN*self.s_per_byte*bytes_in_flight)


class RoundTrip:
    """Time limits of a network, from measured round trips: TCP's estimate (RFC 6298), which also fits simulations."""

    def __init__(self) -> None:
        self._least_s  = 0.0
        self._mean_s   = 0.0
        self._spread_s = 0.0

    def sample(self, seconds: float, _: int = 0) -> None:
        """Record that a reply came `seconds` after its request."""
        seconds = min(seconds, 2*self.allowed_s())
        if self._mean_s == 0:
            self._least_s, self._mean_s, self._spread_s = seconds/2, seconds, seconds/2
            return
        self._least_s   = min(self._least_s, seconds/2)
        self._spread_s += _SPREAD_WEIGHT*(abs(seconds - self._mean_s) - self._spread_s)
        self._mean_s   += _MEAN_WEIGHT*(seconds - self._mean_s)

    def sample_repeated(self, since_first_s: float, since_last_s: float) -> None:
        """Record a reply to a request that was sent more than once.

        It counts from the last copy, which may be too short. TCP ignores such replies; a link that did so would keep
        sending everything twice after the device has become slow. A reply that is faster than any before answers an
        earlier copy: it counts from the first one.
        """
        self.sample(since_last_s if since_last_s >= self._least_s else since_first_s)

    def allowed_s(self, _: int = 0, tries: int = 1) -> float:
        """Return the seconds after which a request that was sent `tries` times counts as lost."""
        usual_s = self._mean_s + _TRIP_MARGIN*self._spread_s if self._mean_s else _FIRST_S
        backoff: int = 2**min(tries - 1, 10)
        return min(_LONGEST_S, backoff*max(_FLOOR_S, usual_s))


class Silence:
    """Time for which the host has listened without hearing the device."""

    def __init__(self) -> None:
        self.seconds = 0.0
        self._since  = time.monotonic()

    def reset(self) -> None:
        """Start again at 0: the device was heard, or a reply is due from now on only."""
        self.seconds = 0.0
        self._since  = time.monotonic()

    def add_wait(self, wait_s: float) -> None:
        """Count the time since the last call, in which the host listened for `wait_s` at most."""
        now = time.monotonic()
        self.seconds += min(now - self._since, wait_s + _SLACK_S)
        self._since   = now
