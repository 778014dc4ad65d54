#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Write docs/resources.md: the resources of matcher and rectifier on several FPGAs, and their speed on an ECP5."""

from __future__ import annotations

import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

from ...gateware.common.parameters        import FEATURES, OPENCV_FEATURES, MatcherParameters
from ...gateware.rectification.parameters import RectifierParameters
from ..build.commit                       import commit
from ..build.pages                        import FPGA_LOCK, Page, computed_key
from ..build.paths                        import PACKAGE_DIR
from ..build.tools                        import ToolError
from ..flow.place                         import PACKAGE, SEED, SPEED_GRADE, Placement, fits
from ..flow.synthesis                     import (FAMILIES, PRIMITIVES, Build, Resources, block_rams, emit, resources,
    synthesize)
from .markdown                            import table, tools

MAX_WIDTH = 640
MAX_RECTIFIED_HEIGHT = 480
BARE      = ("raw",)

def built(disparities: int, max_block_size: int, features) -> MatcherParameters:
    """Return the parameters of a build; all builds have one width."""
    return MatcherParameters(MAX_WIDTH, disparities=disparities, max_block_size=max_block_size, features=features)

# On the ECP5, and on all families.
ECP5_BUILDS = [
    *(built(disparities, 9, features) for disparities in (16, 32, 64, 128) for features in (BARE, OPENCV_FEATURES)),
    built(64, 15, OPENCV_FEATURES),
    built(64, 21, OPENCV_FEATURES),
    built(64, 15, FEATURES),
    built(32, 15, OPENCV_FEATURES),
]
ALL_BUILDS  = [built(16, 9, BARE), built(16, 9, OPENCV_FEATURES), built(64, 15, OPENCV_FEATURES)]
FULL        = built(64, 15, FEATURES) # What each feature is removed from, to measure its cost.

# Build of the table of memories; and one that does not fit the smallest device, with its block RAMs and sites.
MEMORY_BUILD       = built(64, 15, OPENCV_FEATURES)
SMALL_DEVICE_BUILD = built(64, 9, OPENCV_FEATURES)
SMALL_DEVICE_BRAM  = 56
SMALL_DEVICE_SITES = 24288

def rectifier(rows: int) -> RectifierParameters:
    """Return the parameters of a rectifier alone."""
    return RectifierParameters(MAX_WIDTH, MAX_RECTIFIED_HEIGHT, rows)

def rectified(build: MatcherParameters, rows: int) -> MatcherParameters:
    """Return the parameters of a matcher with a rectifier before it."""
    return replace(build, features=build.features | {"rectification"}, rectification_rows=rows,
        rectification_height=MAX_RECTIFIED_HEIGHT)

# With a rectifier: on the ECP5, on the other families, and placed.
RECTIFIER_ROWS       = (64, 96)
RECTIFIER_BUILDS     = [*map(rectifier, RECTIFIER_ROWS),
    *(rectified(built(disparities, 15, OPENCV_FEATURES), rows) for disparities in (32, 64) for rows in RECTIFIER_ROWS)]
ALL_RECTIFIER_BUILDS = [rectifier(RECTIFIER_ROWS[0])]
RECTIFIER_PLACEMENTS = [
    ("45k", 90, rectifier(64)),
    ("45k", 90, rectifier(96)),
    ("45k", 90, rectified(built(32, 15, OPENCV_FEATURES), 64)),
    ("85k", 90, rectified(built(64, 15, OPENCV_FEATURES), 96)),
]

# Device, constraint in MHz, build.
PLACEMENTS = [
    ("45k", 90, built(64, 15, OPENCV_FEATURES)),
    ("45k", 90, built(64, 15, FEATURES)),
    ("25k", 60, built(64, 9,  ("xsobel",))),
    ("25k", 60, built(32, 15, OPENCV_FEATURES)),
]

HEADER = """\
# Resources

Resources and clocks of the matcher alone (`gateware/matcher/matcher.py`, no DMA, no CPU), and with the rectifier
before it, written by `make resources`.

- Images have up to {width} x 4095 pixels. `bare` is the sum of absolute differences of grey values, `OpenCV` adds
  all stages of cv2.StereoBM, `all` also the median.
- `LUT` counts logic sites: LUTs, carries (two sites per CCU2C of the ECP5, one per ALU of Gowin) and distributed
  RAM. `LUT cells` are the LUTs alone. On Xilinx, carries have separate sites next to the LUTs. FF are flip-flops.
  BRAM are block RAMs of 16 to 18 kbit (36 kbit on the 7-series, halves counted). DSP are multipliers.
- Yosys counts after mapping, before packing. Place and route, below, packs less tightly than the sum.
- {tools}; commit {commit}.
"""

def name_of(build: MatcherParameters) -> str:
    """Return the name of a build's features."""
    names = {frozenset(BARE): "bare", frozenset(OPENCV_FEATURES): "OpenCV", frozenset(FEATURES): "all"}
    stages = build.features & frozenset(FEATURES)
    return names.get(stages, " ".join(name for name in FEATURES if name in stages))

def rows_of(build: Build) -> int:
    """Return the rows of each ring of a build with a rectifier; 0 without one."""
    if isinstance(build, RectifierParameters):
        return build.rows
    return build.rectification_rows if "rectification" in build.features else 0

def text_of(build: Build) -> str:
    """Return what a build is, as text."""
    rows = [f"rectifier with {rows_of(build)} rows"] if rows_of(build) else []
    if isinstance(build, RectifierParameters):
        return rows[0]
    return ", ".join([f"{build.disparities} disparities", f"block {build.max_block_size}", name_of(build), *rows])

def cells_of(build: MatcherParameters) -> list:
    """Return the cells of a table that name the build."""
    return [build.disparities, build.max_block_size, name_of(build)]

def synthesized(family: str, build: Build) -> Resources:
    """Return the resources of a build on a family, and print a line of progress."""
    result = resources(synthesize(emit(build), family), family)
    print(f"resources: {family}, {text_of(build)}: {result}", flush=True)
    return result

def row(build: MatcherParameters, result: Resources) -> list:
    """Return a build and its resources, in total and per disparity."""
    disparities = build.disparities
    return [*cells_of(build), result.lut, result.cells, result.ff, f"{result.bram:g}", result.dsp,
        round(result.lut/disparities), round(result.cells/disparities), round(result.ff/disparities),
        f"{result.bram/disparities:.2f}"]

COLUMNS = ["disparities", "block", "features", "LUT", "LUT cells", "FF", "BRAM", "DSP", "LUT per disparity",
    "LUT cells per disparity", "FF per disparity", "BRAM per disparity"]

def feature_table(full: Resources, without: dict[str, Resources]) -> str:
    """Return the cost of each feature: the difference between the full build and the build without it."""
    rows = [[feature, full.lut - less.lut, full.ff - less.ff, f"{full.bram - less.bram:g}", full.dsp - less.dsp,
        round((full.lut - less.lut)/FULL.disparities, 1)] for feature, less in without.items()]
    return table(["feature", "LUT", "FF", "BRAM", "DSP", "LUT per disparity"], rows)

def memory_section() -> str:
    """Return every block RAM by the memory that it is part of."""
    disparities, block, name = cells_of(MEMORY_BUILD)
    counts = block_rams(synthesize(emit(MEMORY_BUILD), "ECP5"))
    return (f"## Where the block RAMs are\n\n{disparities} disparities, block {block}, {name}, ECP5.\n\n"
        + table(["memory", "BRAM"], [[f"`{name}`", count] for name, count in counts.items()]))

def small_device_section(result: Resources) -> str:
    """Return the alternatives for the smallest device."""
    disparities, block, name = cells_of(SMALL_DEVICE_BUILD)
    return (f"## The LFE5U-25F\n\n{disparities} disparities at block {block} with all of {name}'s stages take "
        f"{result.bram:g} block RAMs and {result.lut} sites of logic; the LFE5U-25F has {SMALL_DEVICE_BRAM} and "
        f"{SMALL_DEVICE_SITES}. It has room for half the disparities with every stage, or for all of them with few "
        "stages: see the placements below. Images of at most 512 columns would halve the blocks of the column sums, "
        "the largest memory.\n")

PLACEMENT_COLUMNS = ["constraint, MHz", "MHz", "combinational", "FF", "BRAM", "DSP"]

def placement_row(case: tuple, result: Placement | None) -> list:
    """Return a placement, or that there is none."""
    device, constraint, build = case
    first = [f"LFE5U-{device.upper()[:-1]}F", *cells_of(build), constraint]
    if result is None:
        return [*first, "does not fit", "", "", "", ""]
    cells = [f"{used} of {result.sites[kind]} ({100*used//result.sites[kind]} %)" for kind, used in result.used.items()]
    return [*first, f"{result.mhz:.1f}", *cells]

def rectifier_cells(build: Build) -> list:
    """Return the cells of a table that name a build with a rectifier."""
    alone = isinstance(build, RectifierParameters)
    return [rows_of(build), *(["none", "", ""] if alone else cells_of(build))]

def rectifier_row(family: str, build: Build, result: Resources) -> list:
    """Return a build with a rectifier and its resources."""
    return [family, *rectifier_cells(build), result.lut, result.cells, result.ff, f"{result.bram:g}", result.dsp]

def rectifier_section(results: dict[tuple[str, Build], Resources]) -> str:
    """Return the resources of the rectifier alone, and of a matcher with it."""
    builds   = [*(("ECP5", build) for build in RECTIFIER_BUILDS), *rectifier_syntheses()[len(RECTIFIER_BUILDS):]]
    memories = block_rams(synthesize(emit(rectifier(RECTIFIER_ROWS[0])), "ECP5"))
    return ("## With the rectifier\n\nThe rectifier (`gateware/rectification/rectifier.py`) rectifies images of up to "
        f"{MAX_WIDTH} x {MAX_RECTIFIED_HEIGHT} pixels and keeps so many rows of each camera. It is alone, or the "
        "matcher is after it.\n\n"
        + table(["family", "rows", "disparities", "block", "features", "LUT", "LUT cells", "FF", "BRAM", "DSP"],
            [rectifier_row(*one, results[one]) for one in builds])
        + f"\nThe block RAMs of the one with {RECTIFIER_ROWS[0]} rows on an ECP5, of both cameras:\n\n"
        + table(["memory", "BRAM"], [[f"`{name}`", count] for name, count in memories.items()]))

def rectifier_placement_row(case: tuple, result: Placement | None) -> list:
    """Return a placement of a build with a rectifier, or that there is none."""
    device, constraint, build = case
    found = placement_row((device, constraint, built(16, 9, BARE)), result)
    return [found[0], *rectifier_cells(build), *found[4:]]

def rectifier_placement_section(placed: list[Placement | None]) -> str:
    """Return the placements with a rectifier."""
    return ("## Place and route with the rectifier\n\nIn the same way, with a rectifier that keeps so many rows.\n\n"
        + table(["device", "rows", "disparities", "block", "features", *PLACEMENT_COLUMNS],
            [rectifier_placement_row(*one) for one in zip(RECTIFIER_PLACEMENTS, placed)]))

def rectifier_syntheses() -> list[tuple[str, Build]]:
    """Return family and build of each synthesis with a rectifier."""
    return [*(("ECP5", build) for build in RECTIFIER_BUILDS),
        *((family, build) for family in FAMILIES if family != "ECP5" for build in ALL_RECTIFIER_BUILDS)]

def without_builds() -> dict[str, MatcherParameters]:
    """Return the full build without each of the features."""
    return {feature: replace(FULL, features=FULL.features - {feature} - ({"texture"} if feature == "xsobel"
        else set())) for feature in FEATURES}

def syntheses() -> list[tuple[str, MatcherParameters]]:
    """Return family and build of each synthesis."""
    return [*(("ECP5", build) for build in [*ECP5_BUILDS, *without_builds().values()]),
        *((family, build) for family in FAMILIES if family != "ECP5" for build in ALL_BUILDS)]

def settings_text() -> str:
    """Return the settings of the builds as text, the same in each process: the order of a set is not."""
    placed = [(device, constraint, text_of(build))
        for device, constraint, build in [*PLACEMENTS, *RECTIFIER_PLACEMENTS]]
    return repr((FAMILIES, PRIMITIVES, PACKAGE, SPEED_GRADE, SEED, placed))

def key() -> str:
    """Return the content key of the page: the Verilog of all builds, the build's settings, and the tools."""
    builds  = {build for _, build in [*syntheses(), *rectifier_syntheses()]}
    builds |= {build for *_, build in [*PLACEMENTS, *RECTIFIER_PLACEMENTS]}
    scripts = [settings_text(), FPGA_LOCK.read_text()]
    sources = [PACKAGE_DIR / one for one in ("gateware", "soc/flow", "soc/reports/resources.py", ".ci/lock/fpga.txt")]
    return computed_key("resources", sources, lambda: [*sorted(map(emit, builds)), *scripts])

PAGE = Page("docs/resources.md", "resources", key, minutes=90)

def document() -> str:
    """Return the document; build what is missing."""
    jobs = [*syntheses(), *rectifier_syntheses()]
    with ThreadPoolExecutor(2) as pool:
        results = dict(zip(jobs, pool.map(lambda job: synthesized(*job), jobs)))
        placed  = list(pool.map(lambda case: fits(*case), PLACEMENTS))
        placed_with_rectifier = list(pool.map(lambda case: fits(*case), RECTIFIER_PLACEMENTS))
    parts = [HEADER.format(width=MAX_WIDTH, tools=tools(), commit=commit()), "## Lattice ECP5\n",
        table(COLUMNS, [row(build, results["ECP5", build]) for build in ECP5_BUILDS]),
        f"## What a feature costs\n\n{FULL.disparities} disparities, block {FULL.max_block_size}, ECP5: all features, "
        "minus all features except this one. Without the prefilter there is no texture test either.\n",
        feature_table(results["ECP5", FULL],
            {name: results["ECP5", build] for name, build in without_builds().items()})]
    parts += [memory_section(), small_device_section(results["ECP5", SMALL_DEVICE_BUILD])]
    for family in FAMILIES:
        if family != "ECP5":
            parts += [f"## {family}\n", table(COLUMNS, [row(build, results[family, build]) for build in ALL_BUILDS])]
    parts.append(rectifier_section(results))
    parts += [f"## Place and route on an ECP5\n\nThe matcher alone behind shift registers, package {PACKAGE}, speed "
        f"grade {SPEED_GRADE} (the slowest), seed {SEED}. A combinational site is a LUT4 or half a carry.\n",
        table(["device", "disparities", "block", "features", *PLACEMENT_COLUMNS],
            [placement_row(case, result) for case, result in zip(PLACEMENTS, placed)]),
        rectifier_placement_section(placed_with_rectifier)]
    return "\n".join(parts)

def main() -> int:
    """Write the document; return the exit status."""
    try:
        text = document()
    except ToolError as error:
        print(f"resources: error: {error}", file=sys.stderr)
        return 1
    PAGE.write(text)
    print(f"written: {PAGE.path}")
    return 0

if __name__ == "__main__":
    sys.exit(main())
