#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""List the boards and their presets, and write docs/boards.md from the reports of place and route."""

from __future__ import annotations

import sys

from ..boards         import BOARDS, OPEN_BOARDS, VENDOR_TOOLS, soc_class
from ..build.pages    import Page
from ..build.paths    import content_key
from ..build.tools    import ToolError
from ..flow           import vendor
from ..flow.bitstream import placement_key
from ..flow.check     import changes, check, check_clocks, clock_name, delivered
from ..flow.sources   import sources
from ..flow.synthesis import Resources
from .markdown        import table
from .published       import PEERS


HEADER = """\
# Boards

Bitstreams of the whole system. `make boards-doc` writes this page from nextpnr's reports of the bitstreams that
`make bitstream BOARD=...` has built on the same computer. A build that misses a clock is an error and leaves no
bitstream. Wiring and first steps are on the page of each board.
"""

SITES = {"TRELLIS_COMB": "combinational", "TRELLIS_FF": "FF", "DP16KD": "block RAM", "MULT18X18D": "DSP"}

def preset_row(board: str) -> list:
    """Return a board and its preset as a row."""
    preset = soc_class(board).preset
    return [board, preset.disparities, preset.max_block_size, ", ".join(preset.features), preset.cpu_variant,
        f"{preset.sys_clk_freq/1e6:g}", f"{preset.pixels_per_second/1e6:g}", f"{preset.frames_per_second:.1f}"]

PRESET_COLUMNS = ["board", "disparities", "block", "features", "VexRiscv", "system, MHz", "matcher, MHz",
    "frames per second"]

def preset_text() -> str:
    """Return a description of each board's configuration."""
    return table(PRESET_COLUMNS, [preset_row(board) for board in BOARDS])

def site_row(board: str, built: dict) -> list:
    """Return the resources of a board's bitstream as a row."""
    sites = built["report"]["utilization"]
    pairs = [(sites[kind]["used"], sites[kind]["available"]) for kind in SITES]
    cells = [f"{used} of {available} ({100*used//available} %)" for used, available in pairs]
    return [f"[{board}](boards/{board}.md)", built["device"], *cells, built["preset"]["seed"], f"`{built['key']}`",
        f"`{built['commit']}`"]

def clock_rows(board: str, built: dict) -> list[list]:
    """Return the clocks of a board's bitstream as rows."""
    return [[board, f"`{clock_name(net)}`", f"{clock['constraint']:.1f}", f"{clock['achieved']:.1f}"]
        for net, clock in sorted(built["report"]["fmax"].items())]

VENDOR_TEXT = """\
Sources, constraints, boot program and firmware are built as for the other boards. The tool named here builds the
bitstream. None of these tools has been run, so it is not known whether the clocks are met. Yosys counts the whole
SoC before placement.
"""

COUNT_COLUMNS = ["board", "tool", "sites of logic", "FF", "block RAM", "DSP"]

def count_row(board: str, counted: Resources) -> list:
    """Return Yosys's counts of a board as a row."""
    there = vendor.AVAILABLE[board]
    cells = [f"{getattr(counted, kind):g} of {getattr(there, kind)}" for kind in ("lut", "ff", "bram", "dsp")]
    return [f"[{board}](boards/{board}.md)", VENDOR_TOOLS[board], *cells]

PEER_TEXT = """\
## Others

Figures of other systems are from their publications, at their own settings. Most of them do more than block
matching, and cost more. Our figures follow from the clock, at one pixel per clock; they were not measured on
boards.
"""

PEER_COLUMNS = ["system", "method", "images", "disparities", "frames per second", "million disparities per second",
    "device"]

def peer_rows(builds: dict[str, dict]) -> list[list]:
    """Return the boards and published systems as rows, by the disparities evaluated per second."""
    rows = [(peer.evaluations, [peer.name, peer.method, f"{peer.width} x {peer.height}", peer.disparities,
        f"{peer.frames:g}", f"{peer.evaluations/1e6:,.0f}", peer.device]) for peer in PEERS]
    for board, built in builds.items():
        preset = soc_class(board).preset
        rate   = preset.disparities*preset.pixels_per_second
        rows.append((rate, [f"**LiteStereo, {board}**", "XSobel, SAD", "640 x 480", preset.disparities,
            f"{preset.frames_per_second:.1f}", f"{rate/1e6:,.0f}", built["device"]]))
    return [row for _, row in sorted(rows, key=lambda item: -item[0])]

def document(builds: dict[str, dict], counted: dict[str, Resources]) -> str:
    """Return the document, from the builds of each board, and Yosys's counts of those in `VENDOR_TOOLS`.

    Raises
    ------
    ToolError
        A build misses a clock.
    """
    for board, built in builds.items():
        check_clocks(board, built["report"])
    absent = [board for board in OPEN_BOARDS if board not in builds]
    clocks = [row for board, built in builds.items() for row in clock_rows(board, built)]
    tools  = sorted({tool for built in builds.values() for tool in built["tools"]})
    return "\n".join([HEADER,
        "## Presets\n\nFrames of 640 x 480 at one pixel per clock. Memory and link may allow fewer. "
        "[accuracy.md](accuracy.md) says how good the maps of each preset are.\n", preset_text(),
        "## Sites\n\nA combinational site is a LUT4 or half a carry. The key is a hash of all inputs of the bitstream; "
        "`make boards-check` compares it with that of the sources.\n",
        table(["board", "device", *SITES.values(), "seed", "key", "commit"],
            [site_row(*item) for item in builds.items()]),
        "## Clocks\n", table(["board", "clock", "needed, MHz", "reached, MHz"], clocks),
        f"Without a bitstream that passes, on that computer: {', '.join(absent) or 'none'}.\n",
        f"## Boards of other tools\n\n{VENDOR_TEXT}",
        table(COUNT_COLUMNS, [count_row(*item) for item in counted.items()]),
        PEER_TEXT, table(PEER_COLUMNS, peer_rows(builds)),
        f"Tools: {'; '.join(tools) or 'none used'}.\n"])

def key() -> str:
    """Return the content key of the page: those of all bitstreams, and of what Yosys counts."""
    return content_key([*(placement_key(sources(board)) for board in OPEN_BOARDS),
        *(vendor.counts_key(sources(board)) for board in VENDOR_TOOLS)])

PAGE = Page("docs/boards.md", "boards-doc", key, minutes=120)

def main() -> int:
    """Print the presets for `list`, else write the document; return the exit status: 1 if a board is missing."""
    if sys.argv[1:] == ["list"]:
        print(preset_text())
        return 0
    builds = {}
    for board in OPEN_BOARDS:
        try:
            built = delivered(board)
            if changes(built, soc_class(board).preset):
                raise ToolError(f"{board} was built with another preset: run make bitstream BOARD={board}")
            check(board, placement_key(sources(board)), built)
            builds[board] = built
        except ToolError as error:
            print(f"boards: left out: {error}", file=sys.stderr)
    text = document(builds, {board: vendor.counts(sources(board)) for board in VENDOR_TOOLS})
    if len(builds) == len(OPEN_BOARDS):
        PAGE.write(text)
    else:
        # Not of all boards: the page is stale until all are built.
        PAGE.path.write_text(text)
    print(PAGE.path.read_text())
    return 0 if len(builds) == len(OPEN_BOARDS) else 1

if __name__ == "__main__":
    sys.exit(main())
