#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Window, time limits and retransmission of the link, against a scripted device."""

import secrets
import time
from dataclasses import replace

import pytest

from litestereo.host_tools.core.errors import DeviceError, DeviceRefused, LinkTimeout, ProtocolError, SessionLost
from litestereo.host_tools.link.link import Link
from litestereo.host_tools.link.serial_channel import SerialChannel
from litestereo.host_tools.link.serial_framing import Demultiplexer
from litestereo.host_tools.link.settings import LinkSettings
from litestereo.host_tools.link.timing import Pace
from litestereo.host_tools.protocol import payloads
from litestereo.host_tools.protocol.messages import CHUNK_BYTES, REPLY, ErrorCode, Message, MessageType
from support.pairs import byte_generator
from support.protocol_vectors import CAPABILITIES, SESSION
from support.scripted_device import ScriptedTransport, framed

QUICK = LinkSettings(timeout_floor_s=0.02, initial_bytes_per_s=1e6, silence_limit_s=0.5, hello_limit_s=0.5,
                     max_tries=100)


def answer(request):
    """What a device without frames answers."""
    if request.type == MessageType.HELLO:
        nonce = payloads.unpack_number(request.payload)
        return framed(request.reply(replace(CAPABILITIES, nonce=nonce).pack()))
    if request.type == MessageType.READ:
        return framed(request.reply(bytes(payloads.unpack_number(request.payload))))
    return framed(request.reply(request.payload[:4]))


def refuse(request, code, detail=0):
    payload = payloads.pack_error(code, request.type, detail)
    return framed(replace(request, type=MessageType.ERROR, payload=payload))


def connected(script, settings=QUICK):
    transport = ScriptedTransport(script)
    link      = Link(SerialChannel(transport), settings)
    link.hello()
    return link, transport


def upload(link, count):
    return [link.submit(MessageType.UPLOAD, bytes(CHUNK_BYTES), 1, index*CHUNK_BYTES)
            for index in range(count)]


def test_hello_gives_the_session_that_later_requests_carry():
    link, transport = connected(answer)
    link.call(MessageType.START, frame_id=3)
    assert transport.requests[0].session == 0
    assert transport.requests[1].session == SESSION
    assert transport.requests[1].sequence == transport.requests[0].sequence + 1


@pytest.mark.parametrize("ordered", [False, True])
def test_settle_time_after_hello(monkeypatch, ordered):
    """On a channel without order nothing is sent for 30 ms after a hello, so that a late copy of it comes first; a
    channel with order loses no time."""
    sent = []

    class Channel(SerialChannel):
        pass

    class Noted(ScriptedTransport):
        def write(self, data):
            sent.append(time.monotonic())
            super().write(data)

    monkeypatch.setattr(Channel, "ordered", ordered)
    # The hello is repeated as long as this device loses it: only the last one counts.
    lost = iter([True, True, False])
    link = Link(Channel(Noted(lambda request: b"" if request.type == MessageType.HELLO and next(lost)
                              else answer(request))), QUICK)
    link.hello()
    greeted = time.monotonic()
    link.call(MessageType.START, frame_id=1)
    *_, last_hello, start = sent
    assert len(sent) == 4
    assert (start - last_hello >= 0.03) == (not ordered)
    assert start >= greeted


def test_sequences_begin_anew_at_2_32(monkeypatch):
    """A session that begins shortly before: requests, bursts and chunks go on from 0, and every reply is accepted."""
    monkeypatch.setattr(secrets, "randbits", lambda bits: 2**32 - 3 if bits == 31 else 7)
    link, transport = connected(answer)
    calls  = [link.submit(MessageType.UPLOAD, bytes([index]*4)) for index in range(5)]
    link.wait(calls)
    parts  = []
    burst  = link.request_burst(MessageType.READ, payloads.pack_number(8), 1, 0, parts.append)
    while not parts:
        link.pump(0.1)
    assert [call.reply.payload for call in calls] == [bytes([index]*4) for index in range(5)]
    assert [request.sequence for request in transport.requests] == [2**32 - 3, 2**32 - 2, 2**32 - 1, 0, 1, 2, 3]
    assert (burst, parts[0].sequence, link.next_sequence()) == (3, 3, 4)
    assert link.counters.stale_replies == link.counters.retransmissions == 0


def test_replies_arrive_with_their_requests():
    link, _ = connected(answer)
    calls   = [link.submit(MessageType.UPLOAD, index.to_bytes(4, "little")) for index in range(50)]
    link.wait(calls)
    assert [int.from_bytes(call.reply.payload, "little") for call in calls] == list(range(50))
    assert link.counters.retransmissions == link.counters.timeouts == link.counters.stale_replies == 0


@pytest.mark.parametrize("kind", [MessageType.UPLOAD, MessageType.READ])
def test_bytes_in_flight_stay_within_the_window(kind):
    """Counts requests that came before anything was answered."""
    bursts, burst = [], []

    class Counting(ScriptedTransport):
        def read(self, timeout_s):
            if burst:
                bursts.append(sum(burst))
                burst.clear()
            return super().read(timeout_s)

    def script(request):
        reply = answer(request)
        burst.append(max(len(framed(request)), len(reply)))
        return reply

    link = Link(SerialChannel(Counting(script)), QUICK)
    link.hello()
    if kind == MessageType.UPLOAD:
        link.wait(upload(link, 40))
    else:
        link.wait([link.submit(MessageType.READ, payloads.pack_number(CHUNK_BYTES), 1, index*CHUNK_BYTES,
                               reply_bytes=CHUNK_BYTES) for index in range(40)])
    assert 2*CHUNK_BYTES < max(bursts) <= 4096


def test_requests_in_flight_are_no_more_than_a_device_keeps_waiting():
    """However small they are; over UDP those beyond would be dropped."""
    bursts, burst = [], []

    class Counting(ScriptedTransport):
        def read(self, timeout_s):
            bursts.append(len(burst))
            burst.clear()
            return super().read(timeout_s)

    def script(request):
        burst.append(request.sequence)
        return answer(request)

    link = Link(SerialChannel(Counting(script)), QUICK)
    link.hello()
    link.wait([link.submit(MessageType.RELEASE, frame_id=index, urgent=True) for index in range(1, 41)])
    assert max(bursts) == 8


def test_urgent_requests_pass_those_that_wait():
    link, transport = connected(answer)
    upload(link, 40)
    link.call(MessageType.STATUS, frame_id=9)
    kinds = [request.type for request in transport.requests]
    assert kinds.index(MessageType.STATUS) < 10


def test_what_a_later_reply_shows_as_lost_is_sent_again_at_once():
    lost = []

    def script(request):
        if request.type == MessageType.UPLOAD and request.offset == 2*CHUNK_BYTES and not lost:
            lost.append(request)
            return b""
        return answer(request)

    link, _ = connected(script, replace(QUICK, timeout_floor_s=30.0))
    begin   = time.monotonic()
    link.wait(upload(link, 10))
    assert time.monotonic() - begin < 5
    assert (link.counters.retransmissions, link.counters.timeouts) == (1, 0)


def test_a_lost_single_request_is_sent_again_after_the_time_limit():
    tries = []

    def script(request):
        tries.append(request)
        return answer(request) if request.type == MessageType.HELLO or len(tries) > 3 else b""

    link, _ = connected(script)
    link.call(MessageType.START, frame_id=1)
    assert (link.counters.retransmissions, link.counters.timeouts) == (2, 2)
    assert tries[1] == tries[2] == tries[3]


def test_heavy_loss_both_ways_loses_and_doubles_nothing_for_the_caller():
    for seed in range(10):
        rng = byte_generator(4, seed)

        def script(request, rng=rng):
            if rng.random() < 0.2:
                return b""
            return answer(request)*rng.choice((1, 1, 1, 2))

        link, _ = connected(script, replace(QUICK, max_tries=50, silence_limit_s=10.0, hello_limit_s=10.0))
        answered = []
        calls = [link.submit(MessageType.UPLOAD, index.to_bytes(4, "little"), on_reply=answered.append)
                 for index in range(100)]
        link.wait(calls)
        assert [int.from_bytes(call.reply.payload, "little") for call in calls] == list(range(100))
        assert len(answered) == 100


def test_stale_and_foreign_replies_are_ignored():
    def script(request):
        reply = request.reply(b"good")
        if request.type == MessageType.HELLO:
            return answer(request)
        changes = ({"session": 1}, {"sequence": request.sequence ^ 1}, {"frame_id": 77}, {"offset": 5},
                   {"type": 0x8f})
        wrong = b"".join(framed(replace(reply, payload=b"evil", **change)) for change in changes)
        return wrong + framed(reply) + framed(reply)

    link, _ = connected(script)
    assert link.call(MessageType.START, frame_id=1).payload == b"good"
    assert link.call(MessageType.STATUS, frame_id=1).payload == b"good"
    assert link.counters.stale_replies >= 10
    assert link.counters.retransmissions == 0


def test_console_text_between_replies_is_kept_apart():
    link, _ = connected(lambda request: b"hello " + answer(request) + b"world\n")
    link.call(MessageType.START)
    link.idle(0.01)
    assert link._channel.take_console() == "hello world\nhello world\n"


def test_a_silent_device_is_given_up_within_the_limit():
    for limit in ("hello", "later"):
        silent = ScriptedTransport(lambda request: b"")
        begin  = time.monotonic()
        with pytest.raises(LinkTimeout, match="has not answered for 0.5 s"):
            if limit == "hello":
                Link(SerialChannel(silent), QUICK).hello()
            else:
                connected(lambda request: answer(request) if request.type == MessageType.HELLO else b""
                          )[0].call(MessageType.START)
        assert 0.4 < time.monotonic() - begin < 2


def test_sleep_is_no_silence():
    """A program that was stopped for longer than the limit has not listened, and hears what has come meanwhile."""
    class Sleepy(ScriptedTransport):
        to_sleep = False

        def read(self, timeout_s):
            if self.to_sleep:
                self.to_sleep = False
                time.sleep(2*QUICK.silence_limit_s)
                return b""
            return super().read(timeout_s)

    transport = Sleepy(answer)
    link      = Link(SerialChannel(transport), QUICK)
    link.hello()
    transport.to_sleep = True
    assert link.call(MessageType.START).type == MessageType.START | REPLY
    assert not transport.to_sleep


def test_broken_replies_are_no_silence():
    """A line may break every reply for longer than the limit of silence; there are tries enough for that."""
    begin = time.monotonic()

    def script(request):
        if request.type == MessageType.HELLO or time.monotonic() - begin > 3*QUICK.silence_limit_s:
            return answer(request)
        broken = bytearray(answer(request))
        broken[8] ^= 1
        return bytes(broken)

    link, _ = connected(script)
    assert link.call(MessageType.START).type == MessageType.START | REPLY
    assert link.counters.retransmissions > 10
    assert link._channel.errors > 10


def test_a_lone_request_has_many_tries_within_the_limit():
    """On a noisy line one in two tries fails; ten in a row hardly ever do."""
    pace, waited_s, tries = Pace(LinkSettings().timeout_floor_s, 1e5), 0.0, 0
    while waited_s < LinkSettings().silence_limit_s:
        tries    += 1
        waited_s += pace.allowed_s(2100, tries)
    assert 10 <= tries <= LinkSettings().max_tries


def test_chatter_does_not_keep_a_dead_device_alive():
    class Chatty(ScriptedTransport):
        def read(self, timeout_s):
            time.sleep(min(timeout_s, 0.01))
            return b"boot "

    begin = time.monotonic()
    with pytest.raises(LinkTimeout):
        Link(SerialChannel(Chatty(lambda request: b"")), QUICK).hello()
    assert time.monotonic() - begin < 2


def test_one_request_that_never_gets_through_is_given_up_after_its_tries():
    def script(request):
        return b"" if request.offset == CHUNK_BYTES else answer(request)

    link, transport = connected(script, replace(QUICK, max_tries=4, silence_limit_s=10.0))
    with pytest.raises(LinkTimeout, match="UPLOAD after 4 tries"):
        link.wait(upload(link, 100))
    assert sum(request.offset == CHUNK_BYTES for request in transport.requests) == 4


def test_a_slow_device_is_not_hurried():
    """4 KB/s, as a simulated system: nothing is sent twice although a chunk takes a quarter of a second."""

    class Slow(ScriptedTransport):
        ready_at = 0.0

        def write(self, data):
            self.ready_at = max(self.ready_at, time.monotonic())
            super().write(data)

        def read(self, timeout_s):
            if not self._answers:
                time.sleep(timeout_s)
                return b""
            self.ready_at += 1059/4000 if self.requests[-1].type == MessageType.UPLOAD else 0.02
            wait_s = self.ready_at - time.monotonic()
            if wait_s > timeout_s:
                self.ready_at -= 1059/4000
                time.sleep(timeout_s)
                return b""
            time.sleep(max(0.0, wait_s))
            return super().read(timeout_s)

    link = Link(SerialChannel(Slow(answer)), LinkSettings())
    link.hello()
    link.wait(upload(link, 12))
    assert (link.counters.retransmissions, link.counters.timeouts) == (0, 0)


def test_time_away_from_the_link_costs_no_retransmission():
    """Replies that came while the caller did something else are read before anything counts as late."""
    link, transport = connected(answer)
    calls = upload(link, 3)
    link.flush()
    time.sleep(0.2)
    link.wait(calls)
    assert link.counters.timeouts == 0
    assert len(transport.requests) == 4


def test_drain_waits_for_all_replies():
    """Those of requests in flight, and of requests that the window has kept queued."""
    link, transport = connected(answer)
    calls = upload(link, 20) + [link.submit(MessageType.STATUS, urgent=True)]
    link.drain()
    assert all(call.reply is not None for call in calls)
    assert len(transport.requests) == 1 + 21
    link.drain()


def test_refusals_become_exceptions():
    def script(request):
        return answer(request) if request.type == MessageType.HELLO else refuse(request, ErrorCode.NO_SLOT, 2)

    link, _ = connected(script)
    with pytest.raises(DeviceRefused, match="OPEN.*2 frame slots") as caught:
        link.call(MessageType.OPEN)
    assert (caught.value.code, caught.value.detail) == (ErrorCode.NO_SLOT, 2)


def test_a_lost_session_is_told_apart():
    def script(request):
        return answer(request) if request.type == MessageType.HELLO else refuse(request, ErrorCode.SESSION)

    with pytest.raises(SessionLost, match="another host"):
        connected(script)[0].call(MessageType.STATUS)


@pytest.mark.parametrize("how", ["refusal", "reply"])
def test_another_protocol_version_is_named(how):
    def script(request):
        if how == "refusal":
            error = payloads.pack_error(ErrorCode.VERSION, request.type, 2)
            return framed(Message(MessageType.ERROR, 0, request.sequence, payload=error, version=2))
        return framed(replace(request.reply(CAPABILITIES.pack()), version=2))

    with pytest.raises(ProtocolError, match="protocol version 2, this host version 1"):
        Link(SerialChannel(ScriptedTransport(script)), QUICK).hello()


def test_another_hosts_hello_reply_is_not_taken():
    with pytest.raises(DeviceError, match="another host"):
        line = ScriptedTransport(lambda request: framed(request.reply(CAPABILITIES.pack())))
        Link(SerialChannel(line), QUICK).hello()


def test_hello_and_repeated_requests_are_led_by_one_more_delimiter():
    class Recording(ScriptedTransport):
        lines: tuple[bytes, ...] = ()

        def write(self, data):
            self.lines = (*self.lines, data)
            super().write(data)

    transport = Recording(lambda request: answer(request) if len(transport.lines) != 2 else b"")
    link      = Link(SerialChannel(transport), QUICK)
    link.hello()
    link.call(MessageType.START)
    assert [data.startswith(b"\0\0") for data in transport.lines] == [True, False, True]
    assert all(len(Demultiplexer().feed(data)) == 1 for data in transport.lines)
