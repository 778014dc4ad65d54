#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Refuse a bitstream that reaches into the firmware's images: both are in one flash, the bitstream first."""

from __future__ import annotations

import re
from pathlib import Path

from ..boards      import soc_class
from ..build.tools import ToolError

# Bits of the uncompressed bitstreams that the vendors' tools write for any design, by the configuration guides.
VENDOR_BITS = {
    "tang_primer_20k": 887*1024*8, # GW2A-18: UG290, table 6-1, in KBytes.
    "arty":            17536096,   # XC7A35T: UG470, table 1-1.
    "atlys":           11939296,   # XC6SLX45: UG380, table 5-5.
}

def flash_bytes(path: Path) -> int:
    """Return the bytes of flash that a bitstream needs; Gowin's `.fs` is text, with a character per bit."""
    if path.suffix != ".fs":
        return path.stat().st_size
    bits = re.sub(r"//.*", "", path.read_text())
    return (bits.count("0") + bits.count("1") + 7)//8

def check_size(what: str, size: int, offset: int) -> None:
    """Raise ToolError if a bitstream of `size` bytes, which begins at address 0, reaches the images at `offset`."""
    if size > offset:
        raise ToolError(f"{what} has {size} bytes, but the firmware's images begin at {offset}: set a larger "
                        "flash_offset for the board")

def check_room(path: Path, offset: int) -> None:
    """Raise ToolError if a bitstream reaches into the firmware's images; one that is not there does not."""
    if path.is_file():
        check_size(path.name, flash_bytes(path), offset)

def check_vendor_room(board: str) -> None:
    """Raise ToolError if the bitstream that a vendor's tool will write reaches into the firmware's images."""
    check_size(f"the bitstream of the {board}", (VENDOR_BITS[board] + 7)//8, soc_class(board).flash_offset)
