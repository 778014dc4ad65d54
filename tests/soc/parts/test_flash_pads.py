#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""A flash's pins in the emitted Verilog: their order, and that the pins of the wider modes are held high."""

from __future__ import annotations

import re

from litex.gen import LiteXModule
from litex.gen.fhdl import verilog
from litex.soc.cores.bitbang import SPIMaster
from migen import ClockDomain, Record

from litestereo.soc.parts.flash_pads import FlashPads


class Top(LiteXModule):
    """A flash as `BoardSoC.add_flash` connects it."""
    def __init__(self, pads):
        self.cd_sys = ClockDomain("sys")
        self.pads   = FlashPads(pads)
        self.flash  = SPIMaster(self.pads)


def emitted(*layout):
    pads = Record([("clk", 1), ("cs_n", 1), *layout], name="flash")
    top  = Top(pads)
    text = str(verilog.convert(top, ios={top.cd_sys.clk, top.cd_sys.rst, *pads.flatten()}, name="top"))
    return [" ".join(line.split()) for line in text.splitlines()]


def reads(lines):
    """Return the pin that the flash's answer is read from."""
    return [line.split(" = ")[1].rstrip(";") for line in lines if re.match(r"assign flash_miso\d* = ", line)]


def test_four_data_pins():
    """dq[0] goes to the flash, dq[1] comes from it; dq[2] and dq[3] would protect and hold it, if low."""
    lines = emitted(("dq", 4))
    assert any(line.startswith("inout wire [3:0] flash_dq") for line in lines)
    driven = [line for line in lines if line.startswith(("assign flash_dq", "flash_dq"))]
    assert [line.split(" = ")[0] for line in driven] == [f"assign flash_dq[{pin}]" for pin in (2, 3, 0)]
    assert driven[0].endswith("1'd1 ? 1'd1 : 1'bz;") and driven[1].endswith("1'd1 ? 1'd1 : 1'bz;")
    assert reads(lines) == ["flash_dq[1]"]


def test_named_pins():
    """Pins have their names; `wp` and `hold` are driven where the board has them."""
    lines = emitted(("mosi", 1), ("miso", 1), ("wp", 1), ("hold", 1))
    assert {"assign flash_wp = 1'd1;", "assign flash_hold = 1'd1;"} <= set(lines)
    assert reads(lines) == ["flash_miso"]
    few = emitted(("mosi", 1), ("miso", 1))
    assert reads(few) == ["flash_miso"]
    assert not any("flash_wp" in line or "flash_hold" in line for line in few)
