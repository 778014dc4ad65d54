#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Time from a datagram to its reply, measured, and the time that a reply may take."""

from __future__ import annotations

#: Time in seconds that is allowed until there is a sample, and the least and the most that ever is.
_FIRST_S   = 0.25
_FLOOR_S   = 0.01
_LONGEST_S = 2.0

#: Share of one sample in the mean, and in the mean deviation from it; and how many deviations are allowed.
_MEAN_WEIGHT   = 0.125
_SPREAD_WEIGHT = 0.25
_MARGIN        = 4


class RoundTrip:
    """The estimate that TCP has (RFC 6298), which fits a wire as well as a simulation of one."""

    def __init__(self) -> None:
        self._least_s  = 0.0
        self._mean_s   = 0.0
        self._spread_s = 0.0

    def sample(self, seconds: float, _: int = 0) -> None:
        """Takes in that a reply came `seconds` after its request."""
        seconds = min(seconds, 2*self.allowed_s())
        if self._mean_s == 0:
            self._least_s, self._mean_s, self._spread_s = seconds/2, seconds, seconds/2
            return
        self._least_s   = min(self._least_s, seconds/2)
        self._spread_s += _SPREAD_WEIGHT*(abs(seconds - self._mean_s) - self._spread_s)
        self._mean_s   += _MEAN_WEIGHT*(seconds - self._mean_s)

    def sample_repeated(self, since_first_s: float, since_last_s: float) -> None:
        """Takes in a reply to a request that was sent more than once.

        It counts from the last time, which may be too little. TCP, which learns nothing from such replies, would go
        on sending everything twice if the device became slow. A reply sooner than any belongs to a time before.
        """
        self.sample(since_last_s if since_last_s >= self._least_s else since_first_s)

    def allowed_s(self, _: int = 0, tries: int = 1) -> float:
        """Seconds after which a request that was sent `tries` times counts as lost."""
        usual_s = self._mean_s + _MARGIN*self._spread_s if self._mean_s else _FIRST_S
        backoff: int = 2**min(tries - 1, 10)
        return min(_LONGEST_S, backoff*max(_FLOOR_S, usual_s))
