#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Filters of disparity maps: each against a plain reference, pixel by pixel, on drawn maps with holes."""

from __future__ import annotations

import dataclasses
import pickle
import time
from fractions import Fraction

import numpy as np
import pytest

from litestereo.host_tools.core.decimation import DecimationFilter
from litestereo.host_tools.core.disparity_map import DisparityMap
from litestereo.host_tools.core.errors import GeometryError, ImageError, SettingsError
from litestereo.host_tools.core.filters import FILTERS, FilterChain, parse_filter
from litestereo.host_tools.core.geometry import StereoGeometry
from litestereo.host_tools.core.hole_filling import HoleFillingFilter
from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.host_tools.core.spatial import FILLED_PX, SpatialFilter
from litestereo.host_tools.core.speckle import SpeckleMapFilter
from litestereo.host_tools.core.temporal import HISTORY_FRAMES, TemporalFilter
from litestereo.host_tools.core.threshold import ThresholdFilter
from support.limits import BLOCK
from support.pairs import generator
from support.settings import SettingDraws

#: Kinds of drawn maps.
KINDS = ("noise", "surfaces", "few", "full", "none")


def drawn(rng, kind="noise", height=13, width=17, settings=None):
    """Draw a map: noise, or surfaces with noise of some sixteenths; with many holes, few pixels, none or only holes."""
    settings = settings or SettingDraws(rng).settings()
    least    = 16*settings.min_disparity
    most     = 16*(settings.min_disparity + settings.disparities - 1)
    values   = rng.integers(least, most + 1, (height, width))
    if kind in ("surfaces", "full"):
        steps  = rng.integers(0, 3, (height, width)).cumsum(axis=1)//6
        values = np.clip(least + 200*(steps % 4) + rng.integers(-30, 31, (height, width)), least, most)
    share  = {"noise": 0.3, "surfaces": 0.2, "few": 0.93, "full": 0.0, "none": 1.0}[kind]
    values = np.where(rng.random((height, width)) < share, settings.invalid, values)
    return DisparityMap(values.astype(np.int16), settings)


def grid(map_):
    """Return the disparities as lists of exact numbers, None for a hole."""
    return [[Fraction(int(value)) if value > map_.settings.invalid else None for value in row]
            for row in map_.disparity]


def singles(map_):
    """Return the disparities as lists of numbers of single precision, which spatial and temporal filter count in."""
    return [[None if value is None else np.float32(int(value)) for value in row] for row in grid(map_)]


def rounded(values):
    """Return numbers in lists, rounded to whole ones."""
    return [[None if value is None else round(value) for value in row] for row in values]


def maps(salt, count=3, **more):
    """Return drawn maps of all kinds, three of each with all limits of the settings."""
    rng   = generator(1200, salt)
    draws = SettingDraws(rng)
    found = [drawn(rng, kind, settings=draws.settings(), **more) for kind in KINDS for _ in range(count)]
    if len(found) >= BLOCK:
        draws.check()
    return found


# Decimation ---------------------------------------------------------------------------------------

def decimated_by_hand(map_, factor):
    """Return the decimated map: of each area the median or the mean of what is known there."""
    values = grid(map_)
    height, width = len(values)//factor, len(values[0])//factor
    result = []
    for row in range(height):
        line = []
        for column in range(width):
            known = sorted(values[factor*row + y][factor*column + x] for y in range(factor) for x in range(factor)
                           if values[factor*row + y][factor*column + x] is not None)
            if not known:
                line.append(None)
            elif factor <= 3:
                line.append(known[len(known)//2]/factor)
            else:
                line.append(sum(known)/len(known)/factor)
        result.append(line)
    return result


@pytest.mark.parametrize("factor", range(2, 9))
def test_decimation(factor):
    for map_ in maps(factor, height=19, width=34):
        before = map_.disparity.copy()
        found  = DecimationFilter(factor).process(map_)
        assert grid(found) == rounded(decimated_by_hand(map_, factor))
        assert found.factor == factor and found.disparity.dtype == np.int16
        assert np.array_equal(map_.disparity, before)


def test_a_decimated_map_of_each_range_has_its_mark_below_all_disparities():
    """The ends of the range remain disparities, also where they are below the mark of the map before."""
    for least in (0, 1, 2, 7, 30, 255):
        for disparities in (16, 64, 256):
            settings = MatcherSettings(disparities, 9, min_disparity=least)
            for factor in range(2, 9):
                ends  = np.array([[16*least]*factor + [16*(least + disparities - 1)]*factor]*factor, np.int16)
                found = DecimationFilter(factor).process(DisparityMap(ends, settings))
                assert found.valid.all()
                assert found.disparity.tolist()[0] == [round(Fraction(16*least, factor)),
                                                       round(Fraction(16*(least + disparities - 1), factor))]
                new = found.settings
                assert new.min_disparity <= least/factor
                assert new.min_disparity + new.disparities - 1 >= (least + disparities - 1)/factor


def test_a_decimated_map_has_the_same_points():
    """Depth and points of a plane, at the centres of the larger pixels, are those of the plane itself."""
    geometry = StereoGeometry(48, 36, 90.0, 0.1, 22.3, 17.9, 20.8, 95.0)
    settings = MatcherSettings(64, 9)
    plane    = DisparityMap(np.full((36, 48), 16*24, np.int16), settings, geometry)
    for factor in (2, 3, 4, 6, 8):
        found = DecimationFilter(factor).process(plane)
        assert (found.geometry.width, found.geometry.height) == (48//factor, 36//factor)
        points = found.geometry.points_m(found.pixels)
        known  = geometry.points_m(plane.pixels)
        for row, column in ((0, 0), (36//factor - 1, 48//factor - 1)):
            area = known[factor*row:factor*(row + 1), factor*column:factor*(column + 1)].reshape(-1, 3)
            # Disparities are whole sixteenths after the division too, or nearly.
            assert points[row, column] == pytest.approx(area.mean(axis=0), rel=0.01)
        assert found.depth_m() == pytest.approx(plane.depth_m()[0, 0], rel=0.01)
    twice = DecimationFilter(2).process(DecimationFilter(3).process(plane))
    once  = DecimationFilter(6).process(plane)
    assert twice.factor == 6
    assert dataclasses.astuple(twice.geometry) == pytest.approx(dataclasses.astuple(once.geometry))


def test_a_decimated_map_in_the_images():
    """Each pixel fills its area; rows and columns that are cut off have no disparity."""
    map_  = DisparityMap(np.array([[32, 64, -16], [0, 48, 16]], np.int16), MatcherSettings(16, 9), factor=2)
    found = map_.in_images((5, 7))
    assert found.shape == (5, 7) and np.isnan(found[4]).all() and np.isnan(found[:, 6]).all()
    expected = np.array([[4, 4, 8, 8, np.nan, np.nan]]*2 + [[0, 0, 6, 6, 2, 2]]*2)
    assert np.array_equal(found[:4, :6], expected, equal_nan=True)
    image = np.arange(35, dtype=np.uint8).reshape(5, 7)
    assert map_.picture(image).tolist() == [[4, 6, 8], [18, 20, 22]]
    assert dataclasses.replace(map_, factor=1).picture(image) is image


def test_a_map_that_is_too_small():
    map_ = drawn(generator(1201), height=3, width=40)
    assert DecimationFilter(3).process(map_).disparity.shape == (1, 13)
    with pytest.raises(ImageError, match="a map of 40x3 pixels cannot be decimated by 4"):
        DecimationFilter(4).process(map_)


# Spatial ------------------------------------------------------------------------------------------

def smooth_line(line, alpha, delta):
    """Return a line that is smoothed forward."""
    result = []
    for place, value in enumerate(line):
        before = line[place - 1] if place else None
        if value is None or before is None or abs(value - before) >= delta:
            result.append(value)
        else:
            result.append((1 - (1 - alpha))*value + (1 - alpha)*result[-1])
    return result


def both_ways(line, alpha, delta):
    return smooth_line(smooth_line(line, alpha, delta)[::-1], alpha, delta)[::-1]


def fill_line(line, most):
    """Return a line whose holes have the value before them, at most so many pixels of each hole."""
    result, count = [], 0
    for value in line:
        count = 0 if value is not None else count + 1
        last  = result[-1] if result else None
        result.append(value if value is not None else last if most is None or count <= most else None)
    return result


def smooth_by_hand(map_, filter_):
    values = singles(map_)
    alpha, delta = np.float32(filter_.filter_smooth_alpha), filter_.filter_smooth_delta
    for _ in range(filter_.filter_magnitude):
        values = [both_ways(row, alpha, delta) for row in values]
        columns = [both_ways(list(column), alpha, delta) for column in zip(*values, strict=True)]
        values  = [list(row) for row in zip(*columns, strict=True)]
    most = FILLED_PX[filter_.holes_fill]
    if most != 0:
        values = [fill_line(fill_line(row, most)[::-1], most)[::-1] for row in values]
    return values


@pytest.mark.parametrize("filter_", [
    SpatialFilter(), SpatialFilter(1, 0.25, 50), SpatialFilter(5, 0.25, 1), SpatialFilter(2, 1.0, 50),
    SpatialFilter(3, 0.75, 33), *(SpatialFilter(1, 0.5, 20, fill) for fill in range(6)),
], ids=lambda filter_: "-".join(f"{value:g}" for value in filter_.values.values()))
def test_spatial(filter_):
    for map_ in maps(20):
        assert grid(filter_.process(map_)) == rounded(smooth_by_hand(map_, filter_))


@pytest.mark.parametrize(("step", "smooth"), [(19, True), (20, False), (21, False)])
def test_a_step_of_delta_is_an_edge(step, smooth):
    for sign in (1, -1):
        line  = np.array([[400, 400, 400 + sign*step, 400 + sign*step]], np.int16)
        found = SpatialFilter(1, 0.5, 20).process(DisparityMap(line, MatcherSettings(64, 9)))
        assert np.array_equal(found.disparity, line) != smooth


@pytest.mark.parametrize("number", range(6))
def test_how_many_pixels_of_a_hole_are_filled(number):
    """Holes of the most pixels and of one more, from both ends; and at the borders."""
    most = FILLED_PX[number]
    for length in (1, 2, 3, 4, 5, 8, 9, 16, 17, 32, 33):
        line  = np.full((1, length + 2), -16, np.int16)
        line[0, 0], line[0, -1] = 100, 900
        found = SpatialFilter(1, 1.0, 1, number).process(DisparityMap(line, MatcherSettings(64, 9))).disparity[0, 1:-1]
        from_left  = length if most is None else min(most, length)
        from_right = 0 if most is None else min(most, length - from_left)
        assert found.tolist() == [100]*from_left + [-16]*(length - from_left - from_right) + [900]*from_right


# Temporal -----------------------------------------------------------------------------------------

class PixelByHand:
    """One pixel over time."""

    def __init__(self, filter_):
        self.filter = filter_
        self.last   = None
        self.agreed = []  # Of each frame, the newest last.

    def step(self, value):
        alpha, delta = np.float32(self.filter.filter_smooth_alpha), self.filter.filter_smooth_delta
        if value is None:
            filled = self.last if self.last is not None and self.persists() else None
            self.agreed.append(False)
            return filled
        value = np.float32(value)  # Of a Python number, numpy 1 makes float64.
        if self.last is None or abs(value - self.last) >= delta:
            self.last, self.agreed = value, []
        else:
            self.last = alpha*value + (np.float32(1) - alpha)*self.last
        self.agreed.append(True)
        return self.last

    def persists(self):
        def of_last(frames):
            return sum(self.agreed[-frames:])

        return {0: False, 1: of_last(8) == 8, 2: of_last(3) >= 2, 3: of_last(4) >= 2, 4: of_last(8) >= 2,
                5: of_last(2) >= 1, 6: of_last(5) >= 1, 7: of_last(8) >= 1, 8: True}[self.filter.holes_fill]


def sequence(salt, count=14, share=0.35, height=6, width=9):
    """Draw maps of one scene: disparities with noise around the delta, holes, and now and then another surface."""
    rng      = generator(1202, salt)
    settings = MatcherSettings(64, 9)
    scene    = rng.integers(100, 900, (height, width))
    for _ in range(count):
        scene  = np.where(rng.random(scene.shape) < 0.1, rng.integers(100, 900, scene.shape), scene)
        values = scene + rng.integers(-14, 15, scene.shape)
        values = np.where(rng.random(scene.shape) < share, settings.invalid, values)
        yield DisparityMap(values.astype(np.int16), settings)


@pytest.mark.parametrize("persistence", range(9))
@pytest.mark.parametrize(("alpha", "delta"), [(0.4, 20), (0.0, 20), (1.0, 100), (0.7, 1)])
def test_temporal(persistence, alpha, delta):
    filter_ = TemporalFilter(alpha, delta, persistence)
    pixels  = None
    for number, map_ in enumerate(sequence(persistence)):
        values = singles(map_)
        pixels = pixels or [[PixelByHand(filter_) for _ in row] for row in values]
        found  = filter_.process(map_)
        assert grid(found) == rounded([[pixel.step(value) for pixel, value in zip(*rows, strict=True)]
                                       for rows in zip(pixels, values, strict=True)])
        if number == 0:
            assert np.array_equal(found.disparity, map_.disparity)


@pytest.mark.parametrize("persistence", range(9))
def test_every_history(persistence):
    """All 256 histories of eight frames at once, a pixel each; then holes until long after the last disparity."""
    settings = MatcherSettings(16, 9)
    filter_  = TemporalFilter(1.0, 20, persistence)
    pixels   = [PixelByHand(filter_) for _ in range(256)]
    frames   = [[100 if history >> frame & 1 else None for history in range(256)] for frame in range(HISTORY_FRAMES)]
    for frame in [*frames, *[[None]*256]*10]:
        values = np.array([[settings.invalid if value is None else value for value in frame]], np.int16)
        found  = filter_.process(DisparityMap(values, settings))
        assert grid(found)[0] == [pixel.step(value) for pixel, value in zip(pixels, frame, strict=True)]


def test_the_memory_of_a_temporal_filter_is_bounded_and_of_one_kind_of_map():
    """It is 5 bytes per pixel after any number of maps; another size, range or factor, and a reset, begin anew."""
    filter_ = TemporalFilter(0.0, 100, 8)
    one, other = (DisparityMap(np.full((4, 5), value, np.int16), MatcherSettings(64, 9)) for value in (100, 150))
    for _ in range(20):
        filter_.process(one)
    memory = filter_._kept.memory
    assert memory.last.nbytes + memory.history.nbytes == 5*20
    assert filter_.process(other).disparity.tolist() == one.disparity.tolist()
    for change in (lambda map_: dataclasses.replace(map_, disparity=map_.disparity[:3]),
                   lambda map_: dataclasses.replace(map_, settings=MatcherSettings(48, 9)),
                   lambda map_: dataclasses.replace(map_, factor=2)):
        filter_.process(one)
        changed = change(other)
        assert filter_.process(changed).disparity.tolist() == changed.disparity.tolist()
    filter_.process(one)
    filter_.reset()
    assert filter_.process(other).disparity.tolist() == other.disparity.tolist()


def test_a_slow_change_is_not_lost_by_rounding():
    """Each step is a sixteenth: a mean in whole sixteenths would stay where it is."""
    filter_  = TemporalFilter(0.1, 20, 0)
    settings = MatcherSettings(64, 9)
    for _ in range(100):
        filter_.process(DisparityMap(np.full((1, 1), 100, np.int16), settings))
    for _ in range(100):
        found = filter_.process(DisparityMap(np.full((1, 1), 103, np.int16), settings))
    assert found.disparity.item() == 103


# Hole filling -------------------------------------------------------------------------------------

def filled_by_hand(map_, mode):
    values = grid(map_)
    height, width = len(values), len(values[0])
    for row in range(height):
        for column in range(width):
            if values[row][column] is not None:
                continue
            places = [(row, column - 1)]
            if mode != 0:
                places += [(row - 1, column), (row - 1, column - 1), (row + 1, column - 1), (row + 1, column)]
            around = [values[y][x] for y, x in places
                      if 0 <= y < height and 0 <= x < width and values[y][x] is not None]
            if around:
                values[row][column] = {0: max, 1: min, 2: max}[mode](around)
    return values


@pytest.mark.parametrize("mode", range(3))
@pytest.mark.parametrize("size", [(13, 17), (1, 9), (9, 1), (2, 2)])
def test_hole_filling(mode, size):
    for map_ in maps(30 + mode, height=size[0], width=size[1]):
        assert grid(HoleFillingFilter(mode).process(map_)) == filled_by_hand(map_, mode)


# Threshold ----------------------------------------------------------------------------------------

def test_threshold():
    """By exact numbers, at limits that drawn disparities have exactly."""
    rng = generator(1203)
    for least, most in ((0.0, 16.0), (0.125, 0.5), (0.1, 4.0), (0.5, 0.5), (16.0, 16.0), (0.0, 0.0)):
        for zero in (0.0, 12.5, -3.0):
            geometry = StereoGeometry(17, 13, 128.0, 0.125, 8.0 + zero, 6.0, 8.0)
            map_     = dataclasses.replace(drawn(rng), geometry=geometry)
            found    = ThresholdFilter(least, most).process(map_)
            limits   = Fraction(least), Fraction(most)
            for row, (line, kept) in enumerate(zip(grid(map_), grid(found), strict=True)):
                for column, value in enumerate(line):
                    above = None if value is None else value/16 - Fraction(zero)
                    right = above is not None and above > 0 and limits[0] <= 16/above <= limits[1]
                    assert kept[column] == (value if right else None), (row, column)


def test_threshold_keeps_both_limits_and_needs_cameras():
    geometry = StereoGeometry(5, 1, 64.0, 0.25, 2.0, 0.0, 2.0)
    map_     = DisparityMap(np.array([[65, 64, 63, 32, 31]], np.int16), MatcherSettings(16, 9), geometry)
    assert ThresholdFilter(4.0, 8.0).process(map_).disparity.tolist() == [[-16, 64, 63, 32, -16]]
    with pytest.raises(GeometryError, match="needs the cameras"):
        ThresholdFilter().process(dataclasses.replace(map_, geometry=None))
    with pytest.raises(SettingsError, match="must be at most its max_distance, 1,"):
        ThresholdFilter(1.5, 1.0)


# Speckle ------------------------------------------------------------------------------------------

def islands_by_hand(map_, window, step):
    values = grid(map_)
    height, width = len(values), len(values[0])
    result, seen  = [list(row) for row in values], set()
    for start in ((row, column) for row in range(height) for column in range(width)):
        if start in seen or values[start[0]][start[1]] is None:
            continue
        island, queue = {start}, [start]
        while queue:
            row, column = queue.pop()
            for y, x in ((row - 1, column), (row + 1, column), (row, column - 1), (row, column + 1)):
                if (0 <= y < height and 0 <= x < width and (y, x) not in island and values[y][x] is not None
                        and abs(values[y][x] - values[row][column]) <= step):
                    island.add((y, x))
                    queue.append((y, x))
        seen |= island
        if len(island) <= window:
            for y, x in island:
                result[y][x] = None
    return result


@pytest.mark.parametrize(("window", "step"), [(1, 16), (5, 0), (5, 40), (20, 100), (221, 32767), (220, 32767)])
def test_speckle(window, step):
    for map_ in maps(40):
        assert grid(SpeckleMapFilter(window, step).process(map_)) == islands_by_hand(map_, window, step)


# All ----------------------------------------------------------------------------------------------

def test_the_parameters_are_librealsense_s():
    """Its names, ranges and defaults, by doc/post-processing-filters.md, and src/proc/threshold.cpp."""
    known = {name: {one.name: (one.default, one.least, one.most) for one in kind.parameters().values()}
             for name, kind in FILTERS.items()}
    assert known == {
        "decimation":   {"filter_magnitude": (2, 2, 8)},
        "spatial":      {"filter_magnitude": (2, 1, 5), "filter_smooth_alpha": (0.5, 0.25, 1),
                         "filter_smooth_delta": (20, 1, 50), "holes_fill": (0, 0, 5)},
        "temporal":     {"filter_smooth_alpha": (0.4, 0, 1), "filter_smooth_delta": (20, 1, 100),
                         "holes_fill": (3, 0, 8)},
        "hole_filling": {"holes_fill": (1, 0, 2)},
        "threshold":    {"min_distance": (0.1, 0, 16), "max_distance": (4, 0, 16)},
        "speckle":      {"window": (100, 1, 1 << 30), "range": (16, 0, 32767)},
    }


@pytest.mark.parametrize("name", FILTERS)
def test_limits_of_each_parameter(name):
    """Both ends are taken, in Python and as text, and the first values beyond them are refused; so are other types."""
    for one in FILTERS[name].parameters().values():
        others = {"min_distance": 0} if name == "threshold" and one.name == "max_distance" else (
            {"max_distance": 16} if name == "threshold" else {})
        for value in (one.least, one.most, one.default):
            assert getattr(FILTERS[name](**{**others, one.name: value}), one.name) == value
            rest = "".join(f",{key}={number}" for key, number in others.items())
            assert getattr(parse_filter(f"{name}:{one.name}={value}{rest}"), one.name) == value
        step = 1 if one.whole else 0.001
        for value in (one.least - step, one.most + step, float("nan"), float("inf"), "x", None, True,
                      *([1.5] if one.whole else [])):
            with pytest.raises(SettingsError) as refused:
                FILTERS[name](**{one.name: value})
            assert str(refused.value) == (f"{one.name} of the filter {name} must be {one.range_text}, not {value}")
        with pytest.raises(SettingsError, match=one.range_text):
            parse_filter(f"{name}:{one.name}=x")


@pytest.mark.parametrize(("text", "message"), [
    ("", "there is no filter '', there are decimation, spatial, temporal, hole_filling, threshold, speckle"),
    ("median", "there is no filter 'median', there are decimation, spatial"),
    ("spatial:alpha=1", "the filter spatial has no parameter 'alpha', it has filter_magnitude=2, "
                        "filter_smooth_alpha=0.5, filter_smooth_delta=20, holes_fill=0"),
    ("spatial:holes_fill", "holes_fill of the filter spatial has no value: holes_fill=value"),
    ("spatial:", None),
    ("spatial:,", "the filter spatial has no parameter ''"),
    ("decimation:filter_magnitude=3,filter_magnitude=3", "filter_magnitude of the filter decimation is given twice"),
    ("decimation:filter_magnitude=2.0", "must be a whole number from 2 to 8, not 2.0"),
    ("temporal:filter_smooth_alpha=1.01", "must be a number from 0 to 1, not 1.01"),
    ("threshold:min_distance=5", "at most its max_distance, 4, not 5"),
])
def test_texts_of_filters(text, message):
    if message is None:
        assert parse_filter(text) == SpatialFilter()
        return
    with pytest.raises(SettingsError) as refused:
        parse_filter(text)
    assert message in str(refused.value) and "\n" not in str(refused.value)


def test_a_chain():
    """It applies its filters in their order, starts anew after a reset, and can go to another process."""
    texts = ["speckle:window=1,range=2000", "decimation", "spatial:holes_fill=1", "temporal:holes_fill=8",
             "hole_filling"]
    chain = FilterChain.parse(texts)
    assert chain and not FilterChain()
    assert chain.needing_frames() == ["temporal"] and chain.needing_geometry() == []
    assert FilterChain.parse(["threshold"]).needing_geometry() == ["threshold"]
    assert chain.summary()[1:3] == [{"filter": "decimation", "filter_magnitude": 2},
                                    {"filter": "spatial", "filter_magnitude": 2, "filter_smooth_alpha": 0.5,
                                     "filter_smooth_delta": 20, "holes_fill": 1}]
    one, other = sequence(50, 2, height=12, width=18)
    expected = one
    for filter_ in map(parse_filter, texts):
        expected = filter_.process(expected)
    assert np.array_equal(chain.process(one).disparity, expected.disparity)
    again = pickle.loads(pickle.dumps(chain))
    assert again.summary() == chain.summary()
    fresh = FilterChain.parse(texts).process(other).disparity
    assert not np.array_equal(chain.process(other).disparity, fresh)
    chain.reset()
    assert np.array_equal(chain.process(other).disparity, fresh)


def test_no_filter_changes_its_input():
    geometry = StereoGeometry(17, 13, 128.0, 0.125, 8.0, 6.0, 8.0)
    for name in FILTERS:
        for map_ in maps(60, 1):
            before = map_.disparity.copy()
            map_.disparity.setflags(write=False)
            found = parse_filter(name).process(dataclasses.replace(map_, geometry=geometry))
            assert np.array_equal(map_.disparity, before) and found.disparity.dtype == np.int16
            assert (found.disparity >= found.settings.invalid).all()


def test_no_filter_loops_over_pixels():
    """A loop over pixels would take seconds: of 640 x 480 each filter takes well under one, on any computer."""
    rng      = generator(1204)
    settings = MatcherSettings(64, 9)
    geometry = StereoGeometry(640, 480, 600.0, 0.1, 320.0, 240.0, 320.0)
    map_     = dataclasses.replace(drawn(rng, "surfaces", 480, 640, settings), geometry=geometry)
    for name in FILTERS:
        chain   = FilterChain.parse([name])
        seconds = []
        for _ in range(3):
            begin_s = time.process_time()
            chain.process(map_)
            seconds.append(time.process_time() - begin_s)
        assert min(seconds) < 1, name
