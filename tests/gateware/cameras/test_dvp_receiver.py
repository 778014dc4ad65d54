#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""DVPReceiver: each byte that is a grey value, and each mark, in its clock, for all formats and any signals."""

from __future__ import annotations

import random

import pytest

from litestereo.gateware.cameras.dvp_receiver import DVPReceiver
from litestereo.gateware.cameras.layouts import FRAME_BEGIN, FRAME_END, PIXEL, ROW_END
from support.dvp import FORMATS, Clock, Format, Sensor, drawn_rows
from support.packed_core import PackedCore
from support.pairs import byte_generator

LATENCY = 3


@pytest.fixture(scope="module")
def core():
    """Return the receiver in Verilator."""
    module = DVPReceiver()
    assert module.latency == LATENCY
    sensor, form, source = module.sensor, module.format, module.source
    inputs = {"data": sensor.data, "href": sensor.href, "vsync": sensor.vsync, "two_bytes": form.two_bytes,
              "grey_second": form.grey_second, "href_low": form.href_low, "vsync_low": form.vsync_low}
    core = PackedCore(module, inputs, {"valid": source.valid, "kind": source.kind, "pixel": source.pixel,
                                    "active": module.active})
    yield core
    core.close()


def expected(clocks: list[Clock], form: Format) -> dict[int, tuple[int, int | None]]:
    """Return the item of each clock that has one, by the definition of the signals: kind, and the value of a pixel."""
    items: dict[int, tuple[int, int | None]] = {}
    seen = frame = row = False
    count = 0
    for number, clock in enumerate(clocks):
        now  = clock.frame and seen
        line = now and clock.row
        seen = seen or not clock.frame
        if frame and not now:
            items[number + LATENCY] = (FRAME_END, None)
        elif row and not line:
            items[number + LATENCY] = (ROW_END, None)
        if now and not frame:
            # A clock before the first byte; it says that the frame before has ended.
            items[number + LATENCY - 1] = (FRAME_BEGIN, None)
        count = count if line else 0
        if line and (not form.two_bytes or count % 2 == form.grey_second):
            items[number + LATENCY] = (PIXEL, clock.data)
        count += line
        frame, row = now, line
    return items


def check(core: PackedCore, clocks: list[Clock], form: Format) -> None:
    """Reset the receiver, show it clocks, and compare all that comes out."""
    quiet  = [Clock()]*6
    wanted = expected([*clocks, *quiet], form)
    begun  = next((number for number, clock in enumerate(clocks) if not clock.frame), len(clocks))
    inside = [clock.frame and number > begun for number, clock in enumerate([*clocks, *quiet])]
    core.set(**form.pins())
    core.reset()
    for number, clock in enumerate([*clocks, *quiet]):
        core.set(**clock.pins(form))
        out = core.get()
        assert out["valid"] == (number in wanted), number
        if number in wanted:
            kind, value = wanted[number]
            assert out["kind"] == kind, number
            assert value is None or out["pixel"] == value, number
        # A clock late.
        assert out["active"] == (number > 0 and inside[number - 1]), number
        core.clock()


@pytest.mark.parametrize("form", FORMATS, ids=str)
def test_frames(core, form):
    """Frames of all sizes down to a pixel, with blankings from a clock up, come out as they are."""
    rng    = byte_generator(400, str(form))
    sensor = Sensor(form, rng, blanking=(1, 4), between=(1, 5))
    sizes  = [(1, 1), (1, 3), (2, 1), (5, 2), (16, 3), (3, 7)]
    clocks = [clock for size in rng.sample(sizes, len(sizes)) for clock in sensor.frame(drawn_rows(*size, rng))]
    check(core, clocks, form)


@pytest.mark.parametrize("form", FORMATS, ids=str)
def test_any_signals(core, form):
    """Signals that change at any time, also together, give the items of their definition."""
    rng    = byte_generator(401, str(form))
    clocks = []
    for likely in (0.5, 0.9, 0.98):
        frame = row = False
        for _ in range(400):
            frame ^= rng.random() > likely
            row   ^= rng.random() > likely
            clocks.append(Clock(frame, row, rng.getrandbits(8)))
    check(core, clocks, form)


@pytest.mark.parametrize("reset_clock", [0, 1, 2, 3, 4, 7, 20])
def test_reset_in_mid_frame(core, reset_clock):
    """The rest of a frame that is under way at a reset is ignored, and the next one is whole."""
    form = Format(vsync_low=1)
    rng  = byte_generator(402, reset_clock)
    rows = drawn_rows(4, 3, rng)
    core.set(**form.pins())
    core.reset()
    sensor = Sensor(form, random.Random(1), (2, 2), (2, 2))
    first  = list(sensor.frame(rows))
    for clock in first[:reset_clock]:
        core.set(**clock.pins(form))
        core.clock()
    check(core, [*first[reset_clock:], *sensor.frame(rows)], form)


def test_a_reset_forgets_what_is_under_way(core):
    """No item that came in before a reset comes out after it."""
    form = Format()
    core.set(**form.pins())
    for frame in (False, False, True, True):
        core.set(**Clock(frame, frame, 7).pins(form))
        core.clock()
    core.set(**Clock(True, True, 8).pins(form))
    core.reset()
    for _ in range(8):
        assert not core.get()["valid"]
        core.clock()
