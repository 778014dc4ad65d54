#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""SoC, firmware and host tools together in litex_sim, over Ethernet: frames, bad networks, other hosts, restarts."""

from __future__ import annotations

import contextlib
import os
import re
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from litestereo.host_tools.core.errors import DeviceError, SessionLost
from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.host_tools.devices.connect import connect
from litestereo.host_tools.link.settings import LinkSettings
from litestereo.host_tools.protocol.messages import CHUNK_BYTES, Message, MessageType
from litestereo.sim.system.build import SimulationError
from litestereo.sim.system.capture import read_capture
from litestereo.sim.system.simulation import SYS_CLK_HZ, Stranger, start_simulation
from support.assert_stream import check_small_frame, check_stream
from support.expected import expected_map
from support.pairs import byte_generator, generator, textured_pair
from support.settings import SettingDraws
from support.terminal import counters, typed
from support.udp_faults import Faults
from support.udp_proxy import udp_proxied

pytestmark = pytest.mark.system

#: Frames through the bad network.
FRAMES = int(os.environ.get("LITESTEREO_FRAMES", "100"))

SETTINGS = MatcherSettings(32, 7)

#: Limits of an impatient host, and of one that waits for the five simulated seconds after which a silent host loses the
#: device; on a busy computer that takes many real seconds.
HASTY   = LinkSettings(hello_limit_s=1.0)
PATIENT = LinkSettings(hello_limit_s=120.0)


@pytest.fixture(scope="module")
def device():
    """Return a running system on integrated RAM."""
    with start_simulation() as simulation:
        yield simulation


@pytest.fixture
def url(device):
    return f"udp://127.0.0.1:{device.udp_port}"


def grown(before, after):
    """Return how much each counter has grown."""
    return {name: after[name] - before[name] for name in after}


def chunk_count(left):
    return 2*-(-left.size // CHUNK_BYTES)


@pytest.mark.long
def test_settings_and_sizes(url):
    """Odd sizes, the smallest and the largest image match, with settings that change between frames."""
    rng = generator(60)
    with connect(url) as device:
        for width, height, disparities, block_size in [(20, 5, 16, 5), (81, 15, 64, 15), (33, 11, 16, 9),
                                                       (64, 16, 16, 5), (640, 480, 64, 9)]:
            check_stream(device, [textured_pair(width, height, rng)], MatcherSettings(disparities, block_size))


@pytest.mark.long
def test_every_setting(url):
    """Each setting applies to the next frame, after any previous one."""
    rng   = generator(61)
    draws = SettingDraws(rng, block_size=15)
    with connect(url) as device:
        for _ in range(12):
            settings      = draws.settings()
            width, height = settings.minimum_size
            check_stream(device, [textured_pair(width + 9, height + 4, rng, 5)], settings)
    draws.check()


@pytest.mark.long
def test_next_upload_overlaps_match(device, url):
    """Chunks of later frames arrive while one is matched; without faults nothing is sent twice or dropped."""
    rng    = generator(62)
    pairs  = [textured_pair(320, 200, rng, shift) for shift in (3, 12, 20)]
    before = counters(device.port)
    with connect(url) as host:
        check_stream(host, pairs, MatcherSettings(64, 9))
        sent = host.link_counters
    change = grown(before, counters(device.port))
    assert change["chunks_while_matching"] > 10
    assert change["frames_opened"] == change["frames_matched"] == change["frames_released"] == 3
    assert change["chunks_received"] == sent.chunks_sent == 3*chunk_count(pairs[0][0])
    assert change["datagrams_malformed"] == change["datagrams_overrun"] == change["uploads_unfit"] == 0


def test_serial_line_meanwhile(device, url):
    """The console answers while a host on the network holds the device, and a frame is transferred."""
    pairs = [textured_pair(200, 100, generator(63), shift) for shift in (3, 9)]
    with connect(url) as host, pytest.raises(DeviceError, match="serial line"):
        host.console("info")
    with connect(url) as host:
        stream = host.stream(pairs, SETTINGS)
        assert np.array_equal(next(stream).disparity, expected_map(*pairs[0], SETTINGS))
        assert "udp: 192.168.1.50 port 19539\n" in typed(device.port, "info")
        assert np.array_equal(next(stream).disparity, expected_map(*pairs[1], SETTINGS))
        assert counters(device.port)["datagrams_received"] > 0


# Bad networks.

def at_rest(port, before, name, expected):
    """Return the growth of counters once they are stable and the named one has the expected value."""
    give_up_at = time.monotonic() + 20
    last       = None
    while True:
        change = grown(before, counters(port))
        moved  = [change[counter] for counter in ("datagrams_received", "datagrams_sent")]
        if moved == last and change[name] == expected():
            return change
        assert time.monotonic() < give_up_at, f"{change}, but {expected()} {name}"
        last = moved
        time.sleep(0.1)


@pytest.mark.long
def test_bad_network(device):
    """With datagrams lost, doubled, delayed and changed both ways no frame is lost or swapped, and each is counted."""
    rng      = generator(64)
    pairs    = [textured_pair(64, 20, rng, 3 + index % 20) for index in range(FRAMES)]
    expected = [expected_map(*pair, SETTINGS) for pair in pairs]
    ways     = [Faults(0.05, 0.05, 0.1, 0.01, rng=byte_generator(65, way)) for way in (0, 1)]
    before   = counters(device.port)
    with udp_proxied(device.udp_port, *ways) as network:
        with connect(network.url) as host:
            for result, disparity in zip(host.stream(pairs, SETTINGS), expected, strict=True):
                assert np.array_equal(result.disparity, disparity)
            sent = host.link_counters
        there, back = ways
        change = at_rest(device.port, before, "datagrams_received",
                         lambda: there.carried - there.lost + there.duplicated)
    for way in ways:
        assert min(way.lost, way.duplicated, way.reordered, way.flipped) > 0
    # Each datagram has exactly one of these outcomes.
    assert change["datagrams_received"] == sum(change[name] for name in (
        "messages_received", "header_errors", "crc_errors", "datagrams_malformed", "datagrams_overrun",
        "mailbox_overrun", "chunks_received", "chunks_repeated", "uploads_foreign", "uploads_unfit"))
    assert change["datagrams_malformed"] == there.flipped
    assert change["datagrams_sent"] == back.carried
    assert change["datagrams_overrun"] == change["crc_errors"] == change["header_errors"] == 0
    # A late copy of an OPEN opens a frame again, and late copies of its chunks may fill it.
    chunks, again = FRAMES*chunk_count(pairs[0][0]), change["frames_opened"] - FRAMES
    assert 0 <= again <= there.duplicated
    assert chunks <= change["chunks_received"] <= chunks + again*chunk_count(pairs[0][0])
    assert (change["sessions"], change["frames_matched"], change["frames_failed"]) == (1, FRAMES, 0)
    assert change["frames_released"] + change["frames_reclaimed"] == change["frames_opened"]
    assert (sent.chunks_sent, sent.parts_received) == (chunks, 3*FRAMES)


@pytest.mark.long
def test_large_frames_on_a_bad_network(device, url):
    """Uploads of many batches and maps of many READs work, with one frame matched while others are transferred."""
    rng   = generator(66)
    pairs = [textured_pair(320, 160, rng, shift) for shift in (3, 9, 15)]
    ways  = [Faults(0.05, 0.05, 0.1, 0.01, rng=byte_generator(67, way)) for way in (0, 1)]
    with udp_proxied(device.udp_port, *ways) as network, connect(network.url) as host:
        check_stream(host, pairs, MatcherSettings(64, 9))
        assert host.link_counters.chunks_sent_again > 0 and host.link_counters.parts_asked_again > 0
    check_small_frame(url)


@pytest.mark.long
def test_noise(device, url):
    """Datagrams of any bytes and length, just before the hello and while a frame is transferred, do no harm."""
    rng    = byte_generator(68)
    before = counters(device.port)
    pairs  = [textured_pair(200, 100, generator(68), shift) for shift in (3, 9)]
    count  = 0
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        stranger.connect(("127.0.0.1", device.udp_port))
        stranger.send(b"")
        for length in (1, 27, 28, 29, 1051, 1052, 1053, 1472):
            stranger.send(rng.randbytes(length))
            stranger.send((b"LS\1" + rng.randbytes(length))[:length])
        count += 17
        with connect(url) as host:
            for (left, right), result in zip(pairs, host.stream(pairs, SETTINGS), strict=True):
                assert np.array_equal(result.disparity, expected_map(left, right, SETTINGS))
                for _ in range(20):
                    stranger.send(rng.randbytes(rng.randrange(1473)))
                count += 20
    at_rest(device.port, before, "datagrams_malformed", lambda: count)
    check_small_frame(url)


# Several hosts.

def error_text(error):
    text = str(error.value)
    assert "\n" not in text
    return text


@pytest.mark.long
def test_second_host_waits(device, url):
    """A second host is told that the device is in use, on either link, and is served after the first one's BYE."""
    pair = textured_pair(110, 60, generator(69))
    with contextlib.ExitStack() as first:
        host   = first.enter_context(connect(url))
        before = host.statistics()
        for other in (url, f"tcp://127.0.0.1:{device.port}"):
            begin = time.monotonic()
            with pytest.raises(DeviceError) as error:
                connect(other, HASTY)
            assert re.match("another host uses the device.* for 1 s: ", error_text(error))
            assert 0.9 < time.monotonic() - begin < 5
            check_stream(host, [pair], SETTINGS)
        assert host.statistics()["sessions_refused"] >= before["sessions_refused"] + 2
        timer = threading.Timer(1.0, first.close)
        timer.start()
        with connect(url, PATIENT) as second:
            assert not timer.is_alive()
            check_stream(second, [pair], SETTINGS)
        timer.join()
    check_small_frame(f"tcp://127.0.0.1:{device.port}")


HOST = """
import sys
import numpy as np
from litestereo.host_tools.devices.connect import connect
from litestereo.host_tools.core.errors import DeviceError
image = np.zeros((400, 640), np.uint8)
try:
    with connect(sys.argv[1]) as device:
        device.compute(image, image, progress=lambda phase, done, total: print(phase, done, flush=True))
except DeviceError as error:
    print("error:", error, flush=True)
"""


@contextlib.contextmanager
def host_in_mid_upload(url):
    """Run a process that has uploaded some chunks of a frame."""
    with subprocess.Popen([sys.executable, "-c", HOST, url], stdout=subprocess.PIPE, text=True) as host:
        try:
            for line in host.stdout:
                if re.match(r"upload [1-9]", line):
                    break
            yield host
        finally:
            host.kill()


@pytest.mark.long
def test_host_killed_in_mid_upload(device, url):
    """The next host gets its frame after five simulated seconds, and the counters show that the slot was reclaimed."""
    before = counters(device.port)
    with host_in_mid_upload(url) as host:
        host.send_signal(signal.SIGKILL)
    begin = time.monotonic()
    with pytest.raises(DeviceError, match="another host uses the device"):
        connect(url, HASTY)
    check_small_frame(url, PATIENT)
    assert time.monotonic() - begin < 60
    assert grown(before, counters(device.port))["frames_reclaimed"] == 1


@pytest.mark.long
def test_host_asleep_in_mid_upload(device, url):
    """Another host takes the device over; the host that wakes up reports it, and its chunks are dropped."""
    before = counters(device.port)
    with host_in_mid_upload(url) as asleep:
        asleep.send_signal(signal.SIGSTOP)
        with connect(url, PATIENT) as host:
            check_stream(host, [textured_pair(110, 60, generator(70))], SETTINGS)
            asleep.send_signal(signal.SIGCONT)
            *_, last = asleep.stdout.read().splitlines()
            assert last == "error: another host has taken the device over while this one was silent: connect again"
            assert asleep.wait(10) == 0
            check_stream(host, [textured_pair(110, 60, generator(70), 12)], SETTINGS)
    check_small_frame(url)
    change = grown(before, counters(device.port))
    assert (change["frames_reclaimed"], change["sessions"]) == (1, 3)


@pytest.mark.long
def test_old_token(device, url):
    """After another session starts, requests and chunks of the old one have no effect, and one error tells its host."""
    pair = textured_pair(110, 60, generator(71))
    with connect(url) as old, contextlib.ExitStack() as new:
        old._link.call(MessageType.BYE)
        host   = new.enter_context(connect(url))
        before = counters(device.port)
        old._link._channel.send_chunk(old._link.session, 1, 1, 0, memoryview(bytes(CHUNK_BYTES)))
        with pytest.raises(SessionLost) as error:
            old.compute(*pair, SETTINGS)
        assert error_text(error).startswith("another host has taken the device over")
        with pytest.raises(DeviceError, match="connection to the device is closed: connect again"):
            old.compute(*pair, SETTINGS)
        check_stream(host, [pair], SETTINGS)
        # The token of the current session, but from another address.
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
            chunk = Message(MessageType.UPLOAD, host._link.session, 1, 1, 0, bytes(CHUNK_BYTES)).encode()
            stranger.sendto(chunk, ("127.0.0.1", device.udp_port))
        check_stream(host, [pair], SETTINGS)
        assert grown(before, counters(device.port))["uploads_foreign"] == 2
        new.close()
        check_small_frame(url)


# Strangers.

def clocks_per_frame(stranger, mode):
    """Clocks of the wire from one frame's upload to the next one's, in a session beside a stranger, or none."""
    pair     = textured_pair(160, 100, generator(74), 5)
    expected = expected_map(*pair, SETTINGS)
    with tempfile.TemporaryDirectory() as folder:
        capture = Path(folder) / "wire.pcap"
        with start_simulation(capture=capture, stranger=stranger) as device:
            with connect(f"udp://127.0.0.1:{device.udp_port}?mode={mode}") as host:
                maps = [result.disparity for result in host.stream([pair]*16, SETTINGS)]
            assert len(maps) == 16 and all(np.array_equal(disparity, expected) for disparity in maps)
            refused = counters(device.port)["requests_refused"]
        last = {entry.message.frame_id: entry.clock for entry in read_capture(capture)
                if entry.to_device and entry.message.type in (MessageType.UPLOAD, MessageType.PAIRS)}
    begin, *between, end = sorted(last.values())[1:-1]
    return (end - begin)/(len(between) + 1), refused


@pytest.mark.long
@pytest.mark.parametrize("mode", ["stored", "streamed"])
def test_a_stranger_that_answers_no_arp(mode):
    """A session keeps 90 % of its pace while the device answers a station that does not exist, 16 times per second."""
    alone, _        = clocks_per_frame(None, mode)
    request         = Message(MessageType.STATUS).encode()
    beside, refused = clocks_per_frame(Stranger(request, SYS_CLK_HZ//16), mode)
    assert refused > 10
    assert beside < alone/0.9


# Devices that restart, and ports.

@pytest.mark.long
def test_device_restarts_in_mid_upload():
    """The previous host gets one error, soon; a new connection matches correctly. A device that is gone is the same."""
    pair    = textured_pair(320, 200, generator(72))
    running = [start_simulation()]
    port    = running[0].udp_port
    begin   = []

    def progress(phase, done, total):
        if phase == "upload" and 20 < done < total and len(running) == 1:
            running[0].close()
            running.append(start_simulation(udp_port=port))
            begin.append(time.monotonic())

    try:
        with connect(f"udp://127.0.0.1:{port}") as host:
            with pytest.raises(SessionLost) as error:
                host.compute(*pair, SETTINGS, progress)
            assert "or it restarted; connect again" in error_text(error)
            assert time.monotonic() - begin[0] < 10
            with pytest.raises(DeviceError, match="connect again"):
                host.statistics()
        with connect(f"udp://127.0.0.1:{port}") as host:
            check_stream(host, [pair], SETTINGS)
            running[1].close()
            with pytest.raises(DeviceError) as error:
                check_stream(host, [pair], SETTINGS)
            assert "nothing listens there" in error_text(error)
    finally:
        for simulation in running:
            simulation.close()


@pytest.mark.long
def test_fast_wire():
    """With a wire twice as fast as the SoC's clock, as on a board, nothing is dropped for lack of time."""
    rng = generator(73)
    with start_simulation(byte_clock_hz=2*SYS_CLK_HZ) as device:
        with connect(f"udp://127.0.0.1:{device.udp_port}") as host:
            check_stream(host, [textured_pair(320, 200, rng, shift) for shift in (3, 12)], MatcherSettings(64, 9))
        counted = counters(device.port)
    assert counted["datagrams_overrun"] == counted["datagrams_malformed"] == 0
    assert counted["frames_matched"] == counted["frames_released"] == 2


def test_port_in_use(device):
    """The error is one clear line, from the function and from the command."""
    with pytest.raises(SimulationError, match=f"^port {device.udp_port} is in use"):
        start_simulation(udp_port=device.udp_port)
    command = [sys.executable, "-m", "litestereo.sim.system.serve", "--port", "0", "--udp-port", str(device.udp_port)]
    serve   = subprocess.run(command, check=False, capture_output=True, text=True)
    assert serve.returncode == 1
    assert serve.stderr == f"sim: error: port {device.udp_port} is in use: choose another, or 0 for a free one\n"
