#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Write docs/resources.md: the resources of the matcher alone on several FPGAs, and its speed on an ECP5."""

from __future__ import annotations

import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

from ...gateware.common.parameters import FEATURES, OPENCV_FEATURES, MatcherParameters
from ..build.commit                import commit
from ..build.pages                 import FPGA_LOCK, Page, computed_key
from ..build.paths                 import PACKAGE_DIR
from ..build.tools                 import ToolError
from ..flow.place                  import PACKAGE, SEED, SPEED_GRADE, Placement, fits
from ..flow.synthesis              import FAMILIES, PRIMITIVES, Resources, block_rams, emit, resources, synthesize
from .markdown                     import table, tools

MAX_WIDTH = 640
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

# Device, constraint in MHz, build.
PLACEMENTS = [
    ("45k", 90, built(64, 15, OPENCV_FEATURES)),
    ("45k", 90, built(64, 15, FEATURES)),
    ("25k", 60, built(64, 9,  ("xsobel",))),
    ("25k", 60, built(32, 15, OPENCV_FEATURES)),
]

HEADER = """\
# Resources

Resources and clocks of the matcher alone (`gateware/matcher/matcher.py`, no DMA, no CPU), written by `make
resources`.

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
    return names.get(build.features, " ".join(name for name in FEATURES if name in build.features))

def cells_of(build: MatcherParameters) -> list:
    """Return the cells of a table that name the build."""
    return [build.disparities, build.max_block_size, name_of(build)]

def synthesized(family: str, build: MatcherParameters) -> Resources:
    """Return the resources of a build on a family, and print a line of progress."""
    result = resources(synthesize(emit(build), family), family)
    print(f"resources: {family}, {build.disparities} disparities, block {build.max_block_size}, {name_of(build)}: "
        f"{result}", flush=True)
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

def placement_row(case: tuple, result: Placement | None) -> list:
    """Return a placement, or that there is none."""
    device, constraint, build = case
    first = [f"LFE5U-{device.upper()[:-1]}F", *cells_of(build), constraint]
    if result is None:
        return [*first, "does not fit", "", "", "", ""]
    cells = [f"{used} of {result.sites[kind]} ({100*used//result.sites[kind]} %)" for kind, used in result.used.items()]
    return [*first, f"{result.mhz:.1f}", *cells]

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
    placed = [(device, constraint, build.disparities, build.max_block_size, sorted(build.features))
        for device, constraint, build in PLACEMENTS]
    return repr((FAMILIES, PRIMITIVES, PACKAGE, SPEED_GRADE, SEED, placed))

def key() -> str:
    """Return the content key of the page: the Verilog of all builds, the build's settings, and the tools."""
    builds  = {build for _, build in syntheses()} | {build for *_, build in PLACEMENTS}
    scripts = [settings_text(), FPGA_LOCK.read_text()]
    sources = [PACKAGE_DIR / one for one in ("gateware", "soc/flow", "soc/reports/resources.py", ".ci/lock/fpga.txt")]
    return computed_key("resources", sources, lambda: [*sorted(map(emit, builds)), *scripts])

PAGE = Page("docs/resources.md", "resources", key, minutes=60)

def document() -> str:
    """Return the document; build what is missing."""
    jobs = syntheses()
    with ThreadPoolExecutor(2) as pool:
        results = dict(zip(jobs, pool.map(lambda job: synthesized(*job), jobs)))
        placed  = list(pool.map(lambda case: fits(*case), PLACEMENTS))
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
    parts += [f"## Place and route on an ECP5\n\nThe matcher alone behind shift registers, package {PACKAGE}, speed "
        f"grade {SPEED_GRADE} (the slowest), seed {SEED}. A combinational site is a LUT4 or half a carry.\n",
        table(["device", "disparities", "block", "features", "constraint, MHz", "MHz", "combinational", "FF", "BRAM",
            "DSP"],
            [placement_row(case, result) for case, result in zip(PLACEMENTS, placed)])]
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
