#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Channels: what carries the messages of a link, and what a link has to know of it."""

from __future__ import annotations

from typing import Protocol

from ..protocol.messages import Message


class Timing(Protocol):
    """How long replies take, from samples."""

    def sample(self, seconds: float, byte_count: int) -> None:
        """Takes in that a request and its reply, `byte_count` bytes, took `seconds`."""

    def sample_repeated(self, since_first_s: float, since_last_s: float) -> None:
        """The same of a request that was sent more than once: nothing tells which time was answered."""

    def allowed_s(self, bytes_in_flight: int, tries: int) -> float:
        """Seconds after which a request that was sent `tries` times counts as lost."""


class Channel(Protocol):
    """A way for messages to and from a device, used by one thread.

    All methods raise DeviceError if the way is gone.
    """

    @property
    def ordered(self) -> bool:
        """Whether messages arrive in the order in which they were sent, and none comes twice."""

    @property
    def errors(self) -> int:
        """Number of things that came and were no message."""

    @property
    def overhead_bytes(self) -> int:
        """Bytes that a message is longer on its way, at least."""

    def timing(self, floor_s: float, initial_bytes_per_s: float) -> Timing:
        """What judges how long replies take here; see `LinkSettings`."""

    def wrap(self, message: bytes) -> bytes:
        """A message as it goes on its way."""

    def send(self, wrapped: bytes, resync: bool) -> None:
        """Sends a message; `resync` if the device may not know any more where a message begins."""

    def receive(self, timeout_s: float) -> list[Message]:
        """Messages that have arrived, waiting at most `timeout_s` for the first of them."""

    def close(self) -> None:
        """Closes the way; closing twice does no harm."""
