#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Generates a board's sources: Verilog, constraints, and the headers and libraries for its programs.

A program of its own, as LiteX changes the working directory, prints, and configures logging.
"""

import json
import shutil
import sys
from dataclasses import replace
from pathlib import Path

from litex.soc.integration.builder import Builder

from . import soc_class

LIBRARIES = ["libc", "libcompiler_rt", "libbase", "liblitedram"]

# Name of the top level and of all files of the gateware.
TOP = "top"

def generate(board: str, folder: Path, changes: dict) -> None:
    """Write LiteX's output for a board, with a preset changed by `changes`, to `folder`."""
    cls     = soc_class(board)
    preset  = replace(cls.preset, **changes)
    # The identifier would hold the date.
    soc     = cls(preset, ident_version=False)
    builder = Builder(soc, output_dir=str(folder), csr_json=str(folder / "csr.json"))
    builder.software_packages  = [(name, path) for name, path in builder.software_packages if name in LIBRARIES]
    builder.software_libraries = [library for library in builder.software_libraries if library in LIBRARIES]
    # Without wide functions, which take LUTs in pairs.
    builder.build(run=False, build_name=TOP, nowidelut=True, timingstrict=True)
    # The tools see nothing but the folder that they run in.
    gateware = folder / "gateware"
    script   = (gateware / f"{TOP}.ys").read_text()
    for source, *_ in soc.platform.sources:
        if Path(source).parent != gateware:
            shutil.copy(source, gateware)
        script = script.replace(source, Path(source).name)
    (gateware / f"{TOP}.ys").write_text(script)
    toolchain = soc.platform.toolchain
    (folder / "board.json").write_text(json.dumps({
        "board":   board,
        "device":  soc.platform.device,
        "nextpnr": [f"--{toolchain._architecture}", "--package", toolchain._package, "--speed", toolchain._speed_grade],
        "preset":  {**vars(preset), "features": list(preset.features)},
        "flash":   {"offset": soc.flash_offset, "bytes": soc.flash_image_bytes, "images": soc.flash_images},
        "rom":     soc.rom_bytes,
    }, indent=4))

if __name__ == "__main__":
    board, folder, changes = sys.argv[1:]
    generate(board, Path(folder), json.loads(changes))
