#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The clocks of rectified frames: their floors, in the full system at a small size."""

from __future__ import annotations

import re

import pytest

from litestereo.host_tools.core.errors import LiteStereoError
from litestereo.host_tools.core.grid import row_budget
from litestereo.host_tools.protocol.messages import REPLY, Message, MessageType
from litestereo.sim.bench import rectified
from litestereo.sim.bench.clocks import CASES
from litestereo.sim.bench.rectified import MODES, RectifiedClocks, measure_rectified, queued_clocks, rig
from litestereo.sim.system.capture import Captured


def test_rig():
    """The rig of the bench is straight enough for frames that follow one another: see docs/rectification.md."""
    budget = row_budget(rig(*CASES[0][:2]).grids)
    assert 8 <= budget.delay <= 12
    assert row_budget(rig(320, 240, 0.25).grids).delay <= 3


def part(clock, frame, to_device=False):
    """Return a part of a map on the wire."""
    return Captured(clock, to_device, Message(MessageType.READ | REPLY, 0, 0, frame, 0, b""))


def test_queued_clocks():
    """They are counted from the first part of a map to that of the next one, without the frame that is alone."""
    wire = [part(100, 7), part(1000, 8), part(1003, 8), part(1500, 9, True), part(2000, 9), part(2900, 10)]
    assert queued_clocks(wire) == 950


def test_frames_that_take_too_long(monkeypatch):
    """A frame with more clocks than the floors allow fails the bench, with its numbers."""
    RectifiedClocks(640, 480, 10, 320000, 320000.0).check()
    with pytest.raises(LiteStereoError, match=re.escape("a frame alone takes 1.040 clocks per pixel, more than 1.03")):
        RectifiedClocks(640, 480, 10, 326144, 320000.0).check()
    slow = RectifiedClocks(640, 480, 10, 320000, 325632.0)
    with pytest.raises(LiteStereoError, match=re.escape("that follow takes 1.060 clocks per pixel, more than 1.05")):
        slow.check()
    monkeypatch.setattr(rectified, "measure_rectified", lambda *_: slow)
    with pytest.raises(LiteStereoError, match="more than"):
        rectified.rectified_figures(640, 480)


def test_figures(monkeypatch):
    """The bench has a row for each figure of both ways in which frames come."""
    monkeypatch.setattr(rectified, "measure_rectified", lambda *_: RectifiedClocks(640, 480, 10, 319000, 318000.4))
    rows = {row["name"]: row["value"] for row in rectified.rectified_figures(640, 480)}
    assert len(rows) == 10
    assert rows["rectified_clocks_per_frame/640x480/d16/b9/streamed"] == 319000
    assert rows["rectified_clocks_per_queued_pixel/640x480/d16/b9/stored"] == 1.0352
    assert rows["rectified_clocks_per_pixel_and_delay/640x480/d16/b9/stored"] == 1.0172


@pytest.mark.system
@pytest.mark.long
@pytest.mark.parametrize("mode", MODES)
def test_clocks_of_rectified_frames(mode):
    """A small frame, and frames that follow one another, stored and streamed, keep the floors of the bench."""
    found = measure_rectified(320, 240, mode, 0.25)
    print(found, found.per_pixel_with_delay, found.queued_per_pixel)
    found.check()
