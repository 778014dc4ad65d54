#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Refuse a bitstream whose clocks are too slow, that is older than its sources, or too large for its flash."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

from ..boards      import OPEN_BOARDS, VENDOR_TOOLS
from ..build.paths import build_directory
from ..build.tools import ToolError
from .bitstream    import placement_key
from .flash_room   import check_room
from .sources      import sources

def clock_name(net: str) -> str:
    """Return a clock's name without nextpnr's prefix and suffix."""
    return re.sub(r"^\$glbnet\$|\$TRELLIS_IO_IN$", "", net)

def check_clocks(board: str, report: dict) -> None:
    """Raise ToolError if a clock of nextpnr's report does not reach its constraint, or if there is none."""
    if not report["fmax"]:
        raise ToolError(f"{board}: the report has no clocks")
    for net, clock in report["fmax"].items():
        if clock["achieved"] < clock["constraint"]:
            reached = f"{clock['achieved']:.1f} MHz of {clock['constraint']:.1f} MHz"
            raise ToolError(f"{board}: {clock_name(net)} reaches {reached}: another --seed, or a smaller preset")

def delivered(board: str, folder: Path | None = None) -> dict:
    """Return what `build` wrote for a board; raise ToolError if there is nothing."""
    path = (folder or build_directory()) / board / "report.json"
    if not path.is_file():
        raise ToolError(f"{board} is not built: run make bitstream BOARD={board}")
    return json.loads(path.read_text())

def changes(board: dict, preset) -> dict:
    """Return the differences between the preset of a build and the board's preset."""
    return {name: value for name, value in board["preset"].items()
        if json.loads(json.dumps(getattr(preset, name))) != value}

def check(board: str, key: str, built: dict) -> None:
    """Raise ToolError unless the build is of the current sources, and meets all of its clocks."""
    if built["key"] != key:
        raise ToolError(f"{board}: the bitstream is older than its sources: run make bitstream BOARD={board}")
    check_clocks(board, built["report"])

def main() -> int:
    """Check the boards of the command line, or all; return the exit status."""
    status = 0
    for board in sys.argv[1:] or OPEN_BOARDS:
        try:
            if board in VENDOR_TOOLS:
                raise ToolError(f"{board}: its bitstream is made, and checked, by {VENDOR_TOOLS[board]}")
            built = delivered(board)
            check(board, placement_key(sources(board)), built)
            check_room(build_directory() / board / f"{board}.bit", built["flash"]["offset"])
            print(f"{board}: every clock is met, the bitstream is of these sources, and ends before the firmware")
        except ToolError as error:
            print(f"boards: error: {error}", file=sys.stderr)
            status = 1
    return status

if __name__ == "__main__":
    sys.exit(main())
