#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Devices on a network against one in Python: bad networks, slow devices, other hosts, lost sessions."""

import contextlib
import itertools
import threading
import time
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from litestereo.host_tools.core.errors import (
    DeviceError,
    DeviceRefused,
    ImageError,
    LinkTimeout,
    ProtocolError,
    SessionLost,
)
from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.host_tools.devices.connect import connect
from litestereo.host_tools.link.settings import LinkSettings
from litestereo.host_tools.protocol.messages import CHUNK_BYTES, MessageType
from support import expected
from support import udp_device as udp_device_module
from support.chunks import image_chunks, pair_chunks
from support.expected import SETTINGS
from support.pairs import byte_generator, pairs
from support.udp_device import made_up_map, udp_device
from support.udp_faults import Faults, bad_ways

QUICK = LinkSettings(silence_limit_s=1.0, hello_limit_s=1.0)

expect = partial(expected.expect, expected=made_up_map)


@pytest.mark.parametrize(("width", "height"), [(38, 7), (64, 16), (65, 33), (640, 480)])
def test_a_good_network_needs_no_repair(width, height, patient):
    sent = pairs(4, width, height)
    with udp_device() as there, connect(there.url) as device:
        for result, pair in zip(device.stream(sent, SETTINGS), sent, strict=True):
            expect(result, pair)
            assert result.upload_s > 0 and result.match_s > 0 and result.download_s > 0
        host = device.link_counters
        assert device.statistics()["chunks_received"] == host.chunks_sent == 4*image_chunks(width, height)
        assert host.repairs == host.parts_repeated == 0
        assert host.parts_received == 4*pair_chunks(width, height)
        assert host.bytes_uploaded == host.bytes_downloaded == 4*2*width*height
        assert host.upload_s > 0 and host.download_s > 0


@pytest.mark.parametrize("seed", range(4))
def test_many_small_frames_on_a_bad_network(seed):
    """Nothing is lost or swapped, and what was sent again is what had to be, or little more."""
    sent = pairs(60, 64, 20)
    to_device, to_host = bad_ways(81, seed)
    with udp_device(to_device, to_host) as there, connect(there.url) as device:
        for result, pair in zip(device.stream(sent, SETTINGS), sent, strict=True):
            expect(result, pair)
        host    = device.link_counters
        counted = device.statistics()
    for faults in (to_device, to_host):
        for kind in ("lost", "duplicated", "reordered", "flipped"):
            assert getattr(faults, kind) > 0
    chunks = 60*image_chunks(64, 20)
    again  = counted["frames_opened"] - 60
    assert counted["sessions"] == 1
    assert counted["frames_matched"] == 60
    # A late copy of an OPEN opens a frame again, and late copies of its chunks may fill it.
    assert 0 <= again <= to_device.duplicated
    assert chunks <= counted["chunks_received"] <= chunks + again*image_chunks(64, 20)
    assert host.chunks_sent == chunks
    assert host.parts_received == 60*pair_chunks(64, 20)
    # What the device counted on its way is in the reply, which is not yet counted itself.
    entered = to_device.carried - to_device.lost + to_device.duplicated
    assert counted["datagrams_received"] <= there.counters["datagrams_received"] <= entered
    assert there.counters["datagrams_malformed"] <= to_device.flipped
    assert host.repairs < 60*10


def test_a_large_frame_on_a_bad_network():
    (pair,) = pairs(1, 640, 400)
    to_device, to_host = bad_ways(81, 10)
    with udp_device(to_device, to_host) as there, connect(there.url) as device:
        expect(device.compute(*pair, SETTINGS), pair)
        host, chunks = device.link_counters, image_chunks(640, 400)
    assert 0 < host.chunks_sent_again < chunks/2
    assert 0 < host.parts_asked_again < chunks/2


def test_settings_that_change_on_a_bad_network():
    """A late copy of the CONFIGURE before must not change a frame."""
    sent   = pairs(40, 64, 20)
    choice = [MatcherSettings(16, size) for size in (5, 7, 9)]
    ways   = bad_ways(81, 11, loss=0.02, duplication=0.3, reordering=0.3)
    with udp_device(*ways) as there, connect(there.url) as device:
        for pair, settings in zip(sent, itertools.cycle(choice), strict=False):
            expect(device.compute(*pair, settings), pair, settings)


def test_a_configure_that_comes_late_changes_no_frame():
    """The copy of the first one arrives when the second has been answered, before the frame is opened."""
    sent, copies = pairs(2, 64, 20), []
    choice       = [MatcherSettings(16, 5), MatcherSettings(16, 9)]
    with udp_device() as there:
        receive = there._receive

        def with_copies(peer, datagram):
            kind = datagram[3]
            if kind == MessageType.CONFIGURE:
                copies.append(datagram)
            if kind == MessageType.OPEN and len(copies) > 1:
                receive(peer, copies[0])
            receive(peer, datagram)

        there._receive = with_copies
        with connect(there.url) as device:
            for pair, settings in zip(sent, choice, strict=True):
                expect(device.compute(*pair, settings), pair, settings)
    assert len(copies) == 2


def test_parts_that_are_overtaken_are_not_asked_again(patient):
    (pair,) = pairs(1, 640, 400)
    to_host = Faults(reordering=0.2, distance=16, rng=byte_generator(83))
    with udp_device(None, to_host) as there, connect(there.url) as device:
        expect(device.compute(*pair, SETTINGS), pair)
        assert to_host.reordered > 50
        assert device.link_counters.parts_asked_again == 0


def test_what_is_under_way_fits_small_buffers(patient):
    (pair,)   = pairs(1, 640, 400)
    impatient = replace(QUICK, silence_limit_s=0.4, max_tries=3)
    for ignored, kind, most in ((MessageType.MISSING, MessageType.UPLOAD, 48),
                                (MessageType.READ, MessageType.READ, 128)):
        with udp_device() as there:
            there.ignored.add(ignored)
            with connect(there.url, impatient) as device, pytest.raises(LinkTimeout):
                device.compute(*pair, SETTINGS)
        asked = set()
        for request in (request for request in there.requests if request.type == kind):
            count  = int.from_bytes(request.payload, "little") // CHUNK_BYTES if kind == MessageType.READ else 1
            asked |= {request.offset // CHUNK_BYTES + index for index in range(count)}
        assert asked == set(range(most))


def test_chunks_that_are_overtaken_are_no_storm():
    sent = pairs(3, 320, 200)
    ways = [Faults(reordering=0.5, rng=byte_generator(82, way)) for way in (0, 1)]
    with udp_device(*ways) as there, connect(there.url) as device:
        for result, pair in zip(device.stream(sent, SETTINGS), sent, strict=True):
            expect(result, pair)
        host = device.link_counters
        assert host.chunks_sent_again < 2*host.chunks_sent
        assert host.parts_asked_again < host.parts_received
        assert device.statistics()["chunks_received"] == host.chunks_sent


@pytest.mark.parametrize("datagram_s", [0.002, 0.01])
def test_a_slow_device_is_not_flooded(datagram_s):
    """It takes seconds for what a wire does in milliseconds, and gets nothing twice but a few small requests."""
    sent = pairs(2, 160, 100)
    with udp_device(datagram_s=datagram_s) as there, connect(there.url) as device:
        for result, pair in zip(device.stream(sent, SETTINGS), sent, strict=True):
            expect(result, pair)
        host = device.link_counters
    assert (host.chunks_sent_again, there.counters["chunks_repeated"]) == (0, 0)
    assert host.parts_asked_again <= 64
    assert host.retransmissions < 30


def test_two_frames_are_under_way_while_one_is_matched():
    sent = pairs(4, 110, 60)
    with udp_device(match_s=0.2) as there, connect(there.url) as device:
        begin = time.monotonic()
        list(device.stream(sent, SETTINGS))
        assert time.monotonic() - begin < 4*0.2 + 0.3
    opens, reads, starts = ([index for index, request in enumerate(there.requests) if request.type == kind]
                            for kind in (MessageType.OPEN, MessageType.READ, MessageType.START))
    assert starts[1] < reads[0] and opens[2] < reads[0]


def test_a_device_with_one_slot():
    sent = pairs(3, 64, 20)
    with udp_device(slots=1) as there, connect(there.url) as device:
        for result, pair in zip(device.stream(sent, SETTINGS), sent, strict=True):
            expect(result, pair)


def test_pairs_are_asked_for_one_by_one_and_may_share_their_memory():
    """As a camera's, whose buffer is filled again for each frame."""
    sent   = pairs(20, 110, 60)
    buffer = [np.empty_like(image) for image in sent[0]]

    def camera():
        for count, pair in enumerate(sent):
            assert device.link_counters.chunks_sent == count*image_chunks(110, 60)
            for place, image in zip(buffer, pair, strict=True):
                place[:] = image
            yield tuple(buffer)

    with udp_device(*bad_ways(81, 12, loss=0.2)) as there, connect(there.url) as device:
        for result, pair in zip(device.stream(camera(), SETTINGS), sent, strict=True):
            expect(result, pair)


def test_streams_and_questions_may_interleave():
    sent = pairs(5, 64, 20)
    with udp_device() as there, connect(there.url) as device:
        for result, pair in zip(device.stream(sent, SETTINGS), sent, strict=True):
            expect(result, pair)
            assert device.statistics()["frames_matched"] > 0
            expect(device.compute(*sent[0], MatcherSettings(16, 5)), sent[0], MatcherSettings(16, 5))
        assert there.counters["sessions"] == 1


def test_a_stream_dropped_half_way_leaves_no_frame_open():
    sent = pairs(4, 64, 20)
    with udp_device() as there, connect(there.url) as device:
        for _ in range(5):
            for result in device.stream(sent, SETTINGS):
                expect(result, sent[0])
                break
        expect(device.compute(*sent[1], SETTINGS), sent[1])
        assert there.counters["frames_opened"] == there.counters["frames_released"]


def test_what_does_not_suit_the_device_ends_the_stream_and_not_the_session():
    sent = pairs(2, 64, 20)
    wide = np.zeros((20, 1025), np.uint8)
    with udp_device() as there, connect(there.url) as device:
        stream = device.stream([sent[0], (wide, wide)], SETTINGS)
        with pytest.raises(ImageError):
            list(stream)
        expect(device.compute(*sent[1], SETTINGS), sent[1])
        assert there.counters["frames_opened"] == there.counters["frames_released"]


def test_slots_that_a_late_copy_took_are_taken_back():
    """Frames that were released and are open again, as a late copy of their OPEN makes them."""
    sent = pairs(4, 64, 20)
    with udp_device() as there, connect(there.url) as device:
        list(device.stream(sent, SETTINGS))
        for frame_id in (1, 2, 3, 4):
            device._link.call(MessageType.OPEN, b"\x40\0\x14\0", frame_id)
        stream = device.stream(pairs(6, 64, 20), SETTINGS)
        for result, pair in zip(stream, pairs(6, 64, 20), strict=True):
            expect(result, pair)


def test_slots_that_are_really_taken_are_an_error():
    with udp_device(slots=2) as there, connect(there.url) as device:
        for frame_id in (1001, 1002):
            device._link.call(MessageType.OPEN, b"\x40\0\x14\0", frame_id)
        with pytest.raises(DeviceRefused, match="2 frame slots"):
            device.compute(*pairs(1, 64, 20)[0], SETTINGS)
        device._link.call(MessageType.RELEASE, frame_id=1001)
        expect(device.compute(*pairs(1, 64, 20)[0], SETTINGS), pairs(1, 64, 20)[0])


# Other hosts.

def test_a_second_host_waits_until_the_first_has_gone():
    sent = pairs(1, 64, 20)
    with udp_device() as there, contextlib.ExitStack() as first:
        expect(first.enter_context(connect(there.url)).compute(*sent[0], SETTINGS), sent[0])
        timer = threading.Timer(0.8, first.close)
        timer.start()
        begin = time.monotonic()
        with connect(there.url) as second:
            assert 0.7 < time.monotonic() - begin < 2.5
            expect(second.compute(*sent[0], SETTINGS), sent[0])
        timer.join()
        assert there.counters["sessions"] == 2 and there.counters["sessions_refused"] > 0


def test_a_second_host_that_has_waited_long_enough_says_so():
    with udp_device() as there, connect(there.url):
        begin = time.monotonic()
        with pytest.raises(DeviceError, match="another host uses the device.*for 1 s"):
            connect(there.url, QUICK)
        assert 0.9 < time.monotonic() - begin < 2


def test_two_hosts_at_once_on_a_bad_network():
    sent, errors = pairs(20, 64, 20), []

    def host(url):
        try:
            with connect(url) as device:
                for result, pair in zip(device.stream(sent, SETTINGS), sent, strict=True):
                    expect(result, pair)
        except BaseException as error:
            errors.append(error)

    with udp_device(*bad_ways(81, 13)) as there:
        hosts = [threading.Thread(target=host, args=(there.url,)) for _ in range(3)]
        for one in hosts:
            one.start()
        for one in hosts:
            one.join(60)
        assert not errors and there.counters["frames_matched"] >= 60
        assert there.counters["sessions_refused"] > 0


def test_a_host_that_vanishes_in_mid_upload_holds_the_device_for_a_bounded_time():
    (pair,) = pairs(1, 320, 200)

    class Vanished(Exception):
        pass

    def progress(phase, done, total):
        if phase == "upload" and done > 20:
            raise Vanished

    with udp_device(silence_s=1.0) as there:
        lost = connect(there.url)
        with pytest.raises(Vanished):
            # The same as a process that is killed: its socket says nothing any more.
            lost._release = lambda _: None
            lost.compute(*pair, SETTINGS, progress)
        begin = time.monotonic()
        with connect(there.url) as device:
            assert 0.5 < time.monotonic() - begin < 2.5
            expect(device.compute(*pair, SETTINGS), pair)
            # The old token is refused, and nothing of the old host changes what the new one does.
            with pytest.raises(SessionLost, match="another host"):
                lost.statistics()
            lost._link._channel.send_chunk(lost._link.session, 1, 1, 0, memoryview(bytes(CHUNK_BYTES)))
            expect(device.compute(*pair, SETTINGS), pair)
            assert device.statistics()["uploads_foreign"] == 1
            assert device.statistics()["frames_reclaimed"] == 1
        lost.close()


# Devices that break.

@pytest.mark.parametrize("phase", ["upload", "match", "download"])
def test_a_device_that_restarts_in_mid_frame(phase):
    (pair,) = pairs(1, 320, 200)
    restarted = []

    with udp_device(match_s=0.05) as there:
        def progress(now, done, total):
            if now == phase and done >= total // 2 and not restarted:
                restarted.append(now)
                there.reset()

        with connect(there.url) as device:
            with pytest.raises(SessionLost, match="restarted"):
                device.compute(*pair, SETTINGS, progress)
            with pytest.raises(DeviceError, match="connect again"):
                device.statistics()
        with connect(there.url) as device:
            expect(device.compute(*pair, SETTINGS), pair)


@pytest.mark.parametrize("when", ["upload", "download", "idle"])
def test_a_device_that_falls_silent_is_noticed(when):
    (pair,) = pairs(1, 320, 200)
    to_host = Faults()

    def progress(phase, done, total):
        if phase == when and done > total // 2:
            to_host.loss = 1.0

    with udp_device(None, to_host) as there, connect(there.url, QUICK) as device:
        if when == "idle":
            to_host.loss = 1.0
        begin = time.monotonic()
        with pytest.raises(LinkTimeout, match="has not answered for 1 s"):
            device.compute(*pair, SETTINGS, progress)
        assert time.monotonic() - begin < 4


def test_a_network_that_carries_small_datagrams_only():
    (pair,) = pairs(1, 64, 20)
    patient = replace(QUICK, max_tries=5)
    with udp_device() as there, connect(there.url, patient) as device:
        there.ignored.add(MessageType.UPLOAD)
        with pytest.raises(LinkTimeout, match="gets no images"):
            device.compute(*pair, SETTINGS)
    with udp_device() as there, connect(there.url, patient) as device:
        there.ignored.add(MessageType.READ)
        with pytest.raises(LinkTimeout, match="no map comes"):
            device.compute(*pair, SETTINGS)


@pytest.mark.parametrize("change", [{"offset": 512}, {"offset": 1 << 20}, {"payload": bytes(7)}])
def test_a_part_of_a_map_that_is_none_is_an_error(change):
    (pair,) = pairs(1, 64, 32)
    with udp_device() as there, connect(there.url) as device:
        send = there._send
        there._send = lambda peer, reply: send(peer, replace(reply, **change) if len(reply.payload) == 1024 else reply)
        with pytest.raises(ProtocolError, match="part of the map|bytes of the map"):
            device.compute(*pair, SETTINGS)


def test_reads_that_the_device_cannot_queue_are_sent_again(monkeypatch):
    monkeypatch.setattr(udp_device_module, "_READS", 1)
    (pair,) = pairs(1, 640, 100)
    with udp_device(datagram_s=0.0005) as there, connect(there.url) as device:
        expect(device.compute(*pair, SETTINGS), pair)
        assert device.statistics()["requests_refused"] > 0


def test_parts_of_another_frame_or_session_are_ignored():
    sent = pairs(6, 64, 32)
    with udp_device() as there, connect(there.url) as device:
        send = there._send

        def with_strangers(peer, reply):
            for change in ({"session": 1}, {"sequence": reply.sequence ^ 1}, {"frame_id": 99}, {"type": 0x8f}):
                send(peer, replace(reply, payload=bytes(len(reply.payload)), **change))
            send(peer, reply)

        there._send = with_strangers
        for result, pair in zip(device.stream(sent, SETTINGS), sent, strict=True):
            expect(result, pair)
        assert device.link_counters.stale_replies > 100


def test_a_device_on_a_network_has_no_console():
    with udp_device() as there, connect(there.url) as device:
        with pytest.raises(DeviceError, match="serial line"):
            device.console("help")
        expect(device.compute(*pairs(1, 64, 20)[0], SETTINGS), pairs(1, 64, 20)[0])
