#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What all frames share on their way over a network."""

from __future__ import annotations

from dataclasses import dataclass, field

from ...link.link import Link
from ...link.udp_channel import UdpChannel
from .upload_window import UploadWindow

#: How much of the longest silence is kept with each that is shorter.
_KEPT = 0.99

#: How many times the longest silence counts as an end.
_MARGIN = 2


class Lulls:
    """Silences between parts of maps: a device may do other things meanwhile."""

    def __init__(self) -> None:
        self._longest_s = 0.0

    def note(self, seconds: float) -> None:
        """Takes in a silence that ended by itself."""
        self._longest_s = max(seconds, _KEPT*self._longest_s)

    def end_s(self, patience_s: float) -> float:
        """Length in seconds of a silence after which nothing more will come, at least `patience_s`."""
        return max(patience_s, _MARGIN*self._longest_s)


@dataclass(frozen=True)
class Route:
    """A link, the channel below it, and what is known of the network."""

    link:    Link
    channel: UdpChannel
    window:  UploadWindow = field(default_factory=UploadWindow)
    lulls:   Lulls        = field(default_factory=Lulls)
