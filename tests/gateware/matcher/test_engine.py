#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The interface of an engine: a conforming engine fits between front and post, any other is refused."""

from __future__ import annotations

import numpy as np
import pytest
from litex.gen import LiteXModule
from litex.soc.interconnect import stream

from litestereo.gateware.common import connect_pipeline
from litestereo.gateware.common.parameters import MatcherParameters
from litestereo.gateware.engines.costs import check_engine, cost_layout, pass_position, positioned_pair_layout
from litestereo.gateware.engines.sad.sad_engine import SADEngine
from litestereo.gateware.matcher.matcher import Matcher, matcher_settings
from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.sim.cores.cosim import pixel_words, signals
from litestereo.sim.cores.stream_core import StreamCore
from litestereo.sim.models.stereo_bm import stereo_bm
from support.pairs import generator, textured_pair

BUILT = MatcherParameters(max_width=64, max_height=100, disparities=16, max_block_size=5)


class LateEngine(LiteXModule):
    """The sum of absolute differences, and many more clocks."""

    MORE = 45

    def __init__(self, parameters, latency=None):
        self.sink   = stream.Endpoint(positioned_pair_layout(parameters))
        self.source = stream.Endpoint(cost_layout(parameters))
        self.sad    = sad = SADEngine(parameters)
        self.cap, self.block_size = sad.cap, sad.block_size
        self.latency = sad.latency + self.MORE if latency is None else latency
        self.comb += connect_pipeline(self.sink, sad.sink)
        pass_position(self, sad.source, self.source, self.MORE)
        costs = sad.source.costs
        for _ in range(self.MORE):
            late = type(costs)(len(costs))
            self.sync += late.eq(costs)
            costs = late
        self.comb += self.source.costs.eq(costs)


class LateMatcher(Matcher):
    """A matcher with that engine."""

    def make_engine(self):
        return LateEngine(self.parameters)


def test_another_engine():
    """The matcher needs only the engine's latency: the map is the same, and back-pressure loses no result."""
    matcher     = LateMatcher(BUILT)
    core        = StreamCore(matcher, [name for name, *_ in matcher_settings(matcher.parameters)])
    settings    = MatcherSettings(16, 5, disp12_max_diff=1)
    left, right = textured_pair(60, 20, generator(37), 9)
    core.set(**signals(60, 20, settings))
    for valid, ready in [(1.0, 1.0), (1.0, 0.3)]:
        result = core.run(pixel_words(left, right), 1200, valid=valid, ready=ready, seed=7)
        found  = result.words.astype(np.uint16).view(np.int16).reshape(20, 60)
        assert np.array_equal(found, stereo_bm(left, right, settings))
    core.close()
    assert matcher.fifo.depth == 2*Matcher(BUILT).fifo.depth


def engine(sink=None, source=None, latency=8):
    """Return endpoints and latency of an engine, some of them wrong."""
    result         = LiteXModule()
    result.sink    = stream.Endpoint(positioned_pair_layout(BUILT) if sink is None else sink)
    result.source  = stream.Endpoint(cost_layout(BUILT) if source is None else source)
    result.latency = latency
    return result


def test_what_is_an_engine():
    """Block matching is an engine, and so is any core with the same two endpoints."""
    check_engine(SADEngine(BUILT), BUILT)
    check_engine(engine(), BUILT)


@pytest.mark.parametrize("wrong, message", [
    ({"sink": cost_layout(BUILT)},                              "sink must have the fields left, right"),
    ({"source": positioned_pair_layout(BUILT)},                 "source must have the fields costs"),
    ({"source": cost_layout(MatcherParameters(64, 100, 32, 5))}, "source must have the fields costs"),
    ({"latency": None},                                         "latency must be a number of clocks"),
    ({"latency": 0},                                            "latency must be a number of clocks"),
], ids=str)
def test_what_is_none(wrong, message):
    """Another layout, another number of lanes, or a variable latency is refused."""
    with pytest.raises(ValueError, match=message):
        check_engine(engine(**wrong), BUILT)


class WrongMatcher(Matcher):
    """A matcher whose engine has no latency."""

    def make_engine(self):
        return engine(latency=None)


def test_matcher_refuses_what_is_none():
    """The matcher refuses such an engine by name when it is built."""
    with pytest.raises(ValueError, match="LiteXModule.latency must be a number of clocks"):
        WrongMatcher(BUILT)
