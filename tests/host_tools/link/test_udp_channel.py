#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Datagrams as a channel, the time limits of requests on it, and what random datagrams do to it."""

import contextlib
import socket
import threading
import time
from dataclasses import replace

import numpy as np
import pytest

from litestereo.host_tools.core.errors import DeviceError, LinkTimeout, ProtocolError
from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.host_tools.devices.connect import connect
from litestereo.host_tools.devices.udp.download import GapEstimate
from litestereo.host_tools.devices.udp.upload import UploadWindow
from litestereo.host_tools.link.link import Link
from litestereo.host_tools.link.settings import LinkSettings
from litestereo.host_tools.link.timing import RoundTrip
from litestereo.host_tools.link.udp_channel import UdpChannel
from litestereo.host_tools.protocol import payloads
from litestereo.host_tools.protocol.messages import MAX_MESSAGE_BYTES, REPLY, Message, MessageType, pack_header
from support.pairs import byte_generator
from support.protocol_vectors import CAPABILITIES
from support.udp_device import udp_device
from support.udp_proxy import udp_socket

QUICK = LinkSettings(silence_limit_s=1.0, hello_limit_s=1.0)


@contextlib.contextmanager
def pair_of_ends():
    """A channel, and a socket at its other end with the address that it answers to."""
    with contextlib.closing(udp_socket()) as there:
        channel = UdpChannel(*there.getsockname())
        channel.send(b"hello", False)
        there.setblocking(True)
        there.settimeout(2)
        _, here = there.recvfrom(100)
        yield channel, there, here
        channel.close()
        channel.close()


class ScriptedPeer(threading.Thread):
    """Answers each request, in another thread, with the messages that a script makes of it, or none."""

    def __init__(self, script):
        super().__init__(daemon=True)
        self.requests = []
        self._script  = script
        self._socket  = udp_socket()
        self._socket.settimeout(0.05)
        self.address  = self._socket.getsockname()
        self._ended   = threading.Event()

    def run(self):
        while not self._ended.is_set():
            with contextlib.suppress(TimeoutError):
                data, host = self._socket.recvfrom(2048)
                request    = Message.decode(data)
                self.requests.append(request)
                if request.type == MessageType.HELLO:
                    nonce   = payloads.unpack_number(request.payload)
                    answers = [request.reply(replace(CAPABILITIES, nonce=nonce).pack())]
                else:
                    answers = self._script(request)
                for answer in answers:
                    self._socket.sendto(answer.encode(), host)

    def stop(self):
        self._ended.set()
        self.join(5)
        self._socket.close()


@contextlib.contextmanager
def linked(script, settings=QUICK):
    peer = ScriptedPeer(script)
    peer.start()
    with contextlib.closing(UdpChannel(*peer.address)) as channel:
        link = Link(channel, settings)
        link.hello()
        yield link, peer
    peer.stop()


def test_a_datagram_is_a_message_and_nothing_else():
    message = Message(MessageType.READ | REPLY, 1, 2, 3, 4, bytes(range(200)))
    with pair_of_ends() as (channel, there, here):
        assert channel.receive(0.0) == channel.receive(0.01) == []
        there.sendto(message.encode(), here)
        assert channel.receive(1.0) == [message]
        channel.send(channel.wrap(message.encode()), True)
        assert there.recv(2048) == message.encode()
        assert channel.errors == 0


def test_a_chunk_goes_as_any_upload():
    chunk = memoryview(bytes(range(256))*4)
    with pair_of_ends() as (channel, there, _):
        for part in (chunk, chunk[:1], chunk[5:700]):
            channel.send_chunk(0xfffffffe, 7, 8, 9*1024, part)
            assert there.recv(2048) == Message(MessageType.UPLOAD, 0xfffffffe, 7, 8, 9*1024, bytes(part)).encode()
    header, crc = pack_header(MessageType.UPLOAD, 1, 2, 3, 4, chunk)
    assert header + chunk + crc == Message(MessageType.UPLOAD, 1, 2, 3, 4, bytes(chunk)).encode()


def test_what_is_no_message_is_counted():
    whole = Message(MessageType.READ | REPLY, 1, 2, 3, 4, bytes(1024)).encode()
    assert len(whole) == MAX_MESSAGE_BYTES
    with pair_of_ends() as (channel, there, here):
        wrong = [b"", b"LS", whole[:-1], whole + b"\0", whole*2, bytes(3000), whole[:100] + b"?" + whole[101:]]
        for data in wrong:
            there.sendto(data, here)
        there.sendto(whole, here)
        assert channel.receive(1.0) == [Message.decode(whole)]
        assert channel.errors == len(wrong)


def test_datagrams_of_others_are_not_taken():
    message = Message(MessageType.READ | REPLY, 1, 2, 3, 4).encode()
    with pair_of_ends() as (channel, _, here), contextlib.closing(udp_socket()) as stranger:
        stranger.sendto(message, here)
        assert channel.receive(0.1) == []


def test_many_datagrams_find_room():
    message = Message(MessageType.READ | REPLY, 1, 2, 3, 4, bytes(1024)).encode()
    with pair_of_ends() as (channel, there, here):
        count = min(64, channel.room)
        for _ in range(count):
            there.sendto(message, here)
        assert count >= 32
        assert sum(len(channel.receive(0.1)) for _ in range(3)) == count


def test_hosts_that_are_not_there_are_one_clear_line():
    with contextlib.closing(udp_socket()) as free:
        port = free.getsockname()[1]
    begin = time.monotonic()
    for url, text in ((f"udp://127.0.0.1:{port}", "nothing listens there"),
                      ("udp://no-such-host.invalid", "cannot find udp://no-such-host.invalid:19539"),
                      ("udp://" + "x"*70, "cannot find")):
        with pytest.raises(DeviceError, match=text) as caught:
            connect(url)
        assert "\n" not in str(caught.value)
    assert time.monotonic() - begin < 10


def test_a_host_that_says_nothing_is_given_up_within_the_limit():
    with contextlib.closing(udp_socket()) as silent:
        begin = time.monotonic()
        with pytest.raises(LinkTimeout, match="has not answered for 1 s"):
            connect(f"udp://127.0.0.1:{silent.getsockname()[1]}", QUICK)
        assert 0.9 < time.monotonic() - begin < 3


def test_a_device_that_goes_away_is_noticed():
    with udp_device() as there:
        device = connect(there.url)
    with pytest.raises(DeviceError, match="nothing listens there"):
        device.statistics()
        device.statistics()
    device.close()


def test_errors_of_the_network_are_told_apart(monkeypatch):
    with pair_of_ends() as (channel, _, __):
        for number, text in ((113, "no such host answers"), (101, "no route to that network"), (90, "MTU"),
                             (1, "not permitted")):
            class Broken:
                def sendmsg(self, _, number=number):
                    raise OSError(number, "Operation not permitted")

            monkeypatch.setattr(channel, "_socket", Broken())
            with pytest.raises(DeviceError, match=text):
                channel.send(b"x", False)
            monkeypatch.undo()

        class Full:
            def sendmsg(self, _):
                raise OSError(105, "No buffer space available")

        monkeypatch.setattr(channel, "_socket", Full())
        channel.send(b"x", False)
        monkeypatch.undo()


# Requests on it.

def test_replies_in_any_order_and_twice_cause_no_retransmission(patient):
    held = []

    def script(request):
        held.append(request.reply(request.payload))
        if len(held) < 8:
            return []
        answers = [answer for answer in reversed(held) for _ in (0, 1)]
        held.clear()
        return answers

    with linked(script) as (link, peer):
        for number in range(5):
            calls = [link.submit(MessageType.STATUS, bytes([number, index]), 1) for index in range(8)]
            link.wait(calls)
            assert [call.reply.payload for call in calls] == [bytes([number, index]) for index in range(8)]
        link.idle(0.05)
        assert (link.counters.retransmissions, link.counters.timeouts) == (0, 0)
        assert link.counters.stale_replies == 40
        assert len(peer.requests) == 41


def test_only_what_is_late_is_sent_again(patient):
    seen = []

    def script(request):
        seen.append(request.payload)
        return [] if request.payload == b"lost" and seen.count(b"lost") < 3 else [request.reply()]

    with linked(script, replace(QUICK, silence_limit_s=3.0)) as (link, _):
        calls = [link.submit(MessageType.STATUS, payload, 1) for payload in (b"a", b"lost", b"b")]
        link.wait(calls)
    assert sorted(seen) == [b"a", b"b", b"lost", b"lost", b"lost"]
    assert link.counters.retransmissions == 2


def test_a_request_that_never_gets_through_is_given_up_though_others_do():
    def script(request):
        return [] if request.payload == b"lost" else [request.reply()]

    with linked(script, replace(QUICK, max_tries=4)) as (link, peer):
        call = link.submit(MessageType.STATUS, b"lost", 1)
        with pytest.raises(LinkTimeout, match="STATUS after 4 tries"):
            while call.reply is None:
                link.call(MessageType.STATUS, b"fine", 1)
        assert sum(request.payload == b"lost" for request in peer.requests) == 4


def test_a_dropped_call_is_not_asked_again(patient):
    with linked(lambda request: []) as (link, peer):
        sent   = link.submit(MessageType.STATUS, b"sent", 1)
        link.flush()
        queued = link.submit(MessageType.STATUS, b"queued", 1)
        link.drop(sent)
        link.drop(queued)
        link.drop(queued)
        link.idle(0.1)
        assert [request.payload for request in peer.requests[1:]] == [b"sent"]


def test_a_burst_has_many_replies_until_it_ends():
    def script(request):
        parts = [replace(request.reply(bytes([index])), offset=1024*index) for index in (2, 0, 1, 1)]
        return [*parts, replace(parts[0], frame_id=9), replace(parts[0], session=9), request.reply()][:6]

    with linked(script) as (link, _):
        taken    = []
        sequence = link.request_burst(MessageType.READ, b"len", 5, 0, taken.append)
        link.idle(0.1)
        assert [part.offset for part in taken] == [2048, 0, 1024, 1024]
        assert link.counters.stale_replies == 2
        link.end_burst(sequence)
        link.end_burst(sequence)
        link.request_burst(MessageType.READ, b"len", 5, 0, taken.append)
        link.forget()
        link.idle(0.1)
        assert len(taken) == 4


def test_round_trips():
    trip = RoundTrip()
    first_s = trip.allowed_s()
    assert 0.1 <= first_s <= 1
    assert [trip.allowed_s(0, tries) for tries in (2, 3)] == [2*first_s, 4*first_s]
    assert trip.allowed_s(0, 1000) == trip.allowed_s(0, 20) == 2.0
    for _ in range(50):
        trip.sample(0.0002)
    assert trip.allowed_s() == 0.01
    # Losses do not make it wait longer.
    for _ in range(50):
        trip.sample_repeated(0.0105, 0.0003)
        trip.sample(0.0002)
    assert trip.allowed_s() == 0.01
    # A reply that comes sooner than any ever did is one to a time before the last.
    trip.sample_repeated(0.5, 0.00001)
    assert trip.allowed_s() > 0.01
    for _ in range(100):
        trip.sample(0.0002)
    # A device that becomes slow does, though each request is sent more than once.
    for _ in range(100):
        limits, sent, tries = trip.allowed_s(), [0.0], 1
        while sent[-1] + trip.allowed_s(0, tries) < 0.7:
            sent.append(sent[-1] + trip.allowed_s(0, tries))
            tries += 1
        if tries > 1:
            trip.sample_repeated(0.7, 0.7 - sent[-1])
        else:
            trip.sample(0.7)
    assert tries <= 2 and limits > 0.3


def test_a_window_adapts():
    window = UploadWindow()
    assert (window.take(3), window.take(1)) == (3, 1)
    window.give_back()
    window.give_back()
    for _ in range(20):
        window.learn(16, 0)
    assert window.batch == 48
    assert [window.take(100) for _ in range(4)] == [48, 48, 48, 0]
    for _ in range(3):
        window.give_back()
    window.learn(48, 6)
    assert window.batch == 48
    window.learn(48, 7)
    assert window.batch == 24
    for _ in range(3):
        window.learn(8, 8)
    assert window.batch == 4
    assert [window.take(100) for _ in range(4)] == [4, 4, 4, 0]
    for _ in range(3):
        window.give_back()
    window.learn(4, 0)
    assert window.batch == 6


def test_gaps_between_parts():
    gaps = GapEstimate()
    assert gaps.end_s(0.01) == 0.01
    gaps.record(0.1)
    gaps.record(0.001)
    assert 0.19 < gaps.end_s(0.01) < 0.2
    for _ in range(500):
        gaps.record(0.001)
    assert gaps.end_s(0.01) == 0.01


# Random datagrams.

def mutations(rng, seeds, count):
    """Datagrams that are random, or were messages."""
    for _ in range(count):
        kind = rng.randrange(4)
        data = bytearray(rng.choice(seeds))
        if kind == 0:
            yield rng.randbytes(rng.choice((0, 1, 27, 28, 29, 52, 1051, 1052, 1053, rng.randrange(2000))))
            continue
        if kind == 1:
            for _ in range(rng.randrange(1, 4)):
                data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
        elif kind == 2:
            del data[rng.randrange(len(data)):]
        if kind == 3 or rng.random() < 0.5:
            # With a correct CRC: the content of the message is random all the same.
            body = bytearray(data[:-4]).ljust(24, b"\0")
            for _ in range(rng.randrange(4)):
                body[rng.randrange(2, 24)] = rng.randrange(256)
            header, crc = pack_header(body[3], *(int.from_bytes(body[at:at + 4], "little") for at in (4, 8, 12, 16)),
                                      bytes(body[24:]), body[2])
            data = bytearray(header + body[24:] + crc)
        yield bytes(data)


def test_random_datagrams_are_messages_or_protocol_errors():
    rng   = byte_generator(85)
    seeds = [Message(kind | REPLY, 1, 2, 3, 4, rng.randbytes(size)).encode()
             for kind in MessageType for size in (0, 4, 8, 16, 52, 1024)]
    valid = 0
    for data in mutations(rng, seeds, 20000):
        with contextlib.suppress(ProtocolError):
            message = Message.decode(data)
            valid  += 1
            assert message.encode() == data
        for unpack in (payloads.Capabilities.unpack, payloads.FrameStatus.unpack, payloads.unpack_number,
                       payloads.unpack_opened, payloads.unpack_error, payloads.unpack_counters):
            with contextlib.suppress(ProtocolError):
                unpack(data[24:])
    assert valid > 2000


def test_a_link_goes_on_under_random_datagrams():
    """Each reply is led by a few datagrams that are not: wrong in every way but the one that matters."""
    rng = byte_generator(86)
    with udp_device() as there, connect(there.url) as device:
        put_out = there._put_out

        def with_noise(datagrams):
            for peer, datagram in datagrams:
                # Session, sequence, frame id or offset differ.
                noise = [data for data in mutations(rng, [datagram], 3) if data[4:20] != datagram[4:20]]
                put_out([(peer, data) for data in noise] + [(peer, datagram)])

        there._put_out = with_noise
        for _ in range(300):
            assert device.statistics()["sessions"] == 1
        assert device.link_counters.stale_replies > 100
        assert device._link._channel.errors > 100


def test_random_replies_to_frames_end_in_no_other_error():
    """Even a device that is mad gets no exception but one of a device's."""
    rng     = byte_generator(87)
    ended   = []
    image   = np.zeros((20, 64), np.uint8)
    for _ in range(30):
        with udp_device() as there:
            device  = connect(there.url, replace(QUICK, silence_limit_s=0.3, max_tries=4))
            put_out = there._put_out

            def mad(datagrams, put_out=put_out):
                for peer, datagram in datagrams:
                    put_out([(peer, data) for data in mutations(rng, [datagram], 1)])

            there._put_out = mad
            try:
                device.compute(image, image, MatcherSettings(32, 7))
            except (DeviceError, ProtocolError) as error:
                ended.append(str(error))
            there._put_out = lambda _: None
            device._usable = False
            device.close()
    assert ended
    assert all("\n" not in text for text in ended)


def test_a_socket_is_closed_when_hello_fails():
    with contextlib.closing(udp_socket()) as silent:
        opened = []
        make   = socket.socket

        class Noted(make):
            def __init__(self, *arguments, **options):
                super().__init__(*arguments, **options)
                opened.append(self)

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(socket, "socket", Noted)
            with pytest.raises(LinkTimeout):
                connect(f"udp://127.0.0.1:{silent.getsockname()[1]}", replace(QUICK, hello_limit_s=0.2))
    assert opened and all(one.fileno() == -1 for one in opened)
