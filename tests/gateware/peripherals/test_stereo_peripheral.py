#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The matcher from memory to memory, on each kind of port: slow memory, aborts, errors, bad settings, resets."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from litestereo.gateware.common.parameters import MatcherParameters
from litestereo.gateware.common.settings import MAX_HEIGHT
from litestereo.gateware.common.settings import SETTINGS as TABLE
from litestereo.gateware.matcher.frame_settings import NO_CHECK
from litestereo.gateware.peripherals.stereo_crossing import StereoPeripheralCrossing
from litestereo.gateware.peripherals.stereo_peripheral import (
    ERROR_ABORTED,
    ERROR_BUS,
    ERROR_CONFIG,
    StereoPeripheral,
)
from litestereo.host_tools.core.settings import MatcherSettings, from_number
from support.limits import Range, setting_ranges
from support.pairs import byte_generator
from support.peripheral_bench import CROSSED, DISPARITIES, FAR, MAX_BLOCK, MAX_WIDTH, PORTS, Bench, break_off, registers


@pytest.fixture(params=[*PORTS, *CROSSED, *FAR])
def bench(request):
    rng   = byte_generator(20, request.param)
    bench = Bench(request.param, rng)
    yield bench
    bench.core.close()


SIZES = [(20, 5, 5), (21, 5, 5), (MAX_WIDTH, 9, 9), (MAX_WIDTH, 13, 7), (37, 11, 5), (24, 9, 9)]


def test_sizes(bench):
    """The smallest image, odd sizes and the maximum width work at any speed of the memory."""
    for speed in (1.0, 0.6, 0.15):
        bench.memory.speed = speed
        for size in SIZES:
            bench.check_frame(*size)
    assert bench.core.get("frames") == 3*len(SIZES)
    bench.draws.check()


def test_counts_clocks(bench):
    """`clocks` counts the clocks from start to done, and the first row comes before the end."""
    bench.begin(MAX_WIDTH, 9)
    start = bench.clocks
    assert bench.end() == ["done"]
    assert bench.core.get("clocks") == bench.clocks - start
    assert 5*MAX_WIDTH < bench.core.get("first_row_clocks") < bench.core.get("clocks")


def test_a_faster_clock_is_a_faster_frame():
    """The matcher's clock sets the pace if memory keeps up: twice the frequency nearly halves the clocks."""
    bench  = Bench("native-64 crossed", byte_generator(25))
    clocks = []
    for pace in (1.0, 2.0):
        bench.paces, bench.pace = [(pace, pace)], pace
        bench.check_frame(MAX_WIDTH, 60)
        clocks.append(bench.core.get("clocks"))
    assert clocks[0] < 1.3*MAX_WIDTH*60
    assert clocks[1] < 0.55*clocks[0]
    bench.core.close()


def test_abort_and_restart(bench):
    """A frame aborted at any clock ends soon, and the next one is correct."""
    for number in range(25):
        bench.memory.speed = bench.rng.choice([1.0, 0.5, 0.15])
        bench.begin(33, 11)
        events = [event for _ in range(bench.rng.randrange(1000)) for event in bench.clock()]
        if not events:
            events = bench.pulse("abort")
        if not events:
            events = bench.end(2000)
        if events == ["failed"]:
            assert bench.core.get("error_code") == ERROR_ABORTED
        else:
            assert events == ["done"]
        bench.check_frame(*SIZES[number % len(SIZES)])


def test_abort_at_once(bench):
    """An abort is effective from the first clock of a frame, before any request to memory."""
    for wait in range(10):
        bench.begin(33, 11)
        events = [event for _ in range(wait) for event in bench.clock()]
        assert (events + bench.pulse("abort") or bench.end(500)) == ["failed"]
        assert bench.core.get("error_code") == ERROR_ABORTED
        bench.check_frame(33, 11)


def test_abort_while_idle(bench):
    """An abort without a frame does nothing."""
    assert bench.pulse("abort") == []
    assert not any(bench.clock() for _ in range(50))
    bench.check_frame(30, 8)


def test_start_while_busy(bench):
    """A start during a frame is ignored."""
    expected, places = bench.begin(30, 8)
    before = bytes(bench.memory.bytes)
    for _ in range(60):
        assert bench.pulse("start") == []
    assert bench.end() == ["done"]
    bench.check_result(expected, places, before)
    assert not any(bench.clock() for _ in range(200))


def test_streamed(bench):
    """Streamed frames alternate with frames from memory, at any speed of stream and memory."""
    for number, size in enumerate(SIZES[1:4]):
        bench.memory.speed = bench.rng.choice([1.0, 0.5, 0.15])
        bench.check_streamed(*size, chance=bench.rng.choice([1.0, 0.7, 0.2]))
        if number % 2:
            bench.check_frame(*size)


def test_abort_of_streamed_frames(bench):
    """A streamed frame aborted at any clock ends soon, with pairs on offer or not, and the next one is correct."""
    for number in range(6):
        pair, *_ = bench.begin_streamed(33, 11)
        left     = pair[0].ravel().tolist()
        events   = []
        for place in range(bench.rng.randrange(len(left))):
            bench.core.set(pairs_valid=1, pairs_left=left[place], pairs_right=0, pairs_first=int(place == 0))
            events += bench.clock()
        bench.core.set(pairs_valid=number % 2)
        events += bench.pulse("abort") or bench.end(2000)
        assert events == ["failed"] and bench.core.get("error_code") == ERROR_ABORTED
        assert not bench.core.get("pairs_ready")
        bench.core.set(pairs_valid=0)
        (bench.check_streamed if number % 3 else bench.check_frame)(*SIZES[number % len(SIZES)])


def test_a_streamed_frame_after_one_that_was_broken_off(bench):
    """Nothing of a frame that was aborted, or hit a bus error, at any clock comes up in the next one."""
    for number in range(24 if bench.crossed else 6):
        bench.memory.speed = bench.rng.choice([1.0, 0.5, 0.15])
        pair, *_ = bench.begin_streamed(33, 11)
        clocks   = bench.rng.choice([number, bench.rng.randrange(60), bench.rng.randrange(600)])
        ended    = break_off(bench, pair, clocks, bench.abort if number % 3 or not bench.errs else bench.fail)
        bench.memory.fail_after = None
        assert ended in (["failed"], ["done"])
        assert not bench.core.get("map_valid")
        bench.check_streamed(*SIZES[number % 4], chance=bench.rng.choice([1.0, 0.4]))


def test_pairs_of_the_next_streamed_frame_wait(bench):
    """Pairs offered after a frame's last one are the next frame's, whenever that begins."""
    frames = [bench.begin_streamed(24, 9)]
    for number in range(4):
        bench.memory.speed = bench.rng.choice([1.0, 0.3])
        pair, expected, places = frames[-1]
        left, right = (image.ravel().tolist() for image in pair)
        place = 0
        for _ in range(60000):
            mine = place < len(left)
            bench.core.set(pairs_valid=1, pairs_left=left[place] if mine else 77,
                           pairs_right=right[place] if mine else 9, pairs_first=int(place in (0, len(left))),
                           pairs_last=int(place == len(left) - 1))
            if bench.core.get("pairs_ready"):
                assert mine, "a pair of the next frame"
                place += 1
            if events := bench.clock():
                break
        assert events == ["done"] and not bench.core.get("pairs_ready")
        assert np.array_equal(bench.map_at(places[2], expected.shape), expected)
        bench.core.set(pairs_valid=0)
        frames.append(bench.begin_streamed(20 + number, 6))


def test_pairs_wait_while_no_streamed_frame_is_under_way(bench):
    """Pairs are neither accepted between frames nor by a frame from memory."""
    bench.core.set(pairs_valid=1)
    for _ in range(20):
        assert not bench.core.get("pairs_ready")
        bench.clock()
    bench.check_frame(30, 8)
    assert not bench.core.get("pairs_ready")


def test_settings_of_the_next_frame(bench):
    """Registers written during a frame apply to the next frame, never to the current one."""
    for number in range(12):
        expected, places = bench.begin(33, 11, 7)
        before = bytes(bench.memory.bytes)
        events = [event for _ in range(bench.rng.randrange(300)) for event in bench.clock()]
        width = 20 + number
        bench.core.set(left_base=0, right_base=0, disparity_base=0, **registers(width, 6, bench.draw(width, 5)))
        assert (events or bench.end()) == ["done"]
        bench.check_result(expected, places, before)


PLAIN = MatcherSettings(DISPARITIES, 5, disp12_max_diff=1)


def check_refused(bench, changes):
    """Check that a frame is refused before any access to memory, and that the next one is correct."""
    bench.begin(30, 8, changes=changes, settings=PLAIN)
    assert bench.end(100) == ["failed"]
    assert bench.core.get("error_code") == ERROR_CONFIG
    assert not bench.memory.reads and not bench.memory.writes
    bench.check_frame(30, 8)


#: Ranges of the registers for a frame of 30 x 8 pixels, as its width and height narrow them; then those of its size.
#: The check's register has no illegal value: 255 is off.
FRAME_RANGES = setting_ranges(disparities=DISPARITIES, block_size=7, min_disparity=30 - DISPARITIES - 5 + 1)
SIZE_RANGES  = {"width": Range(DISPARITIES + 5 - 1, MAX_WIDTH), "height": Range(5, MAX_HEIGHT)}

ILLEGAL  = [{name: value} for name, one in SIZE_RANGES.items() for value in one.beyond(0, 0xffff)]
ILLEGAL += [{one.name: value} for one in TABLE if not one.option and one.register_off is None
            for value in FRAME_RANGES[one.name].beyond(0, 2**one.bits - 1)]
ILLEGAL += [{"disparities": 8}, {"left_base": 2}, {"right_base": 129}, {"disparity_base": 1}, {"disparity_base": 131}]


@pytest.mark.parametrize("changes", ILLEGAL, ids=str)
def test_bad_settings(changes):
    """Bad settings are refused before any access to memory, and the next frame is correct."""
    bench = Bench("wishbone-32", byte_generator(21, str(changes)))
    check_refused(bench, changes)
    bench.core.close()


@pytest.mark.parametrize("kind", ["wishbone-32", "wishbone-32 crossed"])
def test_another_height(kind):
    """A largest height that no register reports is refused when the peripheral is built."""
    parameters = MatcherParameters(MAX_WIDTH, 100, DISPARITIES, MAX_BLOCK)
    with pytest.raises(ValueError, match="max_height of the peripheral must be 4095, not 100"):
        if kind in CROSSED:
            StereoPeripheralCrossing(*CROSSED[kind](), parameters, clock_domain="matcher")
        else:
            StereoPeripheral(*PORTS[kind](), parameters)


@pytest.mark.parametrize("name", FRAME_RANGES)
def test_limits_of_settings(name):
    """Values at every limit of a setting are accepted, and give the model's map."""
    bench = Bench("wishbone-32", byte_generator(23, name))
    for value in FRAME_RANGES[name].limits:
        settings         = dataclasses.replace(PLAIN, **{name: from_number(name, value)})
        expected, places = bench.begin(30, 8, settings=settings)
        assert bench.end() == ["done"], settings
        assert np.array_equal(bench.map_at(places[2], expected.shape), expected), settings
    bench.core.close()


def test_a_smaller_cap():
    """A cap above the one that is built is refused, unless the prefilter is off; that one and less are accepted."""
    bench = Bench("wishbone-32", byte_generator(23), cap=36)
    for cap, xsobel, event in [(36, 1, "done"), (37, 1, "failed"), (35, 1, "done"), (63, 1, "failed"), (63, 0, "done")]:
        bench.begin(30, 8, changes={"prefilter_cap": cap, "xsobel": xsobel}, settings=PLAIN)
        assert bench.end() == [event], (cap, xsobel)
    bench.core.close()


def test_an_unused_cap():
    """Without prefilter its cap may have any value, even an illegal one."""
    bench = Bench("wishbone-32", byte_generator(23))
    bench.begin(30, 8, changes={"prefilter_cap": 0, "xsobel": 0}, settings=PLAIN)
    assert bench.end() == ["done"]
    bench.core.close()


BARE = {"xsobel": 0, "texture_threshold": 0, "uniqueness_ratio": 0, "disp12_max_diff": NO_CHECK, "subpixel": 0}


@pytest.mark.parametrize("features, base, missing", [
    (("raw",), BARE, [{"xsobel": 1}, {"uniqueness_ratio": 1}, {"subpixel": 1}, {"disp12_max_diff": 0},
                      {"min_disparity": 1}, {"median": 1}]),
    (("xsobel",), BARE | {"xsobel": 1}, [{"xsobel": 0}, {"texture_threshold": 1}]),
], ids=["raw", "xsobel"])
@pytest.mark.long
def test_stages_that_are_not_built(features, base, missing):
    """A frame that needs a missing stage is refused; without that stage it is matched."""
    bench = Bench("wishbone-32", byte_generator(24, *features), features)
    for changes in missing:
        bench.begin(30, 8, changes=base | changes, settings=PLAIN)
        assert bench.end(100) == ["failed"]
        assert bench.core.get("error_code") == ERROR_CONFIG
    bare = MatcherSettings(DISPARITIES, 5, 0, "xsobel" if base["xsobel"] else "none", texture_threshold=0,
                          uniqueness_ratio=0, subpixel=False)
    expected, places = bench.begin(30, 8, settings=bare)
    before = bytes(bench.memory.bytes)
    assert bench.end() == ["done"]
    bench.check_result(expected, places, before)
    bench.core.close()


@pytest.mark.parametrize("kind", ["wishbone-32", "wishbone-128", "wishbone-32 crossed"])
def test_bus_error(kind):
    """An error on any access ends the frame with its code, and the next one is correct."""
    bench = Bench(kind, byte_generator(22, kind))
    for _ in range(20):
        bench.begin(33, 11)
        bench.memory.fail_after = bench.rng.randrange(60)
        assert bench.end(4000) == ["failed"]
        assert bench.core.get("error_code") == ERROR_BUS
        bench.memory.fail_after = None
        bench.check_frame(33, 11)
    bench.core.close()


def test_reset_in_mid_frame(bench):
    """After a reset of the whole core at any clock the next frame is correct."""
    for number in range(15):
        bench.memory.speed = bench.rng.choice([1.0, 0.4])
        bench.begin(33, 11)
        for _ in range(bench.rng.randrange(900)):
            bench.clock()
        bench.reset()
        assert not bench.core.get("busy")
        bench.check_frame(*SIZES[number % len(SIZES)])
