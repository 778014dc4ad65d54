#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What the linker puts into the fast RAM of a board: it is copied there at start, and no DMA has to reach it."""

import subprocess

import pytest

from litestereo.soc.boards import BOARDS, soc_class
from litestereo.soc.flow.sources import sources
from litestereo.soc.parts.stereo_soc import FAST_RAM_ORIGIN

FAST_BOARDS = [board for board in BOARDS if soc_class(board).preset.fast_ram_bytes]

pytestmark = [pytest.mark.system, pytest.mark.long]


def symbols(elf):
    """Return the addresses of all symbols of a program."""
    lines = subprocess.run(["riscv64-unknown-elf-nm", elf], check=True, capture_output=True, text=True).stdout
    return {name: int(address, 16) for address, _, name in (line.split() for line in lines.splitlines())}


def check(board):
    """Check where the firmware of a board is."""
    size  = soc_class(board).preset.fast_ram_bytes
    found = symbols(sources(board).firmware.with_suffix(".elf"))

    def is_fast(name):
        return size > 0 and FAST_RAM_ORIGIN <= found[name] < FAST_RAM_ORIGIN + size

    for name in ("app", "app_poll", "session_handle", "crc32_update"):
        assert is_fast(name) == (size > 0), name
    # Entry, and what gateware reads and writes.
    for name in ("_start", "buffers", "main"):
        assert not is_fast(name), name
    # All that crt0 copies has its place in the image, which begins at _start.
    assert found["_start"] <= found["_fdata_rom"]
    assert found["_fdata_rom"] + found["_edata"] - found["_fdata"] <= found["_end"]


@pytest.mark.parametrize("board", FAST_BOARDS)
def test_firmware_of_a_fast_board(board):
    """Code and variables are in the fast RAM, buffers are not."""
    check(board)


def test_firmware_of_a_board_without():
    """All is in main RAM."""
    check("colorlight_i5")
