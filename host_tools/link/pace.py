#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The speed of a link, measured, and the time that a reply may take."""

from __future__ import annotations

#: Share of one sample in the measured time per byte.
_WEIGHT = 0.125

#: How many times the measured time the bytes in flight may take before something counts as lost.
_MARGIN = 4

#: Most times that repeated tries lengthen the wait. Little, so that on a noisy line there is time for many tries.
_MAX_BACKOFF = 2.0


class Pace:
    """Time per byte of a link, from samples.

    Parameters
    ----------
    floor_s
        Time in seconds that is always allowed, whatever is in flight.
    initial_bytes_per_s
        Speed that is assumed until there is a sample.
    """

    def __init__(self, floor_s: float, initial_bytes_per_s: float) -> None:
        self.s_per_byte = 1/initial_bytes_per_s
        self._floor_s   = floor_s
        self._measured  = False

    def sample(self, seconds: float, byte_count: int) -> None:
        """Takes in that `byte_count` bytes, both ways, took `seconds`."""
        # A reply that noise has held up says nothing of the speed, so a single one must not count for much.
        sample = min(seconds/byte_count, 2*self.s_per_byte)
        weight = _WEIGHT if self._measured else 1.0
        self.s_per_byte += weight*(sample - self.s_per_byte)
        self._measured   = True

    def sample_repeated(self, since_first_s: float, since_last_s: float) -> None:
        """Takes in nothing: most of the time was the wait for a reply that had been lost."""

    def allowed_s(self, bytes_in_flight: int, tries: int) -> float:
        """Seconds without progress after which a request that was sent `tries` times counts as lost."""
        # Each try waits longer than the one before, within limits: the device may have become slower.
        backoff = min(_MAX_BACKOFF, 1.25**(tries - 1))
        return backoff*(self._floor_s + _MARGIN*self.s_per_byte*bytes_in_flight)
