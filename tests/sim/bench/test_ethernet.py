#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Cases of frames over Ethernet: a board's clocks."""

from __future__ import annotations

import pytest

from litestereo.host_tools.core.errors import LiteStereoError
from litestereo.sim.bench.ethernet import board_cases
from litestereo.soc.boards import soc_class

pytestmark = pytest.mark.system


def test_cases_of_boards():
    """A board's case has its clocks; a board without Ethernet has none."""
    case, streamed = board_cases("ecpix5")
    preset         = soc_class("ecpix5").preset
    assert (case.sys_hz, case.matcher_hz, case.wire_hz, case.mode) == (
        preset.sys_clk_freq, preset.matcher_hz, 125_000_000, "stored")
    assert (streamed.sys_hz, streamed.mode) == (preset.sys_clk_freq, "streamed")
    assert preset.sys_clk_freq < preset.matcher_hz
    assert [case.simulated_hz(clock) for clock in (case.wire_hz, case.matcher_hz)] == [
        10**6*clock//preset.sys_clk_freq for clock in (125_000_000, preset.matcher_hz)]
    assert [case.mode for case in board_cases("colorlight_i9")] == ["stored", "streamed"]
    with pytest.raises(LiteStereoError, match="no Ethernet"):
        board_cases("ulx3s")
