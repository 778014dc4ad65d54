#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Figure 5.3: overflow of the sums, which the thesis has in its section 5.7.1, and why ours do not overflow."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...gateware.common.parameters import MAX_BLOCK_SIZE, MIN_BLOCK_SIZE, MatcherParameters
from ...gateware.engines.sad.block_sum import BlockSum
from ...gateware.engines.sad.column_sum import ColumnSum
from ...host_tools.core.images import disparity_pixels
from ...host_tools.data.datasets import StereoPair
from ...soc.reports.markdown import table
from ..models import stages
from ..models.stereo_bm import stereo_bm, used_columns
from .measured import BENCH, MODEL
from .middlebury import stereo_pair
from .pictures import maps
from .presets import Preset, Scale
from .section import Section

#: The pair of the picture, as in the thesis.
SHOWN = "tsukuba"

#: Fewest bits that the sums of a block are cut to, for the table.
FEWEST_BITS = 11

#: Maps in a row of the picture.
COLUMNS = 3


def widest(disparities: int) -> int:
    """Return the width of the worst case, which all of its matchers have."""
    return disparities + 2*MAX_BLOCK_SIZE


def block_sizes(scale: Scale) -> list[int]:
    """Return the block sizes of the table of widths."""
    return sorted({MIN_BLOCK_SIZE, *(one.block_size for one in scale.presets), max(scale.block_sizes), MAX_BLOCK_SIZE})


def overflow_builds(scale: Scale) -> list[MatcherParameters]:
    """Return the matchers of the table of widths; the one with the largest block has the worst case."""
    disparities = scale.presets[0].disparities
    return [Preset(disparities, size).parameters(widest(disparities)) for size in block_sizes(scale)]


def widths(disparities: int, block_size: int) -> dict[str, int]:
    """Return the largest sums of a column and of a block, and the bits that the elaborated cores have for them."""
    parameters = Preset(disparities, block_size).parameters(widest(disparities))
    return {
        "block_size":  block_size,
        "column":      block_size*parameters.largest_pixel,
        "column_bits": len(ColumnSum(parameters).source.sums)//disparities,
        "cost":        block_size**2*parameters.largest_pixel,
        "cost_bits":   len(BlockSum(parameters).source.costs)//disparities,
    }


def wrapped_map(pair: StereoPair, preset: Preset, bits: int) -> NDArray[np.int16]:
    """Return the map (int16, H x W, sixteenths) of a matcher whose sums of a block have only so many bits."""
    settings = preset.settings()
    height, width = pair.left.shape
    columns  = used_columns(width, settings)
    costs    = stages.block_costs(pair.left, pair.right, columns) & ((1 << bits) - 1)
    margin   = preset.block_size//2
    disparity = np.full((height, width), settings.invalid, np.int16)
    disparity[margin:height - margin, columns.first:columns.first + columns.count] = stages.winners(costs)[0] << 4
    disparity[:, :columns.valid.start] = settings.invalid
    disparity[:, columns.valid.stop:]  = settings.invalid
    return disparity


def worst_case_differences(disparities: int) -> int:
    """Return in how many pixels the gateware's map of black against white differs from the model's, at the largest
    block."""
    size    = widest(disparities)
    black   = np.zeros((size, size), np.uint8)
    preset  = Preset(disparities, MAX_BLOCK_SIZE)
    matcher = preset.cosim(size)
    wrong   = 0
    for left, right in ((black, ~black), (~black, black)):
        settings = preset.settings()
        wrong   += int((matcher.match_settings(left, right, settings)[0] != stereo_bm(left, right, settings)).sum())
    matcher.close()
    return wrong


def measure_overflow(scale: Scale, folder: Path) -> dict[str, Any]:
    """Return the widths of the sums and the worst case, and draw maps of sums that are cut."""
    preset  = scale.presets[0]
    pair    = stereo_pair(SHOWN)
    needed  = widths(preset.disparities, preset.block_size)["cost_bits"]
    whole   = stereo_bm(pair.left, pair.right, preset.settings())
    valid   = whole > preset.settings().invalid
    cut     = {bits: wrapped_map(pair, preset, bits) for bits in range(needed, FEWEST_BITS - 1, -1)}
    maps(folder / "overflow.png", [(f"{bits} bits", disparity_pixels(one)) for bits, one in cut.items()],
         preset.disparities - 1, COLUMNS)
    return {
        "preset":   preset.name,
        "widths":   [widths(preset.disparities, size) for size in block_sizes(scale)],
        "worst":    worst_case_differences(preset.disparities),
        "changed":  {bits: 100*float((one != whole)[valid].mean()) for bits, one in cut.items()},
        "largest":  MAX_BLOCK_SIZE,
    }


def fields(result: dict[str, Any]) -> dict[str, object]:
    """Return the fields of the figure."""
    sums = table(["block", "largest column sum", "its bits", "bits built", "largest SAD", "its bits", "bits built"],
        [[f"{row['block_size']}x{row['block_size']}", row["column"], row["column"].bit_length(), row["column_bits"],
          row["cost"], row["cost"].bit_length(), row["cost_bits"]] for row in result["widths"]])
    cuts = table(["bits of a SAD", "pixels with another disparity, % of those with one"],
                 [[bits, f"{share:.2f}"] for bits, share in result["changed"].items()])
    return {"sums": sums, "cuts": cuts, "worst": result["worst"], "largest": result["largest"],
            "preset": result["preset"]}


SECTIONS = [
    Section("Figure 5.3", "overflow of the sums", """\
The thesis shows data overflow on Tsukuba. Our sums have enough bits for the largest possible one, black against
white. The table compares the widths of the elaborated cores with the bits of the largest sum.

{sums}
`tests/gateware/matcher/test_overflow.py` drives the emitted Verilog of both sums, and the whole matcher, into that
worst case: an all-black image against an all-white one, at the largest block. Here, {largest}x{largest}: {worst}
pixels differ from the model's.

The picture shows what overflow would do: Tsukuba ({preset}) by the model, with sums of fewer and fewer bits.

![Tsukuba with sums of fewer bits](images/thesis/overflow.png)

{cuts}""", measure_overflow, fields, overflow_builds, sources=(*BENCH, *MODEL), needs_pairs=True),
]
