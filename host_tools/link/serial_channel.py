#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Messages and console text on one serial line."""

from __future__ import annotations

from ..protocol.messages import Message
from .pace import Pace
from .serial_framing import Demultiplexer, frame
from .transports import Transport


class SerialChannel:
    """A channel on a line of bytes, which the device's console shares.

    Parameters
    ----------
    transport
        The line, closed together with the channel.
    """

    ordered = True

    #: Two delimiters and the first code byte.
    overhead_bytes = 3

    def __init__(self, transport: Transport) -> None:
        self._transport = transport
        self._demux     = Demultiplexer()

    @property
    def errors(self) -> int:
        """Number of frames that held no message."""
        return self._demux.errors

    def timing(self, floor_s: float, initial_bytes_per_s: float) -> Pace:
        """What takes time on a line is its bytes."""
        return Pace(floor_s, initial_bytes_per_s)

    def wrap(self, message: bytes) -> bytes:
        """A message as a frame."""
        return frame(message)

    def send(self, wrapped: bytes, resync: bool) -> None:
        """Sends a frame."""
        # One delimiter more ends whatever the device takes for the beginning of a frame, be it left behind by
        # a host before this one or made by noise; a device that waits for a frame ignores it.
        self._transport.write(b"\0" + wrapped if resync else wrapped)

    def receive(self, timeout_s: float) -> list[Message]:
        """Messages that have arrived, waiting at most `timeout_s` for bytes."""
        return self._demux.feed(self._transport.read(timeout_s))

    def write_console(self, text: str) -> None:
        """Sends console text to the device, outside of any frame."""
        self._transport.write(text.encode())

    def take_console(self) -> str:
        """Console text received since the last call."""
        return self._demux.take_console()

    def close(self) -> None:
        """Closes the line."""
        self._transport.close()
