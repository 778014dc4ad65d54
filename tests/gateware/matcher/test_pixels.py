#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The cores that pixels pass: emitted Verilog against NumPy, with gaps, a reset in mid-frame, and a next frame."""

from __future__ import annotations

import inspect

import numpy as np
import pytest

from litestereo.gateware.engines.sad.absolute_difference import AbsoluteDifference
from litestereo.gateware.matcher import raster
from litestereo.gateware.matcher.alignment import Alignment
from litestereo.gateware.matcher.line_buffer import LineBuffer
from litestereo.gateware.matcher.prefilter import Prefilter
from litestereo.gateware.matcher.raster import Raster
from litestereo.sim.models.stages import prefilter_xsobel
from support.core_bench import SMALL, CoreBench
from support.lanes import steps
from support.limits import Draws, Range, setting_ranges
from support.pairs import generator

DISPARITIES = SMALL.disparities

#: Values of a pixel that are drawn as often as any other one.
PIXELS = [*Range(0, 255).limits, *range(256)]

#: Width, height, block size, smallest disparity, columns outside the valid region; the smallest sizes included, the
#: smallest and the largest width, each with the largest smallest disparity that has room in it.
FRAMES = [(20, 5, 5, 0, 0), (24, 9, 9, 0, 4), (44, 13, 5, 3, 2), (37, 12, 7, 0, 3), (44, 10, 9, 10, 0),
          (21, 6, 5, 1, 0), (43, 6, 5, 23, 2), (44, 5, 5, 24, 0), (44, 9, 9, 20, 4)]


def place_pixels(place, images):
    """Return values for the steps with a pixel; other steps get values that must not matter."""
    fields = {}
    for name, image in images.items():
        values = np.full(len(place["take"]), 201)
        values[place["take"] == 1] = image.ravel()
        fields[name] = values
    return fields


@pytest.mark.parametrize("valid", [1.0, 0.4])
def test_raster(valid):
    """Every pixel passes once, each step has its position, and no pixel is accepted outside a frame."""
    rng      = generator(6)
    settings = ["width", "height", "disparities", "min_disparity", "block_size", "outer", "begin", "credit"]
    bench    = CoreBench(Raster(SMALL), settings, pipeline=False)
    for width, height, block_size, min_disparity, outer in FRAMES:
        place  = steps(width, height, DISPARITIES, block_size, min_disparity, outer)
        pixels = {name: rng.integers(0, 256, width*height + 5) for name in ("left", "right")}
        bench.begin(width=width, height=height, disparities=DISPARITIES, min_disparity=min_disparity,
                    block_size=block_size, outer=outer, credit=1)
        out = bench.run(pixels, len(place["take"]), valid)
        assert bench.taken == width*height
        for name, values in place.items():
            chosen = place["cost"] == 1 if name == "cost_column" else slice(None)
            assert np.array_equal(out[name][chosen], values[chosen]), name
        for name in ("left", "right"):
            assert np.array_equal(out[name][place["take"] == 1], pixels[name][:width*height])
        bench.core.reset()


def test_drawn_frame():
    """The frame in the docstring of `Raster` has the positions of the steps, and so does its example."""
    place = steps(5, 4, 2, 3)
    step  = place["column"]
    row   = np.arange(len(step))//6

    def cell(number):
        pair  = f"{row[number]}{step[number]}" if place["take"][number] else "--"
        pixel = f"{row[number] - 1}{step[number] - 1}" if place["pixel"][number] else "--"
        return f"{number:2} {pair}/{pixel}"

    drawn = inspect.getsource(raster)
    for line in range(5):
        assert f"row {line}     " + "   ".join(cell(6*line + column) for column in range(6)) + "\n" in drawn
    assert np.array_equal(place["cost"], (step >= 2) & (row >= 1))
    assert np.flatnonzero(place["complete"])[0] == 22 and "in step 22." in drawn


def test_raster_heeds_credit():
    """Without credit there is no step."""
    settings = ["width", "height", "disparities", "block_size", "begin", "credit"]
    bench    = CoreBench(Raster(SMALL), settings, pipeline=False)
    bench.begin(width=20, height=5, disparities=16, block_size=5, credit=0)
    bench.run({"left": np.arange(100)}, 0)
    assert bench.taken == 0


@pytest.mark.parametrize("valid", [1.0, 0.4])
@pytest.mark.parametrize("cap", [*setting_ranges()["prefilter_cap"].ends, 31, 32])
def test_prefilter(cap, valid):
    """Odd and even heights and hard edges are exact, and so are the grey values where the filter is off."""
    rng   = generator(7, cap)
    bench = CoreBench(Prefilter(SMALL), ["xsobel", "cap"])
    for number, (width, height, block_size, min_disparity, outer) in enumerate(FRAMES):
        place  = steps(width, height, DISPARITIES, block_size, min_disparity, outer)
        images = {name: rng.choice(PIXELS, (height, width)).astype(np.uint8)
                  for name in ("left", "right")}
        images["left"][:, ::2] = 255*(number % 2)
        pixels = place_pixels(place, images)
        bench.interrupt(pixels | place, clock=int(rng.integers(2, width*height)))
        for xsobel in (1, 0):
            bench.set(xsobel=xsobel, cap=cap)
            out = bench.run(pixels | place, len(place["take"]), valid)
            for name, image in images.items():
                expected = prefilter_xsobel(image, cap) if xsobel else image
                assert np.array_equal(out[name][place["pixel"] == 1], expected.ravel()), (name, width, height, xsobel)
            for name, values in place.items():
                assert np.array_equal(out[name], values), name


@pytest.mark.parametrize("valid", [1.0, 0.4])
def test_line_buffer(valid):
    """The pair at the source is the one block_size rows above."""
    rng   = generator(1)
    bench = CoreBench(LineBuffer(SMALL), ["block_size"])
    for width, height, block_size, min_disparity, outer in FRAMES:
        place  = steps(width, height, DISPARITIES, block_size, min_disparity, outer)
        chosen = place["pixel"] == 1
        pixels = {name: rng.integers(0, 256, len(chosen)) for name in ("left", "right")}
        bench.set(block_size=block_size)
        bench.interrupt(pixels | place, clock=int(rng.integers(2, width*height)))
        out = bench.run(pixels | place, len(chosen), valid)
        for name in ("left", "right"):
            new = pixels[name][chosen]
            assert np.array_equal(out[name], pixels[name])
            old = out[f"{name}_old"][chosen][width*block_size:]
            assert np.array_equal(old, new[:len(old)])


@pytest.mark.parametrize("valid", [1.0, 0.4])
def test_alignment(valid):
    """The left image is delayed by the outer columns, the right one by the smallest disparity, or by both."""
    rng   = generator(8)
    bench = CoreBench(Alignment(SMALL), ["min_disparity", "outer"])
    names = ("left", "right", "left_old", "right_old")
    for width, height, block_size, min_disparity, outer in FRAMES:
        place  = steps(width, height, DISPARITIES, block_size, min_disparity, outer)
        pixels = {name: rng.integers(0, 256, len(place["take"])) for name in names}
        bench.set(min_disparity=min_disparity, outer=outer)
        bench.interrupt(pixels | place, clock=int(rng.integers(2, width*height)))
        out   = bench.run(pixels | place, len(place["take"]), valid)
        step  = np.arange(len(place["take"]))
        delay = {"left": np.full(len(step), outer), "right": min_disparity + place["late"]*outer}
        for name in names:
            source = step - delay[name.split("_")[0]]
            assert np.array_equal(out[name][source >= 0], pixels[name][source[source >= 0]]), name


@pytest.mark.parametrize("valid", [1.0, 0.4])
def test_absolute_difference(valid):
    """Lane d holds |left - right d columns back|, the lane after the last one the texture; the images are constant."""
    rng   = generator(2)
    count = DISPARITIES + 1
    bench = CoreBench(AbsoluteDifference(SMALL), ["cap"], lanes={"enter": count, "leave": count})
    draws = Draws(rng, {"prefilter_cap": setting_ranges()["prefilter_cap"]})
    for width, height, block_size, min_disparity, outer in FRAMES[:5] + FRAMES[:1]*8:
        place  = steps(width, height, DISPARITIES, block_size, min_disparity, outer)
        pixels = {name: rng.choice(PIXELS, len(place["take"]))
                  for name in ("left", "right", "left_old", "right_old")}
        cap    = draws("prefilter_cap")
        bench.set(cap=cap)
        bench.interrupt(pixels | place, clock=int(rng.integers(2, width*height)))
        costs = np.flatnonzero(place["cost"])
        out   = bench.run(pixels | place, len(costs), valid)
        for suffix, field in [("", "enter"), ("_old", "leave")]:
            left, shift, expected = 0, [0]*DISPARITIES, []
            for index in range(len(place["take"])):
                if place["move_left"][index]:
                    left = int(pixels["left" + suffix][index])
                if place["move_right"][index]:
                    shift = [int(pixels["right" + suffix][index]), *shift[:-1]]
                if place["cost"][index]:
                    expected.append([abs(left - right) for right in (*shift, cap)])
            magnitude, negative = out[field] % 2**SMALL.filtered_bits, out[field] >> SMALL.filtered_bits
            assert np.array_equal(magnitude + negative, expected), field
        assert np.array_equal(out["cost_column"], place["cost_column"][costs])
    draws.check()
