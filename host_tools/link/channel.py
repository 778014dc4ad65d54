#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Channels: what carries the messages of a link, and what a link has to know about it."""

from __future__ import annotations

from typing import Protocol

from ..protocol.messages import Message
from .timing import Timing


class Channel(Protocol):
    """A path for messages to and from a device, used by one thread.

    All methods raise DeviceError if the path is gone.
    """

    @property
    def ordered(self) -> bool:
        """Return whether messages arrive in the order in which they were sent, and none arrives twice."""

    @property
    def errors(self) -> int:
        """Return the number of received frames or datagrams that were no message."""

    @property
    def overhead_bytes(self) -> int:
        """Return the fewest bytes that the channel adds to a message."""

    def timing(self, floor_s: float, initial_bytes_per_s: float) -> Timing:
        """Return a new estimate of how long replies take on this channel; see `LinkSettings` for the parameters."""

    def wrap(self, message: bytes) -> bytes:
        """Return an encoded message as the channel carries it."""

    def send(self, wrapped: bytes, resync: bool) -> None:
        """Send a wrapped message; `resync` if the device may have lost track of where a message begins."""

    def receive(self, timeout_s: float) -> list[Message]:
        """Return the messages that have arrived, waiting at most `timeout_s` for the first one."""

    def close(self) -> None:
        """Close the path; closing twice does no harm."""
