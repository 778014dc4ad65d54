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
from collections.abc import Callable, Collection, Iterable

from ..core.errors import DeviceError, LinkTimeout
from ..protocol import payloads
from ..protocol.messages import MIN_MESSAGE_BYTES, VERSION, ErrorCode, Message, MessageType
from ..protocol.refusals import refusal, version_mismatch
from .channel import Channel
from .settings import Call, LinkCounters, LinkSettings, Run, is_reply
from .silence import Silence

#: Longest wait in seconds between two hellos to a device that another host uses: that one may say goodbye.
_BUSY_WAIT_S = 0.5

#: A late copy of a hello is harmless until another request has come, so on a channel without order nothing is
#: sent for this time in seconds.
_SETTLE_S = 0.03


class Link:
    """Client of one device on one channel. Not for several threads.

    Everything raises DeviceError or one of its children when the device refuses, is gone, or does not answer;
    after an exception `forget()` what was under way before using the link again.
    """

    def __init__(self, channel: Channel, settings: LinkSettings | None = None) -> None:
        self.counters     = LinkCounters()
        self.session      = 0
        self._channel     = channel
        self._settings    = settings or LinkSettings()
        self._limit_s     = self._settings.silence_limit_s
        self._timing      = channel.timing(self._settings.timeout_floor_s, self._settings.initial_bytes_per_s)
        # A random start keeps late replies to a host before this one from matching.
        self._sequences   = itertools.count(secrets.randbits(31))
        self._transmitted = itertools.count()
        self._waiting:      deque[Call] = deque()
        self._urgent:       deque[Call] = deque()
        self._outstanding:  dict[int, Call] = {}
        self._runs:         dict[int, Run] = {}
        self._progress_at = time.monotonic()
        self._silence     = Silence()

    def limit_silence(self, limit_s: float) -> None:
        """Sets the time in seconds without any reply after which the device counts as gone."""
        self._limit_s = limit_s

    @property
    def max_tries(self) -> int:
        """How often something may be tried before the link gives up."""
        return self._settings.max_tries

    @property
    def patience_s(self) -> float:
        """Seconds that a reply to something small may take at present before it counts as late."""
        return self._timing.allowed_s(0, 1)

    def hello(self) -> payloads.Capabilities:
        """Begins a session, and waits for a device that another host uses.

        Raises DeviceError if the device stays in use, LinkTimeout if no device answers, ProtocolError if it
        speaks another version.
        """
        self._limit_s = self._settings.hello_limit_s
        try:
            capabilities = self._hello(time.monotonic() + self._limit_s)
        finally:
            self._limit_s = self._settings.silence_limit_s
        self.session = capabilities.session
        if not self._channel.ordered:
            self.idle(_SETTLE_S)
        return capabilities

    def _hello(self, give_up_at: float) -> payloads.Capabilities:
        nonce        = secrets.randbits(32)
        self.session = 0
        while True:
            call = self.submit(MessageType.HELLO, payloads.pack_number(nonce), urgent=True,
                               accepts=[ErrorCode.BUSY])
            reply = self._reply(call)
            if reply.type != MessageType.ERROR:
                break
            _, _, busy_ms = payloads.unpack_error(reply.payload)
            left_s        = give_up_at - time.monotonic()
            if left_s <= 0:
                raise DeviceError("another host uses the device, and has not let go of it for "
                                  f"{self._settings.hello_limit_s:g} s: end the program there, or wait for it")
            self.idle(min(left_s, _BUSY_WAIT_S, max(busy_ms/1000, self.patience_s)))
        capabilities = payloads.Capabilities.unpack(reply.payload)
        if capabilities.nonce != nonce:
            raise DeviceError("the device answered another host's hello: only one host can use it at a time")
        return capabilities

    def call(self, kind: MessageType, payload: bytes = b"", frame_id: int = 0) -> Message:
        """Sends one small request ahead of those that wait, and returns its reply."""
        return self._reply(self.submit(kind, payload, frame_id, urgent=True))

    def _reply(self, call: Call) -> Message:
        self.wait([call])
        if call.reply is None:
            raise DeviceError("a request was given up")
        return call.reply

    def submit(self, kind: MessageType, payload: bytes = b"", frame_id: int = 0, offset: int = 0, *,
               reply_bytes: int = 0, urgent: bool = False, on_reply: Callable[[Message], None] | None = None,
               accepts: Collection[ErrorCode] = ()) -> Call:
        """Queues a request, for `pump` to send; urgent ones pass others. The reply carries `reply_bytes`.

        An ERROR reply whose code is in `accepts` counts as reply; any other raises an exception.
        """
        request = Message(kind, self.session, self.next_sequence(), frame_id, offset, payload)
        call    = Call(request, self._channel.wrap(request.encode()),
                       reply_bytes + MIN_MESSAGE_BYTES + self._channel.overhead_bytes, on_reply, accepts)
        (self._urgent if urgent else self._waiting).append(call)
        return call

    def drop(self, call: Call) -> None:
        """Asks no more for the reply to `call`; one that comes is ignored."""
        self._outstanding.pop(call.request.sequence, None)
        for queue in (self._urgent, self._waiting):
            if call in queue:
                queue.remove(call)

    def run(self, kind: MessageType, payload: bytes, frame_id: int, offset: int,
            take: Callable[[Message], None]) -> int:
        """Sends a request with many replies at once, and once only; returns its sequence.

        `take` gets the replies, in whatever order, lost ones and repeated ones as it happens, and an ERROR
        reply as well, until `end_run`.
        """
        sequence = self.next_sequence()
        request  = Message(kind, self.session, sequence, frame_id, offset, payload)
        self._runs[sequence] = Run(request, take)
        self._channel.send(self._channel.wrap(request.encode()), False)
        return sequence

    def listen(self, kind: MessageType, sequence: int, frame_id: int, take: Callable[[Message], None]) -> None:
        """Has `take` get what comes as if in reply to a request of that kind, until `end_run`.

        It is the device's answer to the request that has that sequence, next to the reply proper.
        """
        self._runs[sequence] = Run(Message(kind, self.session, sequence, frame_id), take)

    def end_run(self, sequence: int) -> None:
        """Ignores what replies may come to a run."""
        self._runs.pop(sequence, None)

    def next_sequence(self) -> int:
        """The sequence of a request that is not made by this link, but sent on its channel."""
        return next(self._sequences) & 0xffffffff

    def flush(self) -> None:
        """Sends what is queued, as far as the window allows."""
        while call := self._next_that_fits():
            if not self._outstanding:
                self._progressed()
            self._outstanding[call.request.sequence] = call
            self.counters.requests += 1
            self._send(call)

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
        self._runs.clear()

    def pump(self, wait_s: float) -> None:
        """Sends what the window allows, takes in what comes within `wait_s`, sends again what seems lost."""
        self.flush()
        if self._outstanding:
            wait_s = min(wait_s, max(0.0, self._timeout_at() - time.monotonic()))
        broken   = self._channel.errors
        messages = self._channel.receive(wait_s)
        self._silence.listened(wait_s)
        progress = [self._receive(message) for message in messages]
        if self._channel.errors > broken:
            # A broken reply is no progress, but who sends one is there.
            self._silence.end()
        if self._outstanding and not (self._channel.ordered and any(progress)):
            self._check_time()

    def idle(self, seconds: float) -> None:
        """Pumps for a while; with nothing under way it is a pause in which console text is taken in."""
        end_at = time.monotonic() + seconds
        while (left_s := end_at - time.monotonic()) > 0:
            self.pump(left_s)

    def _next_that_fits(self) -> Call | None:
        """Takes the next request from its queue, unless the window is too full for it."""
        # While downloads fill the way back, uploads can still use the way there.
        for queue in (self._urgent, self._waiting):
            if queue and self._fits(queue[0]):
                return queue.popleft()
        return None

    def _fits(self, call: Call) -> bool:
        calls    = (call, *self._outstanding.values())
        if len(calls) > self._settings.window_requests:
            return False
        to_there = sum(len(other.wrapped) for other in calls)
        to_here  = sum(other.reply_bytes for other in calls)
        return len(calls) == 1 or max(to_there, to_here) <= self._settings.window_bytes

    def _send(self, call: Call) -> None:
        resync = call.tries > 0 or call.request.type == MessageType.HELLO
        call.tries       += 1
        call.sent_at      = time.monotonic()
        call.first_at     = call.first_at or call.sent_at
        call.transmission = next(self._transmitted)
        self._channel.send(call.wrapped, resync)

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
            return self._receive_of_run(message)
        del self._outstanding[message.sequence]
        if message.type == MessageType.ERROR and payloads.unpack_error(message.payload)[0] not in call.accepts:
            raise refusal(message)
        if message.version != VERSION:
            raise version_mismatch(message.version)
        self._measure(call)
        call.reply = message
        if call.on_reply is not None:
            call.on_reply(message)
        if self._channel.ordered:
            # What was sent before this request and is not answered has been lost.
            self._send_again([other for other in self._outstanding.values()
                              if other.transmission < call.transmission])
        return True

    def _receive_of_run(self, message: Message) -> bool:
        run = self._runs.get(message.sequence)
        if run is None or not is_reply(message, run.request) or message.version != VERSION:
            self.counters.stale_replies += 1
            return False
        self._progressed()
        run.take(message)
        return True

    def _measure(self, call: Call) -> None:
        """Takes in the time that the reply took, which has just come."""
        now = time.monotonic()
        if call.tries > 1:
            self._timing.sample_repeated(now - call.first_at, now - call.sent_at)
        else:
            # On a line a reply has to wait for the one before it.
            begin = max(call.sent_at, self._progress_at) if self._channel.ordered else call.sent_at
            self._timing.sample(now - begin, call.bytes_both_ways)
        self._progressed()

    def _progressed(self) -> None:
        self._progress_at = time.monotonic()
        self._silence.end()

    def _timeout_at(self) -> float:
        """When something counts as lost."""
        if not self._channel.ordered:
            return min(map(self._late_at, self._outstanding.values()))
        in_flight = sum(call.bytes_both_ways for call in self._outstanding.values())
        oldest    = min(self._outstanding.values(), key=lambda call: call.transmission)
        return max(self._progress_at, oldest.sent_at) + self._timing.allowed_s(in_flight, oldest.tries)

    def _late_at(self, call: Call) -> float:
        """When a request counts as lost where each has a time of its own, as a later reply shows nothing."""
        return call.sent_at + self._timing.allowed_s(call.bytes_both_ways, call.tries)

    def _check_time(self) -> None:
        now = time.monotonic()
        if self._silence.seconds > self._limit_s:
            raise LinkTimeout(f"the device has not answered for {self._limit_s:g} s: "
                              "is it running, is this its port and speed, and does no other host use it?")
        if now >= self._timeout_at():
            self.counters.timeouts += 1
            late = [call for call in self._outstanding.values()
                    if self._channel.ordered or now >= self._late_at(call)]
            self._send_again(sorted(late, key=lambda call: call.transmission))
