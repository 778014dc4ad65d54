#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Frames and console text on one serial line: 0x00, COBS of a message, 0x00; anything else is text."""

from __future__ import annotations

import time
from collections.abc import Callable

from ..core.errors import ProtocolError
from ..protocol import cobs
from ..protocol.messages import MAX_MESSAGE_BYTES, Message

_DELIMITER = bytes([cobs.DELIMITER])

#: Silence inside a frame, in seconds, after which a receiver goes back to console text.
FRAME_TIMEOUT_S = 1.0

#: Longest encoding of a message: COBS adds a byte per 254 begun.
MAX_ENCODED_BYTES = MAX_MESSAGE_BYTES + -(-MAX_MESSAGE_BYTES // cobs.RUN_LENGTH)


def frame(message: bytes) -> bytes:
    """`message` as it stands on the line, with a delimiter on both sides."""
    return _DELIMITER + cobs.encode(message) + _DELIMITER


class Demultiplexer:
    """Receiver of a serial line: sorts its bytes into messages and console text.

    `errors` counts frames that held no message. `console` collects the text, as bytes, until it is taken.

    Parameters
    ----------
    clock
        Gives the time in seconds; only differences count.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self.errors      = 0
        self.console     = bytearray()
        self._clock      = clock
        self._inside     = False
        self._frame      = bytearray()
        self._last_bytes = clock()

    def feed(self, data: bytes) -> list[Message]:
        """Messages that `data`, the next bytes of the line, completes."""
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
                # One byte more than allowed is kept, so that a frame that is too long shows.
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
        # A frame without content is the gap between two frames whose delimiters meet: a frame begins here.
        if not self._frame:
            return
        try:
            messages.append(Message.decode(cobs.decode(bytes(self._frame))))
        except ProtocolError:
            self.errors += 1
        self._inside = False
        self._frame.clear()

    def take_console(self) -> str:
        """Console text received since the last call; what is not UTF-8 becomes replacement characters."""
        text = self.console.decode("utf-8", "replace")
        self.console.clear()
        return text
