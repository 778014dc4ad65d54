#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The host tools against the real firmware, which runs on this computer with a fake accelerator."""

import contextlib
import itertools
import signal
import socket
import subprocess
import sys
import textwrap
import time

import pytest

from litestereo.host_tools.core.errors import DeviceError, DeviceRefused, LinkTimeout, SessionLost
from litestereo.host_tools.core.settings import MatcherSettings, Parameter
from litestereo.host_tools.devices.connect import connect
from litestereo.host_tools.link.link import Link
from litestereo.host_tools.link.serial_channel import SerialChannel
from litestereo.host_tools.link.serial_framing import Demultiplexer, encode_frame
from litestereo.host_tools.link.settings import LinkSettings
from litestereo.host_tools.link.transports.tcp import TcpTransport
from litestereo.host_tools.protocol import payloads
from litestereo.host_tools.protocol.messages import ErrorCode, Message, MessageType
from litestereo.host_tools.protocol.payloads import FrameState
from support.chunks import image_chunks
from support.expected import SETTINGS, expect, expected_map
from support.fault_proxy import Faults, proxied
from support.native_device import native_device
from support.pairs import byte_generator, generator, pairs, textured_pair

#: For a device that answers in milliseconds, on a line that loses a lot.
QUICK = LinkSettings(timeout_floor_s=0.05, initial_bytes_per_s=1e6, max_tries=60, silence_limit_s=10.0)


@pytest.fixture(scope="module")
def shared_port():
    """A device for tests that leave it as it was."""
    with native_device() as port:
        yield port


@pytest.fixture
def shared_url(shared_port):
    return f"tcp://127.0.0.1:{shared_port}"


@pytest.mark.parametrize(("width", "height"), [(38, 7), (64, 16), (65, 33), (200, 101), (1024, 9)])
@pytest.mark.parametrize("settings", [SETTINGS, MatcherSettings(16, 5)])
def test_maps_equal_the_model(shared_url, width, height, settings):
    (pair,) = pairs(1, width, height)
    steps   = []
    with connect(shared_url) as device:
        result = device.compute(*pair, settings, lambda *step: steps.append(step))
    expect(result, pair, settings)
    assert result.settings == settings
    assert result.clocks == width*height
    assert 0 < result.first_row_clocks < result.clocks
    assert result.upload_s > 0 and result.match_s > 0 and result.download_s > 0
    uploads = [done for phase, done, _ in steps if phase == "upload"]
    assert uploads == list(range(image_chunks(width, height) + 1))


def test_info_is_what_the_firmware_was_built_for():
    with (native_device("--max-width", "320", "--max-disparities", "32", "--max-block-size", "11",
                        "--clock-hz", "1000000", "--memory", "4194304") as port,
          connect(f"tcp://127.0.0.1:{port}") as device):
        info = device.info()
    assert (info.max_width, info.max_disparities) == (320, 32)
    assert (info.min_block_size, info.max_block_size) == (5, 11)
    assert info.sys_clk_hz == 1_000_000
    assert info.slots >= 2 and info.max_pixels > 0 and info.name == "LiteStereo"


def test_default_settings_are_used_when_none_are_given(shared_url):
    (pair,) = pairs(1)
    with connect(shared_url) as device:
        expect(device.compute(*pair), pair, MatcherSettings(64, 9))


def test_a_stream_of_pairs_of_all_sizes_comes_back_in_order(shared_url):
    sent = pairs(3) + pairs(2, 90, 40) + pairs(1, 200, 20)
    with connect(shared_url) as device:
        before  = device.statistics()
        results = list(device.stream(sent, SETTINGS))
        after   = device.statistics()
        assert device.link_counters.retransmissions == 0
    for result, pair in zip(results, sent, strict=True):
        expect(result, pair)
    grown  = {name: after[name] - before[name] for name in after}
    chunks = sum(image_chunks(*left.shape) for left, _ in sent)
    assert (grown["frames_opened"], grown["frames_matched"], grown["frames_released"]) == (6, 6, 6)
    assert (grown["chunks_received"], grown["chunks_repeated"]) == (chunks, 0)
    assert grown["requests_refused"] == grown["crc_errors"] == grown["framing_errors"] == 0


def test_the_next_upload_overlaps_the_match():
    """Matches take a fifth of a second each, so a whole upload fits into one."""
    sent = pairs(4)
    slow = ("--clock-hz", "200000", "--clocks-per-pixel", "6")
    with native_device(*slow) as port, connect(f"tcp://127.0.0.1:{port}") as device:
        for pair in sent:
            expect(device.compute(*pair, SETTINGS), pair)
        assert device.statistics()["chunks_while_matching"] == 0
        for result, pair in zip(device.stream(sent, SETTINGS), sent, strict=True):
            expect(result, pair)
        assert device.statistics()["chunks_while_matching"] == 3*image_chunks(110, 60)


def test_the_next_upload_overlaps_the_download(shared_url):
    """The line carries both ways at once, so neither has to wait for the other."""
    steps = []
    with connect(shared_url) as device:
        list(device.stream(pairs(2, 200, 100), SETTINGS, lambda *step: steps.append(step[:2])))
    first_download = steps[steps.index(("download", 1)):steps.index(("download", 40))]
    assert sum(phase == "upload" for phase, _ in first_download) > 20


def test_a_stream_dropped_half_way_leaves_no_frame_open(shared_url):
    sent = pairs(3)
    with connect(shared_url) as device:
        before = device.statistics()
        for _ in range(5):
            for result in device.stream(sent, SETTINGS):
                expect(result, sent[0])
                break
        after = device.statistics()
        expect(device.compute(*sent[1], SETTINGS), sent[1])
    opened, released = (after[name] - before[name] for name in ("frames_opened", "frames_released"))
    assert opened == released == 10


def test_statistics_and_console_between_two_frames_of_a_stream(shared_url):
    sent = pairs(3)
    with connect(shared_url) as device:
        for result, pair in zip(device.stream(sent, SETTINGS), sent, strict=True):
            expect(result, pair)
            assert device.statistics()["frames_matched"] > 0
            assert "selftest" in device.console("help")


def test_the_console_waits_for_requests_in_flight(shared_url, monkeypatch):
    """A command may keep the device busy for so long that they would time out."""
    in_flight = []
    with connect(shared_url) as device:
        write  = device._channel.write_console
        stream = device.stream(pairs(1) + pairs(1, 640, 480), SETTINGS)
        next(stream)
        assert device._link._outstanding

        def noting(text):
            in_flight.append(len(device._link._outstanding))
            write(text)

        monkeypatch.setattr(device._channel, "write_console", noting)
        assert "selftest" in device.console("help")
        (result,) = stream
        expect(result, pairs(1, 640, 480)[0])
    assert in_flight[0] == 0


def test_streams_may_interleave_on_a_line(shared_url):
    """The end of one leaves the requests of the other alone."""
    sent = pairs(4)
    with connect(shared_url) as device:
        before        = device.statistics()
        first, second = device.stream(sent[:2], SETTINGS), device.stream(sent[2:], SETTINGS)
        expect(next(first), sent[0])
        expect(next(second), sent[2])
        first.close()
        expect(next(second), sent[3])
        second.close()
        after = device.statistics()
    opened, released = (after[name] - before[name] for name in ("frames_opened", "frames_released"))
    assert opened == released == 4


@pytest.mark.parametrize("seed", range(16))
def test_a_bad_line_costs_time_but_no_pixel(seed):
    """Bytes are flipped, dropped, inserted and repeated both ways, about one fault in 3000 bytes."""
    sent = pairs(3, salt=51)
    to_device, to_host = (Faults(3e-4, rng=byte_generator(52, seed, way)) for way in (0, 1))
    with (native_device() as port, proxied(port, to_device, to_host) as line,
          connect(line.url, QUICK) as device):
        for result, pair in zip(device.stream(sent, SETTINGS), sent, strict=True):
            expect(result, pair)
        to_device.rate = to_host.rate = 0.0
        host    = device.link_counters
        counted = device.statistics()
    assert (counted["sessions"], counted["frames_reclaimed"]) == (1, 0)
    assert counted["frames_opened"] == counted["frames_matched"] == counted["frames_released"] == 3
    assert counted["chunks_received"] == 3*image_chunks(110, 60)
    assert counted["matcher_interrupts"] == 3
    assert counted["requests_refused"] == 0
    # All that was sent arrived whole, or was damaged and asked for again.
    assert host.requests <= counted["messages_received"] <= host.requests + host.retransmissions


def test_faults_of_all_kinds_did_happen():
    """What the tests above rest on: the proxy does what it says, and the device notices."""
    faults = [Faults(3e-4, rng=byte_generator(52, seed, 0)) for seed in range(16)]
    for fault in faults:
        fault.apply(bytes(50000))
    for kind in ("flipped", "dropped", "inserted", "repeated"):
        assert sum(getattr(fault, kind) for fault in faults) > 10
    sent = pairs(1, 400, 100)
    bad  = Faults(5e-4, rng=byte_generator(53))
    with native_device() as port, proxied(port, bad) as line, connect(line.url, QUICK) as device:
        expect(device.compute(*sent[0], SETTINGS), sent[0])
        bad.rate = 0.0
        counted  = device.statistics()
        assert device.link_counters.retransmissions > 0
    assert counted["framing_errors"] + counted["crc_errors"] + counted["header_errors"] > 0


def test_replies_lost_entirely_make_the_device_count_repeats():
    sent = pairs(1)
    with native_device() as port:
        to_host = Faults(1e-3, rng=byte_generator(54))
        with proxied(port, None, to_host) as line, connect(line.url, QUICK) as device:
            expect(device.compute(*sent[0], SETTINGS), sent[0])
            to_host.rate = 0.0
            counted      = device.statistics()
        assert counted["chunks_received"] == image_chunks(110, 60)
        assert counted["messages_received"] > device.link_counters.requests
        assert counted["crc_errors"] == counted["framing_errors"] == 0


KILLED_HOST = textwrap.dedent("""
    import sys, time
    import numpy as np
    from litestereo.host_tools.devices.connect import connect
    device = connect(sys.argv[1])
    def progress(phase, done, total):
        if done == 5:
            device._channel._transport.write(b"\\0half of a message")
            print("uploading", flush=True)
            time.sleep(60)
    image = np.zeros((100, 200), np.uint8)
    device.compute(image, image, None, progress)
""")


@pytest.mark.parametrize("shared", [False, True])
def test_a_host_killed_in_mid_upload_locks_no_host_out(shared):
    (pair,) = pairs(1)
    with native_device() as port, contextlib.ExitStack() as stack:
        url = stack.enter_context(proxied(port)).url if shared else f"tcp://127.0.0.1:{port}"
        command = [sys.executable, "-c", KILLED_HOST, url]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as host:
            assert host.stdout.readline() == "uploading\n"
            host.send_signal(signal.SIGKILL)
        begin = time.monotonic()
        with connect(url) as device:
            assert time.monotonic() - begin < 0.9, "the hello did not come through at once"
            expect(device.compute(*pair, SETTINGS), pair)
            counted = device.statistics()
    assert (counted["sessions"], counted["frames_reclaimed"], counted["frames_released"]) == (2, 1, 1)
    assert counted["framing_errors"] == 1


@pytest.mark.parametrize("seed", range(8))
def test_garbage_before_hello(shared_port, seed):
    rng     = byte_generator(55, seed)
    garbage = rng.choice((rng.randbytes(rng.randrange(1, 5000)), b"AT\r\nhello\r\n", b"\0", b"\0\0\0abc",
                          encode_frame(Message(MessageType.START).encode())[:rng.randrange(2, 30)]))
    with socket.create_connection(("127.0.0.1", shared_port)) as raw:
        raw.sendall(garbage)
    (pair,) = pairs(1)
    with connect(f"tcp://127.0.0.1:{shared_port}") as device:
        expect(device.compute(*pair, SETTINGS), pair)
        assert "selftest" in device.console("help")


def test_the_newest_hello_wins():
    (pair,) = pairs(1)
    with native_device() as port, proxied(port) as line:
        first  = connect(line.url)
        second = connect(line.url)
        with pytest.raises(SessionLost, match="another host connected"):
            first.compute(*pair, SETTINGS)
        with pytest.raises(DeviceError, match="connect again"):
            first.statistics()
        first.close()
        expect(second.compute(*pair, SETTINGS), pair)
        assert second.statistics()["sessions"] == 2
        with connect(line.url) as third:
            expect(third.compute(*pair, SETTINGS), pair)
        second.close()


def test_a_session_lost_in_the_middle_of_a_stream():
    sent = pairs(6)
    with native_device() as port, proxied(port) as line, connect(line.url) as first:
        with pytest.raises(SessionLost):
            for count, result in enumerate(first.stream(sent, SETTINGS)):
                expect(result, sent[count])
                if count == 2:
                    connect(line.url).close()
        with connect(line.url) as second:
            counted = second.statistics()
    assert counted["frames_opened"] == counted["frames_released"] + counted["frames_reclaimed"]


def test_a_host_that_waits_for_another_is_told_in_time(shared_url):
    """The program serves one connection at a time, as a serial port does."""
    with connect(shared_url):
        begin = time.monotonic()
        with pytest.raises(LinkTimeout, match="no other host"):
            connect(shared_url, LinkSettings(hello_limit_s=0.5))
        assert time.monotonic() - begin < 3


def test_a_device_that_restarts_is_noticed():
    """On a serial line only a session that the device no longer knows shows it."""
    sent = pairs(6)
    with native_device() as first_port, native_device() as second_port, proxied(first_port) as line:
        with connect(line.url) as device, pytest.raises(SessionLost, match="restarted"):
            for count, result in enumerate(device.stream(sent, SETTINGS)):
                expect(result, sent[count])
                if count == 1:
                    line.plug_in(second_port)
        with connect(line.url) as device:
            expect(device.compute(*sent[0], SETTINGS), sent[0])


def test_a_device_that_dies_is_noticed():
    sent = pairs(3)
    with contextlib.ExitStack() as running:
        port   = running.enter_context(native_device())
        device = connect(f"tcp://127.0.0.1:{port}")
        stream = device.stream(sent, SETTINGS)
        next(stream)
        running.close()
        begin = time.monotonic()
        with pytest.raises(DeviceError, match="closed the connection|lost"):
            list(stream)
        device.close()
        assert time.monotonic() - begin < 2


def test_another_version_is_refused_by_the_firmware(shared_port):
    line = TcpTransport("127.0.0.1", shared_port)
    line.write(encode_frame(Message(MessageType.HELLO, sequence=7, payload=bytes(4), version=2).encode()))
    demux    = Demultiplexer()
    messages = []
    while not messages:
        messages = demux.feed(line.read(1.0))
    line.close()
    assert (messages[0].type, messages[0].sequence, messages[0].version) == (MessageType.ERROR, 7, 1)
    assert payloads.unpack_error(messages[0].payload) == (ErrorCode.VERSION, MessageType.HELLO, 1)


@pytest.fixture
def link(shared_port):
    """A session on the bare link, with frame 1 open (64 x 20 pixels, 16 disparities, block size 5)."""
    line     = TcpTransport("127.0.0.1", shared_port)
    link_    = Link(SerialChannel(line))
    settings = {Parameter.DISPARITIES: 16, Parameter.BLOCK_SIZE: 5}
    link_.hello()
    link_.call(MessageType.CONFIGURE, payloads.pack_parameters(settings))
    link_.call(MessageType.OPEN, payloads.pack_size(64, 20), 1)
    yield link_
    link_.forget()
    link_.call(MessageType.BYE)
    line.close()


def refused(link_, kind, payload=b"", frame_id=1, offset=0):
    call = link_.submit(kind, payload, frame_id, offset)
    with pytest.raises(DeviceRefused) as caught:
        link_.wait([call])
    link_.forget()
    return ErrorCode(caught.value.code), caught.value.detail


def test_uploads_out_of_range_are_refused_and_write_nothing(link):
    """64 x 20 pixels are a chunk of 1024 and one of 256 bytes each; the pitch is 2048."""
    bad = [(1, 1024), (512, 512), (1024, 1024), (1280, 768), (4096, 256), (0xfffffc00, 1024), (2048, 1023),
           (3072, 257), (0, 0)]
    for offset, length in bad:
        code, _ = refused(link, MessageType.UPLOAD, bytes(length), offset=offset)
        assert code in (ErrorCode.OFFSET, ErrorCode.LENGTH), (offset, length)
    status = payloads.FrameStatus.unpack(link.call(MessageType.STATUS, frame_id=1).payload)
    assert (status.state, status.first_missing) == (FrameState.LOADING, 0)
    for count, (offset, length) in enumerate([(3072, 256), (0, 1024), (2048, 1024), (1024, 256)]):
        call = link.submit(MessageType.UPLOAD, bytes(length), 1, offset)
        link.wait([call])
        assert payloads.unpack_number(call.reply.payload) == 3 - count
    link.call(MessageType.START, frame_id=1)


def test_what_comes_too_early_or_names_nothing_is_refused(link):
    assert refused(link, MessageType.START) == (ErrorCode.INCOMPLETE, 0)
    assert refused(link, MessageType.READ, payloads.pack_number(4)) == (ErrorCode.STATE, FrameState.LOADING)
    assert refused(link, MessageType.START, frame_id=9) == (ErrorCode.FRAME, 9)
    assert refused(link, MessageType.UPLOAD, bytes(1024), frame_id=9) == (ErrorCode.FRAME, 9)
    assert refused(link, MessageType.OPEN, payloads.pack_size(70, 20)) == (ErrorCode.DUPLICATE, 1)
    assert refused(link, MessageType.STATUS, b"?") == (ErrorCode.LENGTH, 0)


@pytest.mark.parametrize(("size", "detail"), [((1025, 20), 1), ((1024, 2000), 3), ((19, 20), 4),
                                              ((64, 4), 5)])
def test_sizes_out_of_range_are_refused(link, size, detail):
    assert refused(link, MessageType.OPEN, payloads.pack_size(*size), 2) == (ErrorCode.SIZE, detail)


@pytest.mark.parametrize(("parameter", "value"), [(1, 0), (1, 8), (1, 80), (1, -16), (2, 4), (2, 3), (2, 23),
                                                  (2, -5), (3, -1), (3, 256), (4, 2), (5, 0), (5, 64), (6, -1),
                                                  (6, 1 << 20), (7, 101), (8, -2), (8, 255), (9, 2), (10, -1)])
def test_parameters_out_of_range_are_refused(link, parameter, value):
    payload = payloads.pack_parameters({parameter: value})
    assert refused(link, MessageType.CONFIGURE, payload) == (ErrorCode.RANGE, parameter)


def test_reads_out_of_range_are_refused(link):
    rng         = generator(56)
    left, right = textured_pair(64, 20, rng)
    calls = []
    for base, image in ((0, left.tobytes()), (2048, right.tobytes())):
        calls += [link.submit(MessageType.UPLOAD, image[at:at + 1024], 1, base + at) for at in (0, 1024)]
    link.wait(calls)
    link.call(MessageType.START, frame_id=1)
    for _ in itertools.count():
        status = payloads.FrameStatus.unpack(link.call(MessageType.STATUS, frame_id=1).payload)
        if status.state == FrameState.DONE:
            break
    size = 2*64*20
    for offset, length, code in (
        (size, 1, ErrorCode.OFFSET),
        (size - 4, 5, ErrorCode.OFFSET),
        (0xffffffff, 2, ErrorCode.OFFSET),
        (0, 0, ErrorCode.LENGTH),
        (0, 1025, ErrorCode.LENGTH),
    ):
        assert refused(link, MessageType.READ, payloads.pack_number(length), offset=offset)[0] == code
    call = link.submit(MessageType.READ, payloads.pack_number(7), 1, size - 7)
    link.wait([call])
    assert call.reply.payload == expected_map(left, right, MatcherSettings(16, 5)).astype("<i2").tobytes()[-7:]
    assert refused(link, MessageType.UPLOAD, bytes(1024)) == (ErrorCode.STATE, FrameState.DONE)


def test_slots_run_out_and_come_back(link):
    opened = 1
    while True:
        call = link.submit(MessageType.OPEN, payloads.pack_size(64, 20), opened + 1)
        try:
            link.wait([call])
        except DeviceRefused as error:
            assert (error.code, error.detail) == (ErrorCode.NO_SLOT, opened)
            link.forget()
            break
        opened += 1
    link.call(MessageType.RELEASE, frame_id=1)
    link.call(MessageType.OPEN, payloads.pack_size(64, 20), 99)


def test_console_after_noise():
    """What noise has typed is not part of the next line."""
    with native_device() as port, proxied(port) as line, connect(line.url) as device:
        with socket.create_connection(("127.0.0.1", int(line.url.rsplit(":", 1)[1]))) as noisy:
            noisy.sendall(b"sel\x80\x01")
            time.sleep(0.1)
        assert device.console("help").startswith("help: ")
        assert "passed" in device.console("selftest", 60)
        assert "unknown" in device.console("nonsense")
