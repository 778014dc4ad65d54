#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Boards: `StereoSoC` on real hardware, and what is built for each."""

from importlib import import_module

# Name of the top level and of all files of the gateware.
TOP = "top"

# Class of each board's SoC, in the module of the board's name; loaded on demand, because LiteX is slow to import.
BOARDS = {
    "colorlight_i5":   "ColorlightI5",
    "colorlight_i9":   "ColorlightI9",
    "ulx3s":           "ULX3S",
    "ecpix5":          "ECPIX5",
    "tang_primer_20k": "TangPrimer20k",
    "arty":            "Arty",
    "atlys":           "Atlys",
}

# Boards whose bitstream the vendor's tool makes, with the tool's name.
VENDOR_TOOLS = {
    "tang_primer_20k": "Gowin EDA",
    "arty":            "Vivado",
    "atlys":           "ISE",
}

# Boards whose bitstream Yosys and nextpnr make.
OPEN_BOARDS = [board for board in BOARDS if board not in VENDOR_TOOLS]

def soc_class(board):
    """Return the class of a board's SoC, which has its `preset`."""
    return getattr(import_module(f".{board}", __name__), BOARDS[board])
