#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The programs of firmware/examples on the full system in litex_sim."""

import contextlib
import itertools
import re
import subprocess
import sys
import zlib

import numpy as np
import pytest

from litestereo.firmware import FIRMWARE_DIR
from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.sim.models.stereo_bm import stereo_bm
from litestereo.sim.system.build import SimulationError, examples
from litestereo.sim.system.example import run_example
from support.pattern import pattern

pytestmark = pytest.mark.system


@pytest.mark.parametrize("name", ["hello_disparity", pytest.param("hello_cplusplus", marks=pytest.mark.long)])
def test_hello_disparity(name):
    """The wall is 12 pixels away, in sixteenths, and `make example` runs the same command."""
    command = [sys.executable, "-m", "litestereo.sim.system.example", name]
    done    = subprocess.run(command, capture_output=True, text=True, check=True, timeout=600)
    (line,) = done.stdout.splitlines()
    found   = re.fullmatch(rf"{name}: 128x64 pixels in (\d+) clocks, disparity (-?\d+)/16 pixels", line)
    assert abs(int(found[2]) - 12*16) < 16
    assert int(found[1]) < 1.2*128*64


#: Camera and scene as in obstacle.c.
FOCAL_PIXELS, BASELINE_MM, WALL, ALARM_MM, SECTORS = 200, 100, 5, 1200, 5


def steps(disparity):
    """Return distances from one disparity step less to one more."""
    return FOCAL_PIXELS*BASELINE_MM/(disparity + 1), FOCAL_PIXELS*BASELINE_MM/(disparity - 1)


@pytest.mark.long
def test_obstacle():
    """Each obstacle is reported in its sector and at its distance, the wall in the others, and the alarm is correct."""
    with contextlib.closing(run_example("obstacle")) as lines:
        frames = list(itertools.islice(lines, 10))
    alarms = 0
    for frame, line in enumerate(frames):
        found = re.fullmatch(rf"obstacle: frame {frame}:((?: \d+){{{SECTORS}}}) mm, nearest in sector (\d)(, ALARM)?",
                             line)
        sector, disparity = frame*2 % SECTORS, 8 + 4*(frame % 5)
        distances = [int(word) for word in found[1].split()]
        assert int(found[2]) == sector
        for index, distance in enumerate(distances):
            least, most = steps(disparity if index == sector else WALL)
            assert least <= distance <= most, line
        assert (found[3] is not None) == (distances[sector] < ALARM_MM)
        alarms += found[3] is not None
    # Some frames raise the alarm, some do not.
    assert alarms == 4


@pytest.mark.long
def test_throughput():
    """Consecutive frames cost little more than the matcher's clocks, and the last map is correct."""
    first, second = run_example("throughput")
    found = re.fullmatch(r"throughput: width=(\d+) height=(\d+) frames=(\d+) clocks_per_frame=(\d+) "
                         r"matcher_clocks=(\d+) crc32=0x([0-9a-f]{8})", first)
    width, height, frames, clocks, matcher = (int(word) for word in found.groups()[:5])
    expected = stereo_bm(pattern(width, height, 1), pattern(width, height, 2), MatcherSettings(64, 9))
    assert int(found[6], 16) == zlib.crc32(np.ascontiguousarray(expected).astype("<i2").tobytes())
    assert frames >= 8
    assert matcher <= clocks < matcher + 5000
    assert matcher < 1.1*width*height
    hundredths = clocks % (width*height)*100 // (width*height)
    assert second.startswith(f"throughput: {clocks // (width*height)}.{hundredths:02d} clocks per pixel, "
                             f"{10**6//clocks} frames per second")


@pytest.mark.long
def test_recovery():
    """A failed condition, a hang, and a hang without the watchdog's interrupt: each start reports the cause."""
    program = (FIRMWARE_DIR / "examples" / "recovery.c").read_text().splitlines()
    ensured = 1 + next(index for index, line in enumerate(program) if "ENSURE(" in line)
    lines   = list(run_example("recovery"))
    assert lines.pop(1) == ""
    assert lines.pop(1) == f"examples/recovery.c:{ensured}: ensure failed, reset"
    wanted = r"recovery: start (\d), ([a-z-]+), place 0x([0-9a-f]{8}), line (\d+), hang at 0x([0-9a-f]{8})"
    starts = [re.fullmatch(wanted, line) for line in lines]
    assert [(int(start[1]), start[2], int(start[4])) for start in starts] == [
        (0, "power-up", 0), (1, "ensure", ensured), (2, "watchdog", 0), (3, "unknown", 0)]
    places = [int(start[3], 16) for start in starts]
    hang   = int(starts[0][5], 16)
    assert places[0] == places[3] == 0
    assert places[1] >> 24 == 0x40
    assert hang <= places[2] < hang + 64


def test_unknown_example():
    """An unknown example is refused before anything is built."""
    assert examples() == ["hello_cplusplus", "hello_disparity", "obstacle", "recovery", "throughput"]
    with pytest.raises(SimulationError, match="^unknown example 'core': choose one of hello_cplusplus, "):
        next(run_example("core"))
    command = [sys.executable, "-m", "litestereo.sim.system.example", "core"]
    done    = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr.startswith("example: error: unknown example 'core'") and done.stderr.count("\n") == 1
