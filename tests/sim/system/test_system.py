#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""SoC, firmware and host tools together in litex_sim: few boots, and many checks in each."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
import time

import numpy as np
import pytest

from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.host_tools.devices.connect import connect
from litestereo.sim.bench.clocks import measure_frame
from litestereo.sim.system.build import SimulationError
from litestereo.sim.system.simulation import start_simulation
from support.assert_stream import check_small_frame, check_stream
from support.data import stereo_pair
from support.fault_proxy import Faults, proxied
from support.interruptible import interruptible
from support.opencv import same_as_opencv
from support.pairs import generator, textured_pair
from support.settings import OpenCVDraws, SettingDraws

pytestmark = pytest.mark.system


@pytest.fixture(scope="module")
def simulation():
    """Return a running system on integrated RAM."""
    with start_simulation() as simulation:
        yield simulation


@pytest.fixture
def port(simulation):
    """Return the port of its UART."""
    return simulation.port


@pytest.fixture
def url(port):
    return f"tcp://127.0.0.1:{port}"


def test_selftest_and_console(url):
    """The accelerator equals the CPU's SAD, on the target."""
    with connect(url) as device:
        assert "selftest: passed" in device.console("selftest", 200)
        info = device.console("info")
        assert "640" in info
        # The deepest stack so far, with the self-test, is at most half of the room.
        used, size = map(int, re.search(r"stack: (\d+) of (\d+) bytes used", info).groups())
        assert 500 < used < size // 2
        assert "matcher_interrupts" in device.console("stats", 200)
        assert device.statistics()["matcher_interrupts"] > 0


@pytest.mark.long
def test_one_pixel_per_clock(url):
    """640x480, 64 disparities, block 9, memory to memory, with all stages or none; the map's CRC-32 is the model's."""
    with connect(url) as device:
        for stages in ("all", "sad"):
            result = measure_frame(device, (640, 480, 64, 9, stages))
            assert result.clocks_per_pixel <= 1.05
            # A row waits for half a block, the prefilter, the left-right check and the median.
            assert result.first_row_clocks <= 640*(9//2 + 1 + 9//2 + 4)
        assert measure_frame(device, (160, 32, 64, 9, "sad"), "cpu_bench").clocks_per_pixel > 100


@pytest.mark.long
def test_next_upload_overlaps_match(url):
    """Chunks of the second frame arrive while the first one is matched."""
    rng   = generator(50)
    pairs = [textured_pair(320, 200, rng, shift) for shift in (3, 12)]
    with connect(url) as device:
        before = device.statistics()
        check_stream(device, pairs, MatcherSettings(64, 9))
        after = device.statistics()
    assert after["chunks_while_matching"] > before["chunks_while_matching"]
    assert after["frames_matched"] - before["frames_matched"] == 2
    assert after["frames_released"] - before["frames_released"] == 2


def test_settings_and_sizes(url):
    """Odd sizes and the smallest image match, with settings that change between frames."""
    rng = generator(51)
    with connect(url) as device:
        for width, height, disparities, block_size in [(20, 5, 16, 5), (81, 15, 64, 15), (33, 11, 16, 9)]:
            check_stream(device, [textured_pair(width, height, rng)], MatcherSettings(disparities, block_size))


UPLOAD_FOREVER = """
import sys
import numpy as np
from litestereo.host_tools.devices.connect import connect
image = np.zeros((200, 320), np.uint8)
with connect(sys.argv[1]) as device:
    device.compute(image, image, progress=lambda phase, done, total: print(phase, done, flush=True))
"""


@pytest.mark.long
def test_every_setting(url):
    """Each setting applies to the next frame, after any previous one."""
    rng   = generator(56)
    draws = SettingDraws(rng, block_size=15)
    with connect(url) as device:
        for _ in range(12):
            settings      = draws.settings()
            width, height = settings.minimum_size
            check_stream(device, [textured_pair(width + 9, height + 4, rng, 5)], settings)
    draws.check()


@pytest.mark.long
def test_host_killed_in_mid_upload(url):
    """The next host gets its frame at once, and the counters show that the slot was reclaimed."""
    with subprocess.Popen([sys.executable, "-c", UPLOAD_FOREVER, url], stdout=subprocess.PIPE, text=True) as host:
        for line in host.stdout:
            if re.match(r"upload [1-9]", line):
                break
        host.send_signal(signal.SIGKILL)
    check_small_frame(url)
    with connect(url) as device:
        assert device.statistics()["frames_reclaimed"] > 0


@pytest.mark.long
def test_garbage_before_hello(port, url):
    """Noise on the line, with half a frame, does no harm."""
    rng = generator(52)
    for length in (1, 300, 3000):
        with socket.create_connection(("127.0.0.1", port)) as line:
            line.sendall(rng.bytes(length) + b"\0LS\1")
            time.sleep(0.2)
        check_small_frame(url)


@pytest.mark.long
def test_bad_line(port, url):
    """Bytes flipped, dropped, inserted and repeated both ways cost time but no pixel, and are counted."""
    rng     = generator(53)
    faults  = [Faults(rate=1/1500), Faults(rate=1/1500)]
    for one in faults:
        one.rng.seed(int(rng.integers(1 << 30)))
    with proxied(port, *faults) as proxy, connect(proxy.url) as device:
        before = device.statistics()
        check_stream(device, [textured_pair(90, 40, rng, shift) for shift in (2, 5, 9)], MatcherSettings(32, 9))
        after = device.statistics()
    assert sum(one.flipped + one.dropped + one.inserted + one.repeated for one in faults) > 5
    errors = ("framing_errors", "crc_errors", "header_errors", "receive_timeouts", "console_lines")
    assert sum(after[name] for name in errors) > sum(before[name] for name in errors)
    check_small_frame(url)


@pytest.mark.parametrize("link", ["serial", "udp"])
def test_a_real_pair(simulation, url, link):
    """Every pixel of a part of a real pair is cv2.StereoBM's, over either link."""
    pair     = stereo_pair("motorcycle")
    settings = MatcherSettings(64, 9)
    left, right = (np.ascontiguousarray(image[200:240, :320]) for image in (pair.left, pair.right))
    with connect(url if link == "serial" else f"udp://127.0.0.1:{simulation.udp_port}") as device:
        result = device.compute(left, right, settings)
    same_as_opencv(result.disparity, left, right, settings)


@pytest.mark.parametrize("name, count", [
    pytest.param("tsukuba", 8, marks=pytest.mark.long),
    pytest.param("venus", 4, marks=pytest.mark.long),
    ("teddy", 2),
    pytest.param("cones", 4, marks=pytest.mark.long),
])
def test_opencv(simulation, name, count):
    """Every pixel of real pairs over Ethernet is cv2.StereoBM's, at random settings."""
    pair  = stereo_pair(name)
    draws = OpenCVDraws(generator(55, *name.encode()), block_size=15)
    with connect(f"udp://127.0.0.1:{simulation.udp_port}") as device:
        if name == "tsukuba":
            check_stream(device, [(pair.left, pair.right)], MatcherSettings(16, 7, prefilter="none", subpixel=False))
        for drawn in (draws.settings() for _ in range(count)):
            (result,) = device.stream([(pair.left, pair.right)], drawn)
            same_as_opencv(result.disparity, pair.left, pair.right, drawn)


@pytest.mark.long
def test_reset(simulation, url):
    """After a reset in mid-session the firmware reports the cause, and both links work again."""
    with connect(url) as device:
        assert re.search(r"reset \d+ since power-up: requested", device.console("reset", 200))
        assert "matcher errors: 0 config, 0 bus, 0 aborted, 0 timeouts, 0 stuck" in device.console("stats", 200)
    check_small_frame(url)
    check_small_frame(f"udp://127.0.0.1:{simulation.udp_port}")


def test_port_in_use(port):
    """The error is one clear line, from the function and from the command."""
    with pytest.raises(SimulationError, match=f"^port {port} is in use"):
        start_simulation(port=port)
    command = [sys.executable, "-m", "litestereo.sim.system.serve", "--port", str(port), "--udp-port", "0"]
    serve   = subprocess.run(command, check=False, capture_output=True, text=True)
    assert serve.returncode == 1
    assert serve.stderr.splitlines() == [f"sim: error: port {port} is in use: choose another, or 0 for a free one"]


def test_unknown_memory():
    """An unknown memory is refused before anything is built."""
    with pytest.raises(SimulationError, match="unknown memory 'core'"):
        start_simulation("core")


@pytest.mark.long
def test_serve():
    """`make sim` prints its URLs, works, and ends with Ctrl-C, together with its simulator."""
    command = [sys.executable, "-m", "litestereo.sim.system.serve", "--port", "0", "--udp-port", "0"]
    with interruptible(command, stdout=subprocess.PIPE) as serve:
        urls = re.findall(r"\w+://127\.0\.0\.1:\d+", serve.stdout.readline())
        assert [url.partition(":")[0] for url in urls] == ["udp", "tcp"]
        for url in urls:
            check_small_frame(url)
        serve.send_signal(signal.SIGINT)
        assert serve.wait(10) == 0


@pytest.mark.long
def test_no_orphans():
    """A simulator ends with the process that started it, even if that is killed."""
    program = ("from litestereo.sim.system.simulation import start_simulation\n"
               "import time\n"
               "print(start_simulation()._process.pid, flush=True)\n"
               "time.sleep(100)\n")
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True) as starter:
        pid = int(starter.stdout.readline())
        os.kill(pid, 0)
        starter.kill()
    deadline = time.monotonic() + 5
    while time.monotonic() < deadline:
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            return
        time.sleep(0.05)
    raise AssertionError("the simulator outlived its starter")
