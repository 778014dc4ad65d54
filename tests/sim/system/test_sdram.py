#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The system on SDRAM, alone in its file: another idle simulator would occupy a processor."""

from __future__ import annotations

import numpy as np
import pytest

from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.host_tools.devices.connect import connect
from litestereo.sim.bench.clocks import measure_frame
from litestereo.sim.system.simulation import SYS_CLK_HZ, start_simulation
from support.expected import expected_map
from support.pairs import generator, textured_pair

pytestmark = pytest.mark.system


@pytest.mark.long
def test_sdram():
    """LiteX's BIOS boots the firmware from flash; memory is LiteDRAM's model of the chip, the wire is a board's."""
    with start_simulation("sdram", byte_clock_hz=SYS_CLK_HZ*125//60) as simulation:
        check_serial_line(simulation)
        for mode in ("stored", "streamed"):
            pairs = [textured_pair(320, 120, generator(55), shift) for shift in (3, 12, 20)]
            with connect(f"udp://127.0.0.1:{simulation.udp_port}?mode={mode}") as device:
                for pair, result in zip(pairs, device.stream(pairs, MatcherSettings(64, 9)), strict=True):
                    assert np.array_equal(result.disparity, expected_map(*pair, MatcherSettings(64, 9)))


def check_serial_line(simulation):
    """Check self-test, clocks and a frame over the serial line."""
    with connect(f"tcp://127.0.0.1:{simulation.port}") as device:
        assert "selftest: passed" in device.console("selftest", 200)
        result = measure_frame(device, (640, 480, 64, 9, "all"))
        assert 1 < result.clocks_per_pixel < 2
        left, right = textured_pair(101, 33, generator(54))
        (frame,)    = device.stream([(left, right)], MatcherSettings(64, 9))
        assert np.array_equal(frame.disparity, expected_map(left, right, MatcherSettings(64, 9)))
