#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Cases of frames over Ethernet: a board's clocks."""

from __future__ import annotations

import pytest

from litestereo.host_tools.core.errors import LiteStereoError
from litestereo.sim.bench.ethernet import board_cases

pytestmark = pytest.mark.system


def test_cases_of_boards():
    """A board's case has its clocks; a board without Ethernet has none."""
    case, streamed = board_cases("ecpix5")
    assert (case.sys_hz, case.matcher_hz, case.wire_hz, case.mode) == (75_000_000, 100_000_000, 125_000_000, "stored")
    assert (streamed.sys_hz, streamed.mode) == (75_000_000, "streamed")
    assert [case.simulated_hz(clock) for clock in (case.wire_hz, case.matcher_hz)] == [1_666_666, 1_333_333]
    assert [case.mode for case in board_cases("colorlight_i9")] == ["stored", "streamed"]
    with pytest.raises(LiteStereoError, match="no Ethernet"):
        board_cases("ulx3s")
