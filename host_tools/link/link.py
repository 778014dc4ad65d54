#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Requests and replies over an unreliable channel: a window of requests, time limits and retransmission."""

from __future__ import annotations

import itertools
import secrets
import time
from collections import deque
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass

from ..core.errors import DeviceError, LinkTimeout
from ..protocol import payloads
from ..protocol.messages import MIN_MESSAGE_BYTES, REPLY, VERSION, ErrorCode, Message, MessageType
from ..protocol.refusals import refusal, version_mismatch
from .channel import Channel
from .settings import LinkCounters, LinkSettings
from .timing import Silence

#: Longest wait in seconds between two hellos to a device that another host uses: that host may end its session.
_BUSY_WAIT_S = 0.5

#: Pause in seconds after a hello on a channel without order: a late copy of it does harm once another request has come.
_SETTLE_S = 0.03

#: Longest wait in seconds of one `pump` while a reply is waited for.
_PUMP_S = 1.0


class Call:
    """A request in flight, or queued.

    `reply` is None until the request has been answered.

    Parameters
    ----------
    request
        The message.
    wrapped
        The message as the channel carries it.
    reply_bytes
        Bytes of the reply as the channel carries it.
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
        """Return the bytes of the request and of its reply as the channel carries them."""
        return len(self.wrapped) + self.reply_bytes

    def is_answered_by(self, message: Message) -> bool:
        """Return whether `message` is the reply, or the ERROR reply, to this request."""
        return is_reply(message, self.request) and message.offset == self.request.offset


@dataclass(frozen=True)
class MultiReply:
    """A request with a burst of replies, each at its own offset; `take` gets all of them, an ERROR reply too."""

    request: Message
    take:    Callable[[Message], None]


def is_reply(message: Message, request: Message) -> bool:
    """Return whether `message` is a reply to `request`, at any offset."""
    return (message.type in (request.type | REPLY, MessageType.ERROR)
            and (message.session, message.sequence) == (request.session, request.sequence)
            and message.frame_id == request.frame_id)


class Link:
    """Client of one device on one channel, for one thread.

    Methods that send or receive raise DeviceError or one of its children if the device refuses, is gone or does not
    answer. After an exception `forget()` what is in flight before using the link again.

    Parameters
    ----------
    channel
        Carries the messages.
    settings
        Limits, the default ones if None.
    """

    def __init__(self, channel: Channel, settings: LinkSettings | None = None) -> None:
        self.counters     = LinkCounters()
        self.session      = 0
        self._channel     = channel
        self._settings    = settings or LinkSettings()
        self._limit_s     = self._settings.silence_limit_s
        self._timing      = channel.timing(self._settings.timeout_floor_s, self._settings.initial_bytes_per_s)
        # A random start keeps late replies to an earlier host from matching.
        self._sequences   = itertools.count(secrets.randbits(31))
        self._transmitted = itertools.count()
        self._waiting:      deque[Call] = deque()
        self._urgent:       deque[Call] = deque()
        self._outstanding:  dict[int, Call] = {}
        self._bursts:       dict[int, MultiReply] = {}
        self._progress_at = time.monotonic()
        self._silence     = Silence()

    @property
    def ordered(self) -> bool:
        """Return whether the channel keeps the order of messages."""
        return self._channel.ordered

    @property
    def max_tries(self) -> int:
        """Return how often anything may be tried before the link gives up."""
        return self._settings.max_tries

    @property
    def patience_s(self) -> float:
        """Return the seconds after which a small reply counts as late at present."""
        return self._timing.allowed_s(0, 1)

    def limit_silence(self, limit_s: float) -> None:
        """Set the seconds without any reply after which the device counts as gone."""
        self._limit_s = limit_s

    # Sessions.

    def hello(self) -> payloads.Capabilities:
        """Begin a session, and wait for a device that another host uses.

        Raises
        ------
        DeviceError
            The device stays in use.
        LinkTimeout
            No device answers.
        ProtocolError
            The device speaks another version of the protocol.
        """
        nonce         = secrets.randbits(32)
        self.session  = 0
        self._limit_s = self._settings.hello_limit_s
        give_up_at    = time.monotonic() + self._limit_s
        try:
            while True:
                call = self.submit(MessageType.HELLO, payloads.pack_number(nonce), urgent=True,
                                   accepts=[ErrorCode.BUSY])
                while call.reply is None:
                    self.pump(_PUMP_S)
                if call.reply.type != MessageType.ERROR:
                    break
                self._wait_while_busy(call.reply, give_up_at)
        finally:
            self._limit_s = self._settings.silence_limit_s
        capabilities = payloads.Capabilities.unpack(call.reply.payload)
        if capabilities.nonce != nonce:
            raise DeviceError("the device answered another host's hello: only one host can use it at a time")
        self.session = capabilities.session
        if not self.ordered:
            self.idle(_SETTLE_S)
        return capabilities

    def _wait_while_busy(self, reply: Message, give_up_at: float) -> None:
        _, _, busy_ms = payloads.unpack_error(reply.payload)
        remaining_s   = give_up_at - time.monotonic()
        if remaining_s <= 0:
            raise DeviceError("another host uses the device and has not released it for "
                              f"{self._settings.hello_limit_s:g} s: end the program there, or wait for it")
        self.idle(min(remaining_s, _BUSY_WAIT_S, max(busy_ms/1000, self.patience_s)))

    # Requests.

    def call(self, kind: MessageType, payload: bytes = b"", frame_id: int = 0) -> Message:
        """Send one small request ahead of those that are queued, and return its reply."""
        call = self.submit(kind, payload, frame_id, urgent=True)
        while call.reply is None:
            self.pump(_PUMP_S)
        return call.reply

    def submit(self, kind: MessageType, payload: bytes = b"", frame_id: int = 0, offset: int = 0, *,
               reply_bytes: int = 0, urgent: bool = False, on_reply: Callable[[Message], None] | None = None,
               accepts: Collection[ErrorCode] = ()) -> Call:
        """Queue a request, which `pump` or `flush` sends.

        Parameters
        ----------
        kind, payload, frame_id, offset
            Fields of the message.
        reply_bytes
            Length of the reply's payload.
        urgent
            Whether the request goes before those that are not urgent.
        on_reply
            Called with the reply.
        accepts
            Codes of ERROR replies that count as a reply; any other ERROR reply raises an exception.
        """
        request = Message(kind, self.session, self.next_sequence(), frame_id, offset, payload)
        call    = Call(request, self._channel.wrap(request.encode()),
                       reply_bytes + MIN_MESSAGE_BYTES + self._channel.overhead_bytes, on_reply, accepts)
        (self._urgent if urgent else self._waiting).append(call)
        return call

    def drop(self, call: Call) -> None:
        """Stop waiting for the reply to `call`, and ignore it if it comes."""
        self._outstanding.pop(call.request.sequence, None)
        for queue in (self._urgent, self._waiting):
            if call in queue:
                queue.remove(call)

    def request_burst(self, kind: MessageType, payload: bytes, frame_id: int, offset: int,
                      take: Callable[[Message], None]) -> int:
        """Send a request with many replies at once, and only once; return its sequence.

        Until `end_burst`, `take` gets the replies as they come, an ERROR reply too: in any order, some of them
        repeatedly, some never.
        """
        sequence = self.next_sequence()
        request  = Message(kind, self.session, sequence, frame_id, offset, payload)
        self._bursts[sequence] = MultiReply(request, take)
        self._channel.send(self._channel.wrap(request.encode()), False)
        return sequence

    def listen(self, kind: MessageType, sequence: int, frame_id: int, take: Callable[[Message], None]) -> None:
        """Have `take` get, until `end_burst`, what comes as replies of that kind with that sequence.

        The device sends them after the request of that sequence, in addition to its proper reply.
        """
        self._bursts[sequence] = MultiReply(Message(kind, self.session, sequence, frame_id), take)

    def end_burst(self, sequence: int) -> None:
        """Ignore further replies to the request of that sequence."""
        self._bursts.pop(sequence, None)

    def next_sequence(self) -> int:
        """Return a sequence for a message that is sent on the channel, and not by this link."""
        return next(self._sequences) & 0xffffffff

    def wait(self, calls: Iterable[Call]) -> None:
        """Pump until all of `calls` have been answered."""
        for call in calls:
            while call.reply is None:
                self.pump(_PUMP_S)

    def drain(self) -> None:
        """Pump until every request has been answered."""
        while self._outstanding or self._urgent or self._waiting:
            self.pump(_PUMP_S)

    def idle(self, seconds: float) -> None:
        """Pump for `seconds`; if nothing is in flight this is a pause, in which console text is received."""
        end_at = time.monotonic() + seconds
        while (remaining_s := end_at - time.monotonic()) > 0:
            self.pump(remaining_s)

    def forget(self) -> None:
        """Drop all requests that are queued or unanswered, and ignore replies to them."""
        self._waiting.clear()
        self._urgent.clear()
        self._outstanding.clear()
        self._bursts.clear()

    # Sending and receiving.

    def pump(self, wait_s: float) -> None:
        """Send what the window allows, handle what arrives within `wait_s`, and send again what seems lost."""
        self.flush()
        if self._outstanding:
            wait_s = min(wait_s, max(0.0, self._timeout_at() - time.monotonic()))
        broken   = self._channel.errors
        messages = self._channel.receive(wait_s)
        self._silence.add_wait(wait_s)
        progress = False
        for message in messages:
            progress = self._receive(message) or progress
        if self._channel.errors > broken:
            # A broken reply is no progress, but its sender is there.
            self._silence.reset()
        if self._outstanding and not (self.ordered and progress):
            self._check_time()

    def flush(self) -> None:
        """Send what is queued, as far as the window allows."""
        while call := self._next_that_fits():
            if not self._outstanding:
                self._progressed()
            self._outstanding[call.request.sequence] = call
            self.counters.requests += 1
            self._send(call)

    def _next_that_fits(self) -> Call | None:
        """Return the next request, taken from its queue, or None if the window has no room for it."""
        # While downloads fill the way from the device, uploads can still use the way to it.
        for queue in (self._urgent, self._waiting):
            if queue and self._fits(queue[0]):
                return queue.popleft()
        return None

    def _fits(self, call: Call) -> bool:
        calls = (call, *self._outstanding.values())
        if len(calls) > self._settings.window_requests:
            return False
        to_device = sum(len(other.wrapped) for other in calls)
        to_host   = sum(other.reply_bytes for other in calls)
        return len(calls) == 1 or max(to_device, to_host) <= self._settings.window_bytes

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
        """Handle a message; return whether it answers a request."""
        call = self._outstanding.get(message.sequence)
        if call is None or not call.is_answered_by(message):
            burst = self._bursts.get(message.sequence)
            if burst is None or not is_reply(message, burst.request) or message.version != VERSION:
                self.counters.stale_replies += 1
                return False
            self._progressed()
            burst.take(message)
            return True
        del self._outstanding[message.sequence]
        if message.type == MessageType.ERROR and payloads.unpack_error(message.payload)[0] not in call.accepts:
            raise refusal(message)
        if message.version != VERSION:
            raise version_mismatch(message.version)
        self._record_time(call)
        call.reply = message
        if call.on_reply is not None:
            call.on_reply(message)
        if self.ordered:
            # What was sent before this request and has not been answered is lost.
            self._send_again([other for other in self._outstanding.values()
                              if other.transmission < call.transmission])
        return True

    def _record_time(self, call: Call) -> None:
        """Record how long the reply to `call`, which has just come, has taken."""
        now = time.monotonic()
        if call.tries > 1:
            self._timing.sample_repeated(now - call.first_at, now - call.sent_at)
        else:
            # On a line a reply has to wait for the one before it.
            begin = max(call.sent_at, self._progress_at) if self.ordered else call.sent_at
            self._timing.sample(now - begin, call.bytes_both_ways)
        self._progressed()

    def _progressed(self) -> None:
        self._progress_at = time.monotonic()
        self._silence.reset()

    def _timeout_at(self) -> float:
        """Return the time at which the next request counts as lost."""
        if not self.ordered:
            return min(map(self._late_at, self._outstanding.values()))
        in_flight = sum(call.bytes_both_ways for call in self._outstanding.values())
        oldest    = min(self._outstanding.values(), key=lambda call: call.transmission)
        return max(self._progress_at, oldest.sent_at) + self._timing.allowed_s(in_flight, oldest.tries)

    def _late_at(self, call: Call) -> float:
        """Return the time at which `call` counts as lost where no later reply shows it, as messages change places."""
        return call.sent_at + self._timing.allowed_s(call.bytes_both_ways, call.tries)

    def _check_time(self) -> None:
        """Send again what is late; raise LinkTimeout if the device has been silent for too long."""
        now = time.monotonic()
        if self._silence.seconds > self._limit_s:
            raise LinkTimeout(f"the device has not answered for {self._limit_s:g} s: "
                              "is it running, is this its port and speed, and does no other host use it?")
        if now >= self._timeout_at():
            self.counters.timeouts += 1
            late = [call for call in self._outstanding.values() if self.ordered or now >= self._late_at(call)]
            self._send_again(sorted(late, key=lambda call: call.transmission))
