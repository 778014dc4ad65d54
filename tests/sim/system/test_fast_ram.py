#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What the linker puts into the fast RAM of a SoC: it is copied there at start, and no DMA has to reach it."""

import subprocess

import pytest

from litestereo.sim.system.build import build_firmware, build_soc
from litestereo.soc.parts.stereo_soc import FAST_RAM_ORIGIN

pytestmark = [pytest.mark.system, pytest.mark.long]

#: Functions that run for each message, and variables with FAST_DATA.
FAST = ("app", "app_poll", "session_handle", "crc32_update")

#: Entry, what gateware reads and writes, and what runs once.
SLOW = ("_start", "buffers", "main")


def symbols(memory):
    """Return the addresses of all symbols of the firmware for a simulated SoC."""
    elf   = build_firmware(build_soc(memory)).with_suffix(".elf")
    lines = subprocess.run(["riscv64-unknown-elf-nm", elf], check=True, capture_output=True, text=True).stdout
    return {name: int(address, 16) for address, _, name in (line.split() for line in lines.splitlines())}


def is_fast(address):
    return FAST_RAM_ORIGIN <= address < FAST_RAM_ORIGIN + 40*1024


def test_soc_with_fast_ram():
    """Code and variables are in the fast RAM, buffers are not; all that crt0 copies has its place in the image."""
    found = symbols("sdram")
    assert all(is_fast(found[name]) for name in FAST)
    assert not any(is_fast(found[name]) for name in SLOW)
    assert found["_start"] <= found["_fdata_rom"]
    assert found["_fdata_rom"] + found["_edata"] - found["_fdata"] <= found["_end"]


def test_soc_without():
    """All is in main RAM."""
    found = symbols("integrated-ram")
    assert not any(is_fast(found[name]) for name in (*FAST, *SLOW))
