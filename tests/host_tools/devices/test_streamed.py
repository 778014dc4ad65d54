#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Streamed frames: the host tools against the firmware compiled for this computer."""

import contextlib
import itertools
import signal
import socket
import threading
import time

import pytest

from litestereo.host_tools.cli import main
from litestereo.host_tools.core.errors import DeviceError, LinkTimeout, UnsupportedError, UrlError
from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.host_tools.devices.connect import connect
from litestereo.host_tools.link.settings import LinkSettings
from litestereo.host_tools.link.udp_channel import UdpChannel
from litestereo.host_tools.protocol.messages import MessageType
from support.chunks import image_chunks, pair_chunks
from support.expected import SETTINGS, expect
from support.native_device import native_ports, native_udp_device
from support.pairs import byte_generator, pairs
from support.udp_faults import Faults, bad_ways
from support.udp_proxy import udp_proxied

STREAMED = "?mode=streamed"

#: Matches of small frames that take longer than their parts need to leave.
SLOW = ("--clocks-per-pixel", "14")


class Enough(Exception):
    """What a test raises in the middle of something."""


@contextlib.contextmanager
def interrupted_after(seconds):
    """Raise Enough in the main thread, wherever it is then."""
    def alarm(*_):
        raise Enough

    before = signal.signal(signal.SIGALRM, alarm)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


@pytest.fixture(scope="module")
def shared_url():
    """A device for tests that leave it as it was."""
    with native_udp_device() as port:
        yield f"udp://127.0.0.1:{port}{STREAMED}"


@pytest.mark.parametrize(("width", "height"), [(38, 7), (64, 16), (65, 33), (200, 101), (1024, 9), (640, 480)])
def test_maps_equal_the_model(shared_url, width, height):
    (pair,) = pairs(1, width, height)
    steps   = []
    with connect(shared_url) as device:
        result = device.compute(*pair, SETTINGS, lambda *step: steps.append(step))
    expect(result, pair)
    assert result.clocks >= width*height
    assert result.upload_s > 0 and result.match_s > 0 and result.download_s > 0
    chunks = pair_chunks(width, height)
    for phase, total in (("upload", chunks), ("match", 1), ("download", chunks)):
        done = [step[1] for step in steps if step[0] == phase]
        assert done[0] == 0 and done[-1] == total and done == sorted(done)
        assert {step[2] for step in steps if step[0] == phase} == {total}


@pytest.mark.parametrize("options", [(), SLOW])
def test_a_good_network_needs_no_repair(options, patient):
    """Every pair is sent once, every part comes without a request, and nothing is stored."""
    sent = pairs(3) + pairs(2, 90, 40) + pairs(1, 200, 20)
    with native_udp_device(*options) as port, connect(f"udp://127.0.0.1:{port}{STREAMED}") as device:
        for result, pair in zip(device.stream(sent, SETTINGS), sent, strict=True):
            expect(result, pair)
        host    = device.link_counters
        counted = device.statistics()
    chunks = sum(pair_chunks(*left.shape) for left, _ in sent)
    assert (host.chunks_sent, host.parts_received) == (chunks, chunks)
    assert host.repairs == host.parts_repeated == 0
    assert (counted["frames_opened"], counted["frames_matched"], counted["frames_released"]) == (6, 6, 6)
    assert (counted["chunks_received"], counted["chunks_repeated"], counted["uploads_unfit"]) == (chunks, 0, 0)


def test_the_next_frame_is_queued_while_one_is_matched(shared_url, patient):
    """One, and no more: a camera's pair is taken when it can be sent soon."""
    taken = []

    def source():
        for index, pair in enumerate(sent):
            taken.append(index)
            yield pair

    sent = pairs(6)
    with connect(shared_url) as device:
        for index, result in enumerate(device.stream(source(), SETTINGS)):
            expect(result, sent[index])
            assert len(taken) <= index + 4
    assert taken == list(range(6))


def test_parts_that_never_leave_the_device_are_read():
    sent = pairs(8)
    with native_udp_device("--skip-parts", "2") as port, connect(f"udp://127.0.0.1:{port}{STREAMED}") as device:
        for result, pair in zip(device.stream(sent, SETTINGS), sent, strict=True):
            expect(result, pair)
        host = device.link_counters
    parts = 8*pair_chunks(110, 60)
    assert host.parts_received == parts
    assert parts/4 < host.parts_asked_again < parts


def test_a_map_of_which_nothing_comes_without_a_request():
    (pair,) = pairs(1)
    with native_udp_device("--skip-parts", "1") as port, connect(f"udp://127.0.0.1:{port}{STREAMED}") as device:
        expect(device.compute(*pair, SETTINGS), pair)
        assert device.link_counters.parts_asked_again == pair_chunks(110, 60)


@pytest.mark.parametrize(("seed", "frames"), [(0, 1000), (1, 120), (2, 120), (3, 120)])
def test_many_small_frames_on_a_bad_network(seed, frames):
    """Datagrams are lost, doubled, delayed and changed on their way, in both directions, and some parts never leave."""
    sent = pairs(frames, 64, 20, 92)
    ways = bad_ways(91, seed)
    with (native_udp_device("--skip-parts", "20", *SLOW) as port, udp_proxied(port, *ways) as network,
          connect(network.url + STREAMED) as device):
        for result, pair in zip(device.stream(sent, SETTINGS), sent, strict=True):
            expect(result, pair)
        host    = device.link_counters
        counted = device.statistics()
    for way in ways:
        assert min(way.lost, way.duplicated, way.reordered, way.flipped) > 0
    chunks = frames*pair_chunks(64, 20)
    assert (counted["sessions"], counted["frames_opened"], counted["frames_matched"]) == (1, frames, frames)
    assert counted["frames_failed"] == 0
    assert (host.chunks_sent, host.parts_received, counted["chunks_received"]) == (chunks, chunks, chunks)
    assert 0 < host.chunks_sent_again < 2*chunks


def test_a_large_frame_on_a_bad_network():
    (pair,) = pairs(1, 640, 400)
    ways    = bad_ways(91, 10)
    with (native_udp_device("--skip-parts", "20") as port, udp_proxied(port, *ways) as network,
          connect(network.url + STREAMED) as device):
        expect(device.compute(*pair, SETTINGS), pair)
        host = device.link_counters
    assert host.chunks_sent_again > 0 and host.parts_asked_again > 0


def test_a_single_loss_costs_what_was_on_its_way_and_no_more(patient):
    """What the device took stays taken, and what was sent after the loss is sent once more."""
    (pair,) = pairs(1, 640, 400)

    class LoseOne(Faults):
        def carry(self, to, datagram):
            offset = int.from_bytes(datagram[16:20], "little")
            if (datagram[3], offset, self.lost) == (MessageType.PAIRS, 200*1024, 0):
                self.lost = 1
                return []
            return super().carry(to, datagram)

    with (native_udp_device() as port, udp_proxied(port, LoseOne()) as network,
          connect(network.url + STREAMED) as device):
        expect(device.compute(*pair, SETTINGS), pair)
        host, counted = device.link_counters, device.statistics()
    assert 0 < host.chunks_sent_again == counted["uploads_unfit"] + 1 <= 3*48
    assert counted["chunks_repeated"] == 0


@pytest.mark.parametrize("direction", [0, 1])
def test_a_network_that_loses_a_lot_in_one_direction(direction):
    sent            = pairs(10, 64, 20)
    ways            = [Faults(), Faults()]
    ways[direction] = Faults(loss=0.4, rng=byte_generator(93, direction))
    with (native_udp_device() as port, udp_proxied(port, *ways) as network,
          connect(network.url + STREAMED) as device):
        for result, pair in zip(device.stream(sent, SETTINGS), sent, strict=True):
            expect(result, pair)


def test_settings_that_change_on_a_bad_network():
    sent = pairs(12, 64, 20, 94)
    ways = bad_ways(95, loss=0.02, duplication=0.3, reordering=0.3, flips=0.0)
    with (native_udp_device() as port, udp_proxied(port, *ways) as network,
          connect(network.url + STREAMED) as device):
        for index, pair in enumerate(sent):
            settings = MatcherSettings(16, (5, 7, 9)[index % 3])
            expect(device.compute(*pair, settings), pair, settings)


def test_settings_that_change_while_frames_are_under_way(shared_url):
    """A frame keeps the settings that it was queued with, whenever those of the next one change."""
    sent  = pairs(4)
    other = MatcherSettings(16, 5, median=True)
    with connect(shared_url) as device:
        first, second = (device.stream(sent[:2], SETTINGS), device.stream(sent[2:], other))
        expect(next(first), sent[0])
        expect(next(second), sent[2], other)
        expect(next(first), sent[1])
        expect(next(second), sent[3], other)


def test_streamed_and_stored_frames_in_one_session(shared_url):
    sent = pairs(9)
    with connect(shared_url) as device:
        before = device.statistics()
        for index in range(0, 9, 3):
            device.streamed = index != 3
            for result, pair in zip(device.stream(sent[index:index + 3], SETTINGS), sent[index:index + 3], strict=True):
                expect(result, pair)
        after = device.statistics()
    assert after["sessions"] == before["sessions"] and after["frames_released"] - before["frames_released"] == 9


@pytest.mark.parametrize("taken", [0, 1, 2])
def test_an_iterator_that_is_dropped_in_mid_frame(shared_url, taken):
    sent = pairs(6, 320, 200)
    with connect(shared_url) as device:
        before  = device.statistics()
        results = device.stream(sent, SETTINGS)
        for index in range(taken):
            expect(next(results), sent[index])
        results.close()
        (pair,) = pairs(1)
        begin   = time.monotonic()
        expect(device.compute(*pair, SETTINGS), pair)
        assert time.monotonic() - begin < 3
        after = device.statistics()
    grown = {name: after[name] - before[name] for name in after}
    assert grown["frames_released"] == grown["frames_opened"]


@pytest.mark.parametrize("after", [0, 1, 5, 60])
def test_an_error_in_mid_frame_leaves_the_device_usable(after):
    """What is dropped in the middle of its pairs is stopped, on a bad network too."""
    (large,) = pairs(1, 320, 200)
    (small,) = pairs(1)

    def progress(phase, done, total):
        if phase == "upload" and done >= after:
            raise Enough

    ways = bad_ways(91, 20, after)
    with (native_udp_device() as port, udp_proxied(port, *ways) as network,
          connect(network.url + STREAMED) as device):
        for _ in range(4):
            with pytest.raises(Enough):
                device.compute(*large, SETTINGS, progress)
            expect(device.compute(*small, SETTINGS), small)
        counted = device.statistics()
    assert counted["frames_failed"] > 0


def test_progress_that_raises_before_anything_is_sent_opens_no_frame(shared_url):
    (pair,) = pairs(1)

    def progress(phase, done, total):
        raise Enough

    with connect(shared_url) as device:
        before = device.statistics()["frames_opened"]
        with pytest.raises(Enough):
            device.compute(*pair, SETTINGS, progress)
        device._link.idle(0.05)
        assert device.statistics()["frames_opened"] == before
        expect(device.compute(*pair, SETTINGS), pair)


def test_a_frame_that_gets_no_pairs_is_released_by_the_next_one():
    """A STREAM that arrives after the RELEASE of its frame opens it, and it would keep the matcher for five seconds."""
    (pair,) = pairs(1)

    class Holding(Faults):
        holding = True

        def carry(self, to, datagram):
            if self.holding and datagram[3] == MessageType.STREAM:
                late.append((to, datagram))
                return []
            return super().carry(to, datagram)

        def overdue(self):
            gone = [] if self.holding else late[:]
            del late[:len(gone)]
            return gone + super().overdue()

    late: list = []
    to_device  = Holding()
    with (native_udp_device() as port, udp_proxied(port, to_device) as network,
          connect(network.url + STREAMED) as device):
        with interrupted_after(0.2), pytest.raises(Enough):
            device.compute(*pair, SETTINGS)
        to_device.holding = False
        while late:
            time.sleep(0.001)
        begin = time.monotonic()
        expect(device.compute(*pair, SETTINGS), pair)
        assert 0.3 < time.monotonic() - begin < 4
        counted = device.statistics()
    assert (counted["frames_opened"], counted["frames_failed"], counted["frames_released"]) == (2, 1, 2)


def test_a_slow_caller_loses_no_frame():
    """The device gives up a frame that gets no pairs for five seconds, and the host begins it anew."""
    sent = pairs(4)
    with native_udp_device() as port, connect(f"udp://127.0.0.1:{port}{STREAMED}") as device:
        results = device.stream(sent, SETTINGS)
        expect(next(results), sent[0])
        time.sleep(5.5)
        for result, pair in zip(results, sent[1:], strict=True):
            expect(result, pair)
        counted = device.statistics()
    assert 1 <= counted["frames_failed"] <= 3 and counted["frames_matched"] == 4


def test_a_second_host_waits_until_the_first_has_gone():
    (pair,) = pairs(1)
    with native_udp_device() as port, udp_proxied(port) as network, contextlib.ExitStack() as first:
        url = network.url + STREAMED
        expect(first.enter_context(connect(url)).compute(*pair, SETTINGS), pair)
        with pytest.raises(DeviceError, match="another host uses the device"):
            connect(url, LinkSettings(hello_limit_s=0.5))
        timer = threading.Timer(0.5, first.close)
        timer.start()
        with connect(url) as second:
            expect(second.compute(*pair, SETTINGS), pair)
        timer.join()


def test_pairs_of_a_stranger_are_none(shared_url, patient):
    """Those of another host, and those of a frame that is not streamed, or not the next ones."""
    (pair,) = pairs(1)
    port    = int(shared_url.rsplit(":", 1)[1].split("?")[0])
    noise   = memoryview(bytes(1024))
    other   = UdpChannel("127.0.0.1", port)

    def progress(phase, done, total):
        if phase == "upload":
            other.send_chunk(device._link.session, 1, next(frame_ids), 0, noise, MessageType.PAIRS)
            device._context.channel.send_chunk(device._link.session, 1, 999, 0, noise, MessageType.PAIRS)

    with contextlib.closing(other), connect(shared_url) as device:
        before    = device.statistics()
        frame_ids = itertools.repeat(1)
        expect(device.compute(*pair, SETTINGS, progress), pair)
        after = device.statistics()
    assert after["uploads_foreign"] > before["uploads_foreign"]
    assert after["uploads_unfit"] > before["uploads_unfit"]


def test_a_network_that_carries_no_pairs():
    """Small datagrams come through, those of a whole chunk do not: an MTU that is too small somewhere."""
    (pair,) = pairs(1)

    class Narrow(Faults):
        def carry(self, to, datagram):
            return super().carry(to, datagram) if len(datagram) < 1000 else []

    with native_udp_device() as port, udp_proxied(port, Narrow()) as network:
        device = connect(network.url + STREAMED, LinkSettings(max_tries=5))
        with device, pytest.raises(LinkTimeout, match="datagrams of 1052 bytes"):
            device.compute(*pair, SETTINGS)


def test_a_device_without_is_an_error_and_is_let_go(capsys):
    with native_udp_device("--stored-only") as port:
        url = f"udp://127.0.0.1:{port}"
        with pytest.raises(UnsupportedError, match="built without streaming"):
            connect(url + STREAMED)
        assert main(["info", "--device", url + STREAMED]) == 1
        out, err = capsys.readouterr()
        assert out == "" and err.count("\n") == 1 and "leave mode=streamed out" in err
        with connect(url, LinkSettings(hello_limit_s=0.5)) as device:
            (pair,) = pairs(1)
            expect(device.compute(*pair, SETTINGS), pair)


def test_the_feature_is_told_over_udp_only(capsys):
    with native_ports() as (serial_port, udp_port):
        for url, known in ((f"udp://127.0.0.1:{udp_port}{STREAMED}", True), (f"tcp://127.0.0.1:{serial_port}", False)):
            assert main(["info", "--device", url]) == 0
            assert ("streaming" in capsys.readouterr().out) == known


@pytest.mark.parametrize(("url", "message"), [
    ("udp://127.0.0.1?mode=fast", "mode is stored or streamed, not 'fast'"),
    ("udp://127.0.0.1?speed=9", "unknown option 'speed', the options are mode"),
    ("tcp://127.0.0.1:2000?mode=streamed", "unknown option 'mode', tcp: takes none"),
    ("sim:?mode=fast", "mode is stored or streamed, not 'fast'"),
    ("sim:?mode=streamed&link=serial", "only with link=udp"),
])
def test_urls(url, message):
    with pytest.raises(UrlError, match=message):
        connect(url)


def test_mode_stored_is_the_default(shared_url):
    (pair,) = pairs(1)
    base    = shared_url.removesuffix(STREAMED)
    for url in (base, f"{base}?mode=stored"):
        with connect(url) as device:
            before = device.statistics()["chunks_received"]
            expect(device.compute(*pair, SETTINGS), pair)
            # Each image starts a new chunk; pairs would be fewer.
            assert device.statistics()["chunks_received"] - before == image_chunks(110, 60) > pair_chunks(110, 60)


def test_a_stream_request_of_a_released_frame_begins_nothing(shared_url):
    """The device's own test, from a socket: a late copy is not answered."""
    (pair,)  = pairs(1)
    captured = []
    with connect(shared_url) as device:
        send = device._context.channel.send

        def noting(wrapped, resync):
            if wrapped[3] == MessageType.STREAM:
                captured.append(wrapped)
            send(wrapped, resync)

        device._context.channel.send = noting
        expect(device.compute(*pair, SETTINGS), pair)
        opened = device.statistics()["frames_opened"]
        sock   = device._context.channel._socket
        assert len(captured) >= 1 and isinstance(sock, socket.socket)
        for copy in captured:
            send(copy, False)
        device._link.idle(0.05)
        assert device.statistics()["frames_opened"] == opened
        expect(device.compute(*pair, SETTINGS), pair)
