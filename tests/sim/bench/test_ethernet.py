#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Figures of frames over Ethernet: the same twice, and consistent with what the memory was used for."""

from __future__ import annotations

from dataclasses import replace

import pytest

from litestereo.host_tools.core.errors import LiteStereoError
from litestereo.sim.bench.ethernet import CASES, board_cases, measure_flow

pytestmark = pytest.mark.system

SMALL = replace(CASES[0], width=160, height=64)

#: Bytes of a word of the integrated RAM.
WORD_BYTES = 16


@pytest.mark.long
def test_same_figures_twice():
    """Two measurements differ in no clock and in no word of the memory; every pixel crosses it four times."""
    first  = measure_flow(SMALL)
    second = measure_flow(SMALL)
    assert second.clocks_per_frame == pytest.approx(first.clocks_per_frame, rel=0.005)
    assert second.shares == pytest.approx(first.shares, rel=0.05, abs=0.001)
    # The clocks of system and wire are the same here.
    pixels = SMALL.width*SMALL.height
    for name in ("matcher_reader", "matcher_writer", "link_reader", "link_writer"):
        words = first.shares[f"{name}_words"]*first.clocks_per_frame
        assert words == pytest.approx(2*pixels/WORD_BYTES, rel=0.15), name


def test_cases_of_boards():
    """A board's case has its clocks; a board without Ethernet has none."""
    case, = board_cases("ecpix5")
    assert (case.sys_hz, case.matcher_hz, case.wire_hz, case.mode) == (75_000_000, 100_000_000, 125_000_000, "stored")
    assert [case.simulated_hz(clock) for clock in (case.wire_hz, case.matcher_hz)] == [1_666_666, 1_333_333]
    assert [case.mode for case in board_cases("colorlight_i9")] in (["stored"], ["stored", "streamed"])
    with pytest.raises(LiteStereoError, match="no Ethernet"):
        board_cases("ulx3s")
