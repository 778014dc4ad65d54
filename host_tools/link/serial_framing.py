#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""COBS frames and console text on one serial line: a frame is 0x00, COBS of a message, 0x00; the rest is text."""

from __future__ import annotations

import time
from collections.abc import Callable

from ..core.errors import ProtocolError
from ..protocol import cobs
from ..protocol.messages import MAX_MESSAGE_BYTES, Message

_DELIMITER = bytes([cobs.DELIMITER])

#: Seconds of silence inside a frame after which a receiver returns to console text.
FRAME_TIMEOUT_S = 1.0

#: Longest encoding of a message in bytes: COBS adds one byte for every 254 or part of them.
MAX_ENCODED_BYTES = MAX_MESSAGE_BYTES + -(-MAX_MESSAGE_BYTES // cobs.RUN_LENGTH)


def encode_frame(message: bytes) -> bytes:
    """Return the COBS frame of an encoded message, with a delimiter at both ends."""
    return _DELIMITER + cobs.encode(message) + _DELIMITER


class Demultiplexer:
    """Receiver of a serial line, which sorts its bytes into messages and console text.

    `errors` counts frames that held no message. `console` collects the bytes of the text until they are taken.

    Parameters
    ----------
    clock
        Returns a time in seconds, of which only differences count.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self.errors      = 0
        self.console     = bytearray()
        self._clock      = clock
        self._inside     = False
        self._frame      = bytearray()
        self._last_bytes = clock()

    def feed(self, data: bytes) -> list[Message]:
        """Return the messages that `data`, the next bytes of the line, completes."""
        now = self._clock()
        if self._inside and now - self._last_bytes > FRAME_TIMEOUT_S:
            self._abandon()
        if not data:
            return []
        self._last_bytes = now

        messages: list[Message] = []
        for index, part in enumerate(data.split(_DELIMITER)):
            if index > 0:
                self._delimiter(messages)
            if self._inside:
                # Keep one byte more than allowed, so that a frame that is too long is noticed.
                self._frame += part[:MAX_ENCODED_BYTES + 1 - len(self._frame)]
            else:
                self.console += part
        return messages

    def _abandon(self) -> None:
        self.errors += bool(self._frame)
        self._inside = False
        self._frame.clear()

    def _delimiter(self, messages: list[Message]) -> None:
        if not self._inside:
            self._inside = True
            return
        # An empty frame is the gap between the end of one frame and the beginning of the next: a frame begins here.
        if not self._frame:
            return
        try:
            messages.append(Message.decode(cobs.decode(bytes(self._frame))))
        except ProtocolError:
            self.errors += 1
        self._inside = False
        self._frame.clear()

    def take_console(self) -> str:
        """Return the console text received since the last call, with replacement characters for what is not UTF-8."""
        text = self.console.decode("utf-8", "replace")
        self.console.clear()
        return text
