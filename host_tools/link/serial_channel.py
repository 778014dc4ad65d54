#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Messages and console text on one serial line."""

from __future__ import annotations

from ..protocol.messages import Message
from .serial_framing import Demultiplexer, encode_frame
from .timing import Pace
from .transports import Transport


class SerialChannel:
    """A channel on a line of bytes, which it shares with the device's console.

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
        """Return the number of received COBS frames that held no message."""
        return self._demux.errors

    def timing(self, floor_s: float, initial_bytes_per_s: float) -> Pace:
        """Return a new estimate of the time per byte, which is what counts on a line."""
        return Pace(floor_s, initial_bytes_per_s)

    def wrap(self, message: bytes) -> bytes:
        """Return an encoded message as a COBS frame."""
        return encode_frame(message)

    def send(self, wrapped: bytes, resync: bool) -> None:
        """Send a COBS frame, after one more delimiter if `resync`; raise DeviceError if the line is gone."""
        # The delimiter ends what the device may take for the beginning of a frame, left by noise or by an earlier host.
        # A device that waits for a frame ignores it.
        self._transport.write(b"\0" + wrapped if resync else wrapped)

    def receive(self, timeout_s: float) -> list[Message]:
        """Return the messages that have arrived, waiting at most `timeout_s` for bytes.

        Raises DeviceError if the line is gone.
        """
        return self._demux.feed(self._transport.read(timeout_s))

    def write_console(self, text: str) -> None:
        """Send console text to the device, outside any frame; raise DeviceError if the line is gone."""
        self._transport.write(text.encode())

    def take_console(self) -> str:
        """Return the console text received since the last call."""
        return self._demux.take_console()

    def close(self) -> None:
        """Close the line."""
        self._transport.close()
