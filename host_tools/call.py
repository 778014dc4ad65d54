#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Requests of a link, its limits and its counters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from .protocol import MIN_MESSAGE_BYTES, REPLY, Message, MessageType
from .serial_framing import frame

#: Framing around a message in bytes, at least: two delimiters and the first code byte.
_FRAMING_BYTES = 3


@dataclass(frozen=True)
class LinkSettings:
    """Limits of a link.

    `window_bytes` bounds the bytes in flight, each way. A request is sent again when no reply at all has come
    for `timeout_floor_s` and the time that the bytes in flight may take; `initial_bytes_per_s` is the speed
    until it has been measured, and that of a slow simulation. The link gives up after `max_tries` of one
    request, or after `silence_limit_s`, when it begins `hello_limit_s`, without any reply, be it broken.
    """

    window_bytes:        int   = 4096
    timeout_floor_s:     float = 1.0
    initial_bytes_per_s: float = 2000.0
    silence_limit_s:     float = 30.0
    hello_limit_s:       float = 15.0
    max_tries:           int   = 20


@dataclass
class LinkCounters:
    """What happened on a link: requests sent first, sent again, time limits reached, replies to nobody."""

    requests:        int = 0
    retransmissions: int = 0
    timeouts:        int = 0
    stale_replies:   int = 0


class Call:
    """A request under way; `reply` is None until it has been answered.

    Parameters
    ----------
    request
        The message.
    payload_bytes
        Payload that the reply will have.
    on_reply
        Called with the reply, once.
    """

    def __init__(self, request: Message, payload_bytes: int,
                 on_reply: Callable[[Message], None] | None) -> None:
        self.request      = request
        self.reply:         Message | None = None
        self.framed       = frame(request.encode())
        self.reply_bytes  = payload_bytes + MIN_MESSAGE_BYTES + _FRAMING_BYTES
        self.on_reply     = on_reply
        self.tries        = 0
        self.sent_at      = 0.0
        self.transmission = 0

    @property
    def bytes_both_ways(self) -> int:
        """Bytes on the line, of the request and of its reply."""
        return len(self.framed) + self.reply_bytes

    def answered_by(self, message: Message) -> bool:
        """Whether `message` is the reply, or the ERROR reply, to this request."""
        request = self.request
        return (message.type in (request.type | REPLY, MessageType.ERROR)
                and (message.session, message.sequence) == (request.session, request.sequence)
                and (message.frame_id, message.offset) == (request.frame_id, request.offset))
