#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Each board's own SoC in litex_sim: it boots from its flash, passes its self test, and matches a real pair."""

from __future__ import annotations

import os

import numpy as np
import pytest

from litestereo.host_tools.device import connect
from litestereo.host_tools.settings import MatcherSettings
from litestereo.sim.system import start_simulation
from litestereo.soc.boards import BOARDS, soc_class
from support.data import stereo_pair
from support.expected import expected_map

pytestmark = pytest.mark.system

#: Boards whose simulators are built, which takes minutes each; `make boards-sim` takes all.
CHOSEN = os.environ.get("LITESTEREO_BOARDS", "colorlight_i5").split()

#: LiteDRAM's model of DDR3 answers without the training that a board's needs.
SIMULATED = [board for board in BOARDS if board != "ecpix5"]


@pytest.mark.parametrize("board", SIMULATED)
def test_board(board):
    """Boot program, RAM of its kind and width, preset: as on the board; pins and clocks are the simulator's."""
    if board not in CHOSEN:
        pytest.skip(f"not in LITESTEREO_BOARDS: {' '.join(CHOSEN)}")
    preset   = soc_class(board).preset
    settings = MatcherSettings(preset.disparities, preset.max_block_size,
                               uniqueness_ratio=15 if "uniqueness" in preset.features else 0,
                               texture_threshold=10 if "texture" in preset.features else 0,
                               subpixel="subpixel" in preset.features)
    pair        = stereo_pair("motorcycle")
    left, right = (np.ascontiguousarray(image[200:240, 100:420]) for image in (pair.left, pair.right))
    with start_simulation(board, timeout_s=900) as simulation:
        url = f"udp://127.0.0.1:{simulation.udp_port}" if board.startswith("colorlight") else \
            f"tcp://127.0.0.1:{simulation.port}"
        with connect(f"tcp://127.0.0.1:{simulation.port}") as device:
            assert "selftest: passed" in device.console("selftest", 900)
        with connect(url) as device:
            result = device.compute(left, right, settings)
    assert np.array_equal(result.disparity, expected_map(left, right, settings))
