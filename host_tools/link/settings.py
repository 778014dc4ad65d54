#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Requests of a link, its limits and its counters."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass

from ..protocol.messages import REPLY, ErrorCode, Message, MessageType


@dataclass(frozen=True)
class LinkSettings:
    """Limits of a link.

    `window_bytes` bounds the bytes of requests and their replies in flight, each way, and `window_requests`
    their number: a device has room for so many that wait. On a serial line a request is sent again when no
    reply at all has come for `timeout_floor_s` and the time that the bytes in flight may take;
    `initial_bytes_per_s` is the speed until it has been measured, and that of a slow simulation. The link gives
    up after `max_tries` of one request, or after `silence_limit_s`, when it begins `hello_limit_s`, without any
    reply, be it broken; while the program was stopped does not count. It waits as long for a device that
    another host uses.
    """

    window_bytes:        int   = 4096
    window_requests:     int   = 8
    timeout_floor_s:     float = 1.0
    initial_bytes_per_s: float = 2000.0
    silence_limit_s:     float = 30.0
    hello_limit_s:       float = 15.0
    max_tries:           int   = 20


@dataclass
class LinkCounters:
    """What happened on a link: requests sent first, sent again, time limits reached, replies to nobody.

    Over UDP, besides: chunks of images sent first and sent again, parts of maps that came first, that came
    again and that were asked for again, bytes of images and maps that arrived, and the seconds that took.
    """

    requests:          int   = 0
    retransmissions:   int   = 0
    timeouts:          int   = 0
    stale_replies:     int   = 0
    chunks_sent:       int   = 0
    chunks_sent_again: int   = 0
    parts_received:    int   = 0
    parts_repeated:    int   = 0
    parts_asked_again: int   = 0
    bytes_uploaded:    int   = 0
    bytes_downloaded:  int   = 0
    upload_s:          float = 0.0
    download_s:        float = 0.0

    @property
    def repairs(self) -> int:
        """How often something had to be sent again, or asked for again."""
        return self.retransmissions + self.chunks_sent_again + self.parts_asked_again


class Call:
    """A request under way; `reply` is None until it has been answered.

    Parameters
    ----------
    request
        The message.
    wrapped
        The same as it goes on its way.
    reply_bytes
        Bytes that the reply will have on its way.
    on_reply
        Called with the reply, once.
    accepts
        Codes of ERROR replies that count as a reply, and raise nothing.
    """

    def __init__(self, request: Message, wrapped: bytes, reply_bytes: int,
                 on_reply: Callable[[Message], None] | None, accepts: Collection[ErrorCode]) -> None:
        self.request      = request
        self.reply:         Message | None = None
        self.wrapped      = wrapped
        self.reply_bytes  = reply_bytes
        self.on_reply     = on_reply
        self.accepts      = accepts
        self.tries        = 0
        self.first_at     = 0.0
        self.sent_at      = 0.0
        self.transmission = 0

    @property
    def bytes_both_ways(self) -> int:
        """Bytes on the way, of the request and of its reply."""
        return len(self.wrapped) + self.reply_bytes

    def answered_by(self, message: Message) -> bool:
        """Whether `message` is the reply, or the ERROR reply, to this request."""
        return is_reply(message, self.request) and message.offset == self.request.offset


class Run:
    """A READ that has many replies, each at its own offset; `take` gets them all, and an ERROR reply as well."""

    def __init__(self, request: Message, take: Callable[[Message], None]) -> None:
        self.request = request
        self.take    = take


def is_reply(message: Message, request: Message) -> bool:
    """Whether `message` answers `request`, at whatever offset."""
    return (message.type in (request.type | REPLY, MessageType.ERROR)
            and (message.session, message.sequence) == (request.session, request.sequence)
            and message.frame_id == request.frame_id)
