#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The assembled matcher's emitted Verilog against the reference model, on real and on awkward images."""

from __future__ import annotations

import numpy as np
import pytest

from litestereo.gateware.matcher import Matcher
from litestereo.sim.cosim import SETTINGS, CosimMatcher
from litestereo.sim.model import INVALID, match, minimum_size
from litestereo.sim.stream_core import StreamCore
from support.data import stereo_pair
from support.pairs import generator, textured_pair

MAX_WIDTH, DISPARITIES, MAX_BLOCK = 1024, 64, 21


@pytest.fixture(scope="module")
def matcher():
    """As `cosim:` builds it by default."""
    matcher = CosimMatcher(MAX_WIDTH, DISPARITIES, MAX_BLOCK)
    yield matcher
    matcher.close()


def small_pairs(rng, width, height):
    """Pairs of which each is awkward in its own way, by name."""
    noise         = rng.integers(0, 256, (height, width), np.uint8)
    left, right   = textured_pair(width, height, rng)
    column        = np.arange(width)
    spot          = np.zeros((height, width), np.uint8)
    spot[height//2, width//2] = 255
    yield "textured", left, right
    yield "noise", noise, rng.integers(0, 256, (height, width), np.uint8)
    yield "equal", noise, noise
    yield "flat", np.full((height, width), 77, np.uint8), np.full((height, width), 77, np.uint8)
    yield "black against white", np.zeros((height, width), np.uint8), np.full((height, width), 255, np.uint8)
    yield "white against black", np.full((height, width), 255, np.uint8), np.zeros((height, width), np.uint8)
    yield "bright pixel", spot, np.roll(spot, -3, axis=1)
    for period in (2, 3, 5, 16):
        stripes = np.broadcast_to(np.uint8(255*(column // period % 2)), (height, width))
        yield f"stripes of {period}", stripes, np.roll(stripes, -1, axis=1)
    yield "few values", noise // 128 * 255, right // 128 * 255


@pytest.mark.parametrize("name", ["tsukuba", "venus", "teddy", "cones"])
def test_middlebury(matcher, name):
    """Every combination of block size and number of disparities."""
    pair = stereo_pair(name)
    for disparities in (16, 32, 48, 64):
        for block_size in (5, 7, 9, 15, 21):
            disparity, clocks, _ = matcher.match(pair.left, pair.right, disparities, block_size)
            assert np.array_equal(disparity, match(pair.left, pair.right, disparities, block_size)), (
                disparities, block_size)
            assert clocks <= 1.1*disparity.size


def test_awkward_images(matcher):
    """Ties, saturation and stripes, at random settings and with gaps on both sides."""
    rng = generator(30)
    for turn in range(12):
        disparities = int(rng.integers(1, 5))*16
        block_size  = int(rng.integers(2, 11))*2 + 1
        width       = minimum_size(disparities, block_size)[0] + int(rng.integers(0, 40))
        height      = block_size + int(rng.integers(0, 12))
        for name, left, right in small_pairs(rng, width, height):
            valid, ready    = rng.choice([1.0, 0.7, 0.3], 2)
            disparity, *_   = matcher.match(left, right, disparities, block_size, valid=valid, ready=ready, seed=turn)
            assert np.array_equal(disparity, match(left, right, disparities, block_size)), (
                name, width, height, disparities, block_size, valid, ready)


@pytest.mark.parametrize("disparities", range(16, DISPARITIES + 1, 16))
@pytest.mark.parametrize("block_size", range(5, MAX_BLOCK + 1, 2))
def test_smallest_image(matcher, disparities, block_size):
    """One valid pixel, in the place where cv2.StereoBM has it."""
    width, height = minimum_size(disparities, block_size)
    left, right   = textured_pair(width, height, generator(31, disparities, block_size))
    disparity, *_ = matcher.match(left, right, disparities, block_size)
    assert np.array_equal(disparity, match(left, right, disparities, block_size))
    valid = np.argwhere(disparity != INVALID)
    assert valid.tolist() == [[block_size//2, disparities - 1 + block_size//2]]


def test_widest_image(matcher):
    """Width = maximum, at both ends of the block sizes."""
    left, right = textured_pair(MAX_WIDTH, 30, generator(32))
    for block_size in (5, MAX_BLOCK):
        disparity, *_ = matcher.match(left, right, DISPARITIES, block_size)
        assert np.array_equal(disparity, match(left, right, DISPARITIES, block_size))


def test_frames_back_to_back(matcher):
    """A second frame waits at the sink while the first one ends, and the other way of stalling."""
    rng  = generator(33)
    pair = textured_pair(100, 25, rng)
    more = textured_pair(100, 25, rng, 11)
    for valid, ready in [(1.0, 1.0), (1.0, 0.3), (0.3, 1.0)]:
        matcher.core.set(width=100, height=25, disparities=32, block_size=9)
        words  = np.concatenate([left.astype(np.uint32).ravel() | right.astype(np.uint32).ravel() << 8
                                 for left, right in (pair, more)])
        result = matcher.core.run(words, 5000, valid=valid, ready=ready, seed=5)
        maps   = result.words.astype(np.uint16).view(np.int16).reshape(2, 25, 100)
        assert np.array_equal(maps[0], match(*pair, 32, 9))
        assert np.array_equal(maps[1], match(*more, 32, 9))
        assert result.first.nonzero()[0].tolist() == [0, 2500]
        assert result.last.nonzero()[0].tolist() == [2499, 4999]


def test_reset_in_mid_frame(matcher):
    """After a reset at any clock the next frame is right, whatever the settings before and after."""
    rng = generator(34)
    for _ in range(40):
        left, right = textured_pair(120, 30, rng)
        words       = left.astype(np.uint32).ravel() | right.astype(np.uint32).ravel() << 8
        matcher.core.set(width=120, height=30, disparities=int(rng.integers(1, 5))*16, block_size=9)
        matcher.core.run(words, 3600, valid=0.8, ready=0.8, seed=1, reset_clock=int(rng.integers(1, 6000)))
        matcher.core.reset()
        block_size    = int(rng.choice([5, 9, 21]))
        disparity, *_ = matcher.match(left, right, 32, block_size)
        assert np.array_equal(disparity, match(left, right, 32, block_size))


def test_one_pixel_per_clock(matcher):
    """A frame takes a clock per pixel and per pixel of the lower border; the first row waits for its block."""
    left, right = textured_pair(640, 480, generator(35))
    for block_size in (5, 9, 21):
        disparity, clocks, first_row = matcher.match(left, right, 64, block_size)
        assert np.array_equal(disparity, match(left, right, 64, block_size))
        assert clocks    <= 640*(480 + block_size//2) + 50
        assert first_row <= 640*block_size + 50


@pytest.mark.parametrize("disparities, max_block_size", [(16, 5), (128, 9), (112, 31)])
def test_built_sizes(disparities, max_block_size):
    """The least and the most that can be built, and a number of disparities that is no power of two."""
    max_width = disparities + 2*max_block_size
    core      = CosimMatcher(max_width, disparities, max_block_size)
    rng       = generator(36, disparities)
    for used in sorted({16, disparities//2//16*16 or 16, disparities}):
        for block_size in sorted({5, max_block_size}):
            for width in (minimum_size(used, block_size)[0], max_width):
                left, right   = textured_pair(width, block_size + 3, rng, 14)
                disparity, *_ = core.match(left, right, used, block_size)
                assert np.array_equal(disparity, match(left, right, used, block_size)), (used, block_size, width)
    core.close()


@pytest.mark.parametrize("parameters, message", [
    ({"disparities": 24},                      "multiple of 16"),
    ({"disparities": 0},                       "multiple of 16"),
    ({"disparities": 144},                     "multiple of 16"),
    ({"max_block_size": 8},                    "must be odd"),
    ({"max_block_size": 3},                    "must be odd"),
    ({"max_block_size": 33},                   "must be odd"),
    ({"max_width": 70},                        "max_width"),
    ({"max_width": 5000},                      "max_width"),
])
def test_bad_parameters(parameters, message):
    """They are refused by name."""
    with pytest.raises(ValueError, match=message):
        Matcher(**parameters)


def test_sink_waits_for_a_frame():
    """Between frames and in reset the sink is not ready, and nothing comes out unasked."""
    core = StreamCore(Matcher(64, 100, 16, 5), SETTINGS)
    core.set(width=20, height=5, disparities=16, block_size=5)
    assert len(core.run(np.zeros(0, np.uint32), 1, idle_clocks=200).words) == 0
    core.close()
