#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""TestPattern: frames of noise in all formats, the same in each frame, of known disparity."""

from __future__ import annotations

import numpy as np
import pytest

from litestereo.gateware.cameras import test_pattern
from litestereo.gateware.cameras.parameters import CameraParameters
from litestereo.host_tools.core.settings import MatcherSettings
from support.dvp import FORMATS, Clock, Format, noise_rows
from support.expected import expected_map
from support.packed_core import PackedCore
from support.pairs import byte_generator

PARAMETERS = CameraParameters(max_width=24, max_height=9)


@pytest.fixture(scope="module")
def core():
    """Return the pattern in Verilator."""
    module = test_pattern.TestPattern(PARAMETERS)
    names  = ("run", "width", "height", "shift", "row_blanking", "frame_blanking")
    inputs = {name: getattr(module, name) for name in names} | {
        name: getattr(module.format, name) for name in ("two_bytes", "grey_second", "href_low", "vsync_low")}
    core = PackedCore(module, inputs, {name: getattr(module.sensor, name) for name in ("data", "href", "vsync")})
    yield core
    core.close()


def shown(core: PackedCore, form: Format, clocks: int) -> list[Clock]:
    """Return what the sensor shows in some clocks."""
    result = []
    for _ in range(clocks):
        out = core.get()
        result.append(Clock(bool(out["vsync"] ^ form.vsync_low), bool(out["href"] ^ form.href_low), out["data"]))
        core.clock()
    return result


def wanted(form: Format, width: int, height: int, shift: int, row_blanking: int) -> list[Clock]:
    """Return the clocks of a frame, from its begin to its end, by their definition."""
    result = []
    for row in noise_rows(width, height, shift):
        result += [Clock(True)]*row_blanking
        for pixel in row:
            grey    = Clock(True, True, int(pixel))
            result += [grey] if not form.two_bytes else [Clock(True, True, 0x80), grey][::1 if form.grey_second else -1]
    return result + [Clock(True)]*row_blanking


@pytest.mark.parametrize("form", FORMATS, ids=str)
def test_frames(core, form):
    """Two frames are what they have to be, clock by clock, with all limits of the settings."""
    rng = byte_generator(430, str(form))
    for width, height, shift, frame_blanking in [(1, 1, 0, 2), (24, 9, 0, 3), (23, 8, 1, 40), (2, 2, 255, 2),
                                                 (24, 1, 17, 5)]:
        row_blanking = shift + rng.choice((1, 2, 30))
        frame        = wanted(form, width, height, shift, row_blanking)
        core.set(**form.pins(), run=1, width=width, height=height, shift=shift, row_blanking=row_blanking,
                 frame_blanking=frame_blanking)
        core.reset()
        clocks = shown(core, form, frame_blanking + 3 + 2*(len(frame) + frame_blanking))
        begin  = next(number for number, clock in enumerate(clocks) if clock.frame and number > 1)
        assert begin <= frame_blanking + 3
        clocks = [clock if clock.row else Clock(clock.frame) for clock in clocks[begin:]]
        period = [*frame, *[Clock()]*frame_blanking]
        assert clocks == (period*3)[:len(clocks)]


def test_a_frame_is_finished(core):
    """A frame that has begun ends when it is not to run any more, and no other one begins."""
    form = Format()
    core.set(**form.pins(), run=1, width=5, height=3, shift=2, row_blanking=4, frame_blanking=6)
    core.reset()
    shown(core, form, 14)
    core.set(run=0)
    clocks = shown(core, form, 200)
    assert clocks[0].frame and not any(clock.frame for clock in clocks[60:])
    assert sum(clock.row for clock in clocks) > 10
    core.set(run=1)
    rows = [clock.data for clock in shown(core, form, 60) if clock.row]
    assert rows[:15] == noise_rows(5, 3, 2).ravel().tolist()


@pytest.mark.parametrize("reset_clock", [5, 11, 18, 27])
def test_reset_in_mid_frame(core, reset_clock):
    """After a reset a frame begins from its start."""
    form = Format(two_bytes=1)
    core.set(**form.pins(), run=1, width=5, height=3, shift=2, row_blanking=4, frame_blanking=6)
    core.reset()
    shown(core, form, reset_clock)
    core.reset()
    clocks = shown(core, form, 8 + len(wanted(form, 5, 3, 2, 4)))
    assert [clock.data for clock in clocks if clock.row][::2] == noise_rows(5, 3, 2).ravel().tolist()


@pytest.mark.parametrize("disparity", [0, 1, 9, 15])
def test_disparity(disparity):
    """A left image without shift and a right one with d have the disparity d in the whole valid region."""
    left, right = noise_rows(80, 30, 0), noise_rows(80, 30, disparity)
    result = expected_map(left, right, MatcherSettings(16, 7))
    # The fraction is that of a parabola through the costs of noise.
    region = result[3:-3, 15 + 3:-3]
    assert np.abs(region - 16*disparity).max() <= 8
    assert len(np.unique(noise_rows(640, 480, 0), axis=0)) == 480
