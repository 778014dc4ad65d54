#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Tables 5.1 to 5.3: memories, registers and operators of the design, counted after migen's elaboration."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

from ...gateware.common.parameters import MIN_BLOCK_SIZE, PIXEL_BITS, MatcherParameters
from ...gateware.engines.sad.absolute_difference import AbsoluteDifference
from ...gateware.engines.sad.block_sum import BlockSum
from ...gateware.engines.sad.column_sum import ColumnSum
from ...gateware.matcher.line_buffer import LineBuffer
from ...gateware.matcher.matcher import Matcher
from ...gateware.post.selection.winner import Winner
from ...soc.reports.markdown import table
from .elaborated import contents
from .presets import PUBLISHED, THESIS, Preset, Scale
from .section import Section

Counts = dict[str, Any]


def held_at_once(block_size: int, pixels: int, disparities: int) -> int:
    """Return the pixels that a window holds: both images under `pixels` neighbouring blocks, at all disparities."""
    columns = block_size + pixels - 1
    return block_size*(columns + columns + disparities - 1)


def counts(width: int, preset: Preset) -> Counts:
    """Return the sizes of memories and the numbers of operators and registers of a build."""
    parameters = preset.parameters(width)
    matcher    = Matcher(parameters)
    difference, columns, block, winner, lines = (contents(core(parameters)) for core in (
        AbsoluteDifference, ColumnSum, BlockSum, Winner, LineBuffer))
    return asdict(preset) | {
        "name":                 preset.name,
        "line_pixels":          lines.memory_bits("line_buffer")//PIXEL_BITS,
        "column_sum_bits":      columns.memory_bits("column_sums"),
        "block_column_bits":    block.memory_bits("block_columns"),
        "sad_units":            block.count("+"),
        "absolute_differences": difference.count("-"),
        "additions":            sum(core.count("+", "-") for core in (columns, block)),
        "comparators":          winner.count("<"),
        "pixels_under_way":     sum(core.latency for core in matcher.pipeline()),
        "register_bits":        contents(matcher).register_bits,
    }


# Table 5.1 ----------------------------------------------------------------------------------------

def at_once() -> list[int]:
    """Return the numbers of pixels at once in the tables: one, and those of the thesis."""
    return sorted({1, *(preset.published_pixels or 1 for preset in THESIS)})


def pixel_presets(scale: Scale) -> list[Preset]:
    """Return the presets of table 5.1: block sizes that can be built, and the fewest disparities."""
    return [Preset(min(scale.disparities), size) for size in scale.block_sizes if size >= MIN_BLOCK_SIZE]


def pixel_builds(scale: Scale) -> list[MatcherParameters]:
    """Return the matchers of table 5.1."""
    return [preset.parameters(scale.width) for preset in pixel_presets(scale)]


def measure_pixels(scale: Scale, folder: Path) -> list[Counts]:
    """Return the counts over the block sizes that can be built, for the fewest disparities."""
    return [counts(scale.width, preset) | {
        "window": [held_at_once(preset.block_size, pixels, preset.disparities) for pixels in at_once()],
        "width":  scale.width} for preset in pixel_presets(scale)]


def pixel_fields(result: list[Counts]) -> dict[str, object]:
    """Return the fields of table 5.1."""
    header = ["block", *(f"window, {pixels} at once: pixels" for pixels in at_once()), "line buffer: pixels",
              "column sums: bits", "block columns: bits", "registers: bits"]
    rows   = [[f"{row['block_size']}x{row['block_size']}", *row["window"], row["line_pixels"], row["column_sum_bits"],
               row["block_column_bits"], row["register_bits"]] for row in result]
    return {"table": table(header, rows), "width": result[0]["width"], "disparities": result[0]["disparities"]}


# Tables 5.2 and 5.3 -------------------------------------------------------------------------------

def disparity_presets(scale: Scale) -> list[Preset]:
    """Return the presets of table 5.2: the block of the thesis' first configuration."""
    return [Preset(disparities, scale.presets[0].block_size) for disparities in scale.disparities]


def disparity_builds(scale: Scale) -> list[MatcherParameters]:
    """Return the matchers of table 5.2."""
    return [preset.parameters(scale.width) for preset in disparity_presets(scale)]


def measure_disparities(scale: Scale, folder: Path) -> list[Counts]:
    """Return the counts over the disparities."""
    return [counts(scale.width, preset) for preset in disparity_presets(scale)]


def disparity_fields(result: list[Counts]) -> dict[str, object]:
    """Return the fields of table 5.2."""
    header = ["disparities", "SAD units", "comparators", "absolute differences", "additions and subtractions",
              "absolute differences if each block were summed anew"]
    rows   = [[row["disparities"], row["sad_units"], row["comparators"], row["absolute_differences"], row["additions"],
               row["disparities"]*row["block_size"]**2] for row in result]
    return {"table": table(header, rows), "block": result[0]["block_size"]}


def measure_parallel(scale: Scale, folder: Path) -> list[Counts]:
    """Return the counts of every preset."""
    return [counts(scale.width, preset) for preset in scale.presets]


def parallel_fields(result: list[Counts]) -> dict[str, object]:
    """Return the fields of table 5.3."""
    header = ["configuration", "pixels at once in the thesis", "SAD units if each pixel has its own",
              "comparators if each pixel has its own", "SAD units", "comparators", "absolute differences",
              "pixels in flight"]
    rows   = []
    for row in result:
        pixels, lanes = row["published_pixels"], row["disparities"]
        units         = [f"{pixels} {PUBLISHED}", pixels*lanes, pixels*(lanes - 1)] if pixels else ["", "", ""]
        rows.append([row["name"], *units, row["sad_units"], row["comparators"],
                     row["absolute_differences"], row["pixels_under_way"]])
    return {"table": table(header, rows)}


SECTIONS = [
    Section("Table 5.1", "pixels held, by window size and pixels at once", """\
A design with its window in registers holds every pixel under the blocks that it compares. The window grows with
the block and with the number of pixels processed at the same time; the columns `window` follow from this
definition, for both images and {disparities} disparities. Our matcher has no window. It keeps the rows of a block
in one line buffer (images {width} pixels wide), a sum per column and disparity, and the last few of these sums in
a ring. Registers are all flip-flops of the elaborated matcher, before synthesis. The table begins with the
smallest block of the gateware.

{table}""", measure_pixels, pixel_fields, pixel_builds),
    Section("Table 5.2", "SAD units and comparators over the disparity range", """\
Operators of the elaborated cores, block {block}x{block}. A SAD unit is a running sum of a block, one per
disparity. It needs two absolute differences, for the row that enters and the row that leaves, for any block size.
For comparison, the last column follows from the definition of the sum.

{table}""", measure_disparities, disparity_fields, disparity_builds),
    Section("Table 5.3", "SAD units and comparators over the pixels at once", """\
The thesis processes several pixels at the same time. Our matcher begins one pixel per clock, with all its
disparities, and completes one per clock; the same units hold as many pixels as the pipeline is long. The columns
for separate units per pixel follow from the definition and are not values of the thesis. With all stages, one more
unit sums the texture.

{table}""", measure_parallel, parallel_fields, Scale.narrow),
]
