#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Generate a board's sources: Verilog, constraints, and the headers and libraries for its programs.

A separate program, because LiteX changes the working directory, prints, and configures logging.
"""

import json
import shutil
import sys
from dataclasses import replace
from pathlib import Path

from ..boards        import OPEN_BOARDS, TOP, soc_class
from ..build.builder import StereoBuilder

# Scripts of the tools, which contain names of sources.
SCRIPTS = (".ys", ".tcl", ".prj")

# Comparisons with constants take LUTs: a chain of carries has two sites more than its bits.
YOSYS_OPTIONS = "-cmp2softlogic "

def gather_sources(gateware: Path, sources: list[str]) -> None:
    """Gather all sources in one folder, and make scripts name them without a path: some tools see only that folder."""
    for source in map(Path, sources):
        if source.parent != gateware:
            shutil.copy(source, gateware)
    for script in gateware.iterdir():
        if script.suffix in SCRIPTS:
            text = script.read_text()
            for source in sources:
                text = text.replace(source, Path(source).name)
            script.write_text(text.replace(f"{gateware}/", ""))

def nextpnr_options(toolchain) -> list[str]:
    """Return device, package and speed grade of LiteX's toolchain for an ECP5."""
    return [f"--{toolchain._architecture}", "--package", toolchain._package, "--speed", toolchain._speed_grade]

def generate(board: str, folder: Path, changes: dict) -> None:
    """Write LiteX's output for a board, with a preset changed by `changes`, to `folder`."""
    cls     = soc_class(board)
    preset  = replace(cls.preset, **changes)
    # The identifier would contain the date.
    soc     = cls(preset, ident_version=False)
    if board in OPEN_BOARDS:
        soc.platform.toolchain._synth_opts += YOSYS_OPTIONS
    builder = StereoBuilder(soc, folder)
    builder.build(run=False, build_name=TOP, **soc.build_options)
    gather_sources(folder / "gateware", [source for source, *_ in soc.platform.sources])
    (folder / "board.json").write_text(json.dumps({
        "board":   board,
        "device":  soc.platform.device,
        "family":  soc.family,
        "nextpnr": nextpnr_options(soc.platform.toolchain) if board in OPEN_BOARDS else None,
        "preset":  {**vars(preset), "features": list(preset.features)},
        "flash":   {"offset": soc.flash_offset, "bytes": soc.flash_image_bytes, "images": soc.flash_images},
        "rom":     soc.rom_bytes,
    }, indent=4))

if __name__ == "__main__":
    board, folder, changes = sys.argv[1:]
    generate(board, Path(folder), json.loads(changes))
