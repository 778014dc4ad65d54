#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Request and reply over an unreliable line: a window of requests, time limits and retransmission."""

from __future__ import annotations

import itertools
import secrets
import time
from collections import deque
from collections.abc import Callable, Iterable

from . import payloads
from .call import Call, LinkCounters, LinkSettings
from .errors import DeviceError, LinkTimeout
from .pace import Pace
from .protocol import VERSION, Message, MessageType
from .refusals import refusal, version_mismatch
from .serial_framing import Demultiplexer
from .transports import Transport


class Link:
    """Client of one device on one transport. Not for several threads.

    Everything raises DeviceError or one of its children when the device refuses, is gone, or does not answer;
    after an exception `forget()` what was under way before using the link again.
    """

    def __init__(self, transport: Transport, settings: LinkSettings | None = None) -> None:
        self.counters     = LinkCounters()
        self.demux        = Demultiplexer()
        self._transport   = transport
        self._settings    = settings or LinkSettings()
        self._limit_s     = self._settings.silence_limit_s
        self._pace        = Pace(self._settings.timeout_floor_s, self._settings.initial_bytes_per_s)
        self._session     = 0
        # A random start keeps late replies to a host before this one from matching.
        self._sequences   = itertools.count(secrets.randbits(31))
        self._transmitted = itertools.count()
        self._waiting:      deque[Call] = deque()
        self._urgent:       deque[Call] = deque()
        self._outstanding:  dict[int, Call] = {}
        self._progress_at = time.monotonic()
        # A broken reply is no progress, but who sends one is there.
        self._heard_at    = self._progress_at

    def limit_silence(self, limit_s: float) -> None:
        """Sets the time in seconds without any reply after which the device counts as gone."""
        self._limit_s = limit_s

    def hello(self) -> payloads.Capabilities:
        """Begins a session.

        Raises LinkTimeout if no device answers, ProtocolError if it speaks another version.
        """
        nonce = secrets.randbits(32)
        self._session = 0
        self._limit_s = self._settings.hello_limit_s
        try:
            reply = self.call(MessageType.HELLO, payloads.pack_number(nonce))
        finally:
            self._limit_s = self._settings.silence_limit_s
        capabilities  = payloads.Capabilities.unpack(reply.payload)
        if capabilities.nonce != nonce:
            raise DeviceError("the device answered another host's hello: only one host can use it at a time")
        self._session = capabilities.session
        return capabilities

    def call(self, kind: MessageType, payload: bytes = b"", frame_id: int = 0) -> Message:
        """Sends one small request ahead of those that wait, and returns its reply."""
        call = self.submit(kind, payload, frame_id, urgent=True)
        self.wait([call])
        if call.reply is None:
            raise DeviceError(f"the request {kind.name} was given up")
        return call.reply

    def submit(self, kind: MessageType, payload: bytes = b"", frame_id: int = 0, offset: int = 0, *,
               reply_bytes: int = 0, urgent: bool = False,
               on_reply: Callable[[Message], None] | None = None) -> Call:
        """Queues a request, for `pump` to send; urgent ones pass others. The reply carries `reply_bytes`."""
        sequence = next(self._sequences) & 0xffffffff
        request  = Message(kind, self._session, sequence, frame_id, offset, payload)
        call     = Call(request, reply_bytes, on_reply)
        (self._urgent if urgent else self._waiting).append(call)
        return call

    def wait(self, calls: Iterable[Call]) -> None:
        """Pumps until all of `calls` have been answered."""
        for call in calls:
            while call.reply is None:
                self.pump(1.0)

    def forget(self) -> None:
        """Drops every request that is queued or unanswered; replies to them will be ignored."""
        self._waiting.clear()
        self._urgent.clear()
        self._outstanding.clear()

    def pump(self, wait_s: float) -> None:
        """Sends what the window allows, takes in what comes within `wait_s`, sends again what seems lost."""
        self._fill_window()
        if self._outstanding:
            wait_s = min(wait_s, max(0.0, self._timeout_at() - time.monotonic()))
        broken   = self.demux.errors
        messages = self.demux.feed(self._transport.read(wait_s))
        progress = [self._receive(message) for message in messages]
        if self.demux.errors > broken:
            self._heard_at = time.monotonic()
        if self._outstanding and not any(progress):
            self._check_time()

    def idle(self, seconds: float) -> None:
        """Pumps for a while; with nothing under way it is a pause in which console text is taken in."""
        end_at = time.monotonic() + seconds
        while (left_s := end_at - time.monotonic()) > 0:
            self.pump(left_s)

    def write_console(self, text: str) -> None:
        """Sends console text to the device, outside of any frame."""
        self._transport.write(text.encode())

    def _fill_window(self) -> None:
        while call := self._next_that_fits():
            if not self._outstanding:
                self._progress_at = time.monotonic()
            self._outstanding[call.request.sequence] = call
            self.counters.requests += 1
            self._send(call)

    def _next_that_fits(self) -> Call | None:
        """Takes the next request from its queue, unless the window is too full for it."""
        # While downloads fill the way back, uploads can still use the way there.
        for queue in (self._urgent, self._waiting):
            if queue and self._fits(queue[0]):
                return queue.popleft()
        return None

    def _fits(self, call: Call) -> bool:
        calls    = (call, *self._outstanding.values())
        to_there = sum(len(other.framed) for other in calls)
        to_here  = sum(other.reply_bytes for other in calls)
        return len(calls) == 1 or max(to_there, to_here) <= self._settings.window_bytes

    def _send(self, call: Call) -> None:
        # One delimiter more ends whatever the device takes for the beginning of a frame, be it left behind by
        # a host before this one or made by noise; a device that waits for a frame ignores it.
        resync = call.tries > 0 or call.request.type == MessageType.HELLO
        call.tries       += 1
        call.sent_at      = time.monotonic()
        call.transmission = next(self._transmitted)
        self._transport.write(b"\0" + call.framed if resync else call.framed)

    def _send_again(self, calls: Iterable[Call]) -> None:
        for call in calls:
            if call.tries >= self._settings.max_tries:
                kind = MessageType(call.request.type).name
                raise LinkTimeout(f"no reply to {kind} after {call.tries} tries: "
                                  "the line to the device is too noisy, or the device hangs")
            self.counters.retransmissions += 1
            self._send(call)

    def _receive(self, message: Message) -> bool:
        """Takes in a message; returns whether it answers a request."""
        call = self._outstanding.get(message.sequence)
        if call is None or not call.answered_by(message):
            self.counters.stale_replies += 1
            return False
        if message.type == MessageType.ERROR:
            raise refusal(message)
        if message.version != VERSION:
            raise version_mismatch(message.version)
        del self._outstanding[message.sequence]
        now = time.monotonic()
        if call.tries == 1:
            self._pace.sample(now - max(call.sent_at, self._progress_at), call.bytes_both_ways)
        self._progress_at = now
        call.reply        = message
        if call.on_reply is not None:
            call.on_reply(message)
        # The device answers in order: what was sent before this request and is not answered has been lost.
        self._send_again([other for other in self._outstanding.values()
                          if other.transmission < call.transmission])
        return True

    def _timeout_at(self) -> float:
        in_flight = sum(call.bytes_both_ways for call in self._outstanding.values())
        oldest    = min(self._outstanding.values(), key=lambda call: call.transmission)
        return max(self._progress_at, oldest.sent_at) + self._pace.allowed_s(in_flight, oldest.tries)

    def _check_time(self) -> None:
        now = time.monotonic()
        if now - max(self._progress_at, self._heard_at) > self._limit_s:
            raise LinkTimeout(f"the device has not answered for {self._limit_s:g} s: "
                              "is it running, is this its port and speed, and does no other host use it?")
        if now >= self._timeout_at():
            self.counters.timeouts += 1
            self._send_again(sorted(self._outstanding.values(), key=lambda call: call.transmission))
