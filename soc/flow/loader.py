#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Bring a build to a board, with openFPGALoader."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

from ..boards      import VENDOR_TOOLS, soc_class
from ..build.paths import build_directory
from ..build.tools import ToolError
from .             import vendor
from .flash_room   import check_room

def built(board: str) -> Path:
    """Return the folder of a board's bitstream; raise ToolError if there is none."""
    folder = build_directory() / board
    if not (folder / "report.json").is_file():
        raise ToolError(f"{board} is not built: run make bitstream BOARD={board}")
    return folder

def bitstream(board: str) -> Path:
    """Return the path of a board's bitstream; raise ToolError if the vendor's tool has yet to make it."""
    if board not in VENDOR_TOOLS:
        return built(board) / f"{board}.bit"
    built(board)
    if not (path := vendor.bitstream_path(board)).is_file():
        raise ToolError(f"{path} is not there: {VENDOR_TOOLS[board]} makes it, see docs/boards/{board}.md")
    return path

def run_loader(board: str, *arguments: str) -> None:
    """Run openFPGALoader for a board, with its output on the terminal. Raise ToolError if it fails."""
    if soc_class(board).loader is None:
        raise ToolError(f"openFPGALoader does not know the {board}: docs/boards/{board}.md says what does")
    if (program := shutil.which("openFPGALoader")) is None:
        raise ToolError("openFPGALoader is not installed: run .ci/install fpga")
    if subprocess.run([program, "--board", soc_class(board).loader, *arguments], check=False).returncode:
        raise ToolError(f"openFPGALoader did not reach the {board}: is it connected, and may you use its USB device?")

def load(board: str) -> None:
    """Load the bitstream into the FPGA; the firmware comes from the flash."""
    run_loader(board, str(bitstream(board)))

def flash(board: str) -> None:
    """Write the bitstream and each image of the firmware to the flash."""
    folder = built(board)
    place  = json.loads((folder / "report.json").read_text())["flash"]
    path   = bitstream(board)
    check_room(path, place["offset"]) # openFPGALoader says that a file is not there.
    run_loader(board, "--write-flash", str(path))
    for image in range(place["images"]):
        offset = place["offset"] + image*place["bytes"]
        run_loader(board, "--write-flash", "--offset", str(offset), str(folder / "firmware.bin"))
