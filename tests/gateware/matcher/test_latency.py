#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What the cores of the pipeline declare."""

from __future__ import annotations

import numpy as np
import pytest

from litestereo.gateware.common.parameters import MatcherParameters
from litestereo.gateware.engines.sad.absolute_difference import AbsoluteDifference
from litestereo.gateware.engines.sad.block_sum import BlockSum
from litestereo.gateware.engines.sad.column_sum import ColumnSum
from litestereo.gateware.matcher.alignment import Alignment
from litestereo.gateware.matcher.line_buffer import LineBuffer
from litestereo.gateware.matcher.prefilter import Prefilter
from litestereo.gateware.post.selection.selection import Selection
from litestereo.gateware.post.selection.subpixel import Neighbours, Subpixel
from litestereo.gateware.post.selection.uniqueness import CostLimit, Uniqueness
from litestereo.gateware.post.selection.winner import Winner
from litestereo.sim.cores.stream_core import StreamCore
from support.lanes import pack

BUILT = MatcherParameters(max_width=100, disparities=48, max_block_size=9)
RAW   = MatcherParameters(max_width=100, disparities=48, max_block_size=9, features=["raw"])


@pytest.mark.parametrize("core", [Prefilter, LineBuffer, Alignment, AbsoluteDifference, ColumnSum, BlockSum, Winner,
                                  CostLimit, Uniqueness, Neighbours, Subpixel, Selection])
@pytest.mark.parametrize("built", [BUILT, RAW], ids=["everything", "raw"])
def test_latency(core, built):
    """An item comes out as many clocks after its entry as the core declares."""
    module = core(built)
    if module.latency == 0:
        return
    core   = StreamCore(module, [], pipeline=True)
    fields = dict(module.sink.description.payload_layout)
    # Pixels move in all lanes: those above the ones that the core's own test has would stay as they are.
    result = core.run(pack(module.sink, {name: np.ones(1) for name in ("complete", "cost", "move_left", "move_right")
                                         if name in fields} or {next(iter(fields)): np.zeros(1)}), 1)
    assert result.probe_clock - 1 == module.latency


@pytest.mark.parametrize("disparities, max_block_size, features, largest, column_bits, cost_bits", [
    (16, 5,  ["raw"],           255, 11, 13),
    (64, 9,  ["xsobel"],        126, 11, 14),
    (64, 15, ["xsobel", "raw"], 255, 12, 16),
    (96, 31, ["raw"],           255, 13, 18),
])
def test_widths(disparities, max_block_size, features, largest, column_bits, cost_bits):
    """Costs have as many bits as the largest sum needs, and the largest cost is not all ones."""
    built = MatcherParameters(max_width=200, disparities=disparities, max_block_size=max_block_size, features=features)
    assert (built.largest_pixel, built.column_bits, built.cost_bits) == (largest, column_bits, cost_bits)
    assert max_block_size**2*largest < 2**cost_bits - 1


def test_feature_bits():
    """Feature bits are in the order of the capability register."""
    assert MatcherParameters(features=["raw", "median"]).feature_bits == 0x82
    assert MatcherParameters().feature_bits == 0xff
