#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Handwritten registers, of the tests' csr.h and of missing hardware, against those that LiteX generates."""

import re

from litex.soc.cores.bitbang import SPIMaster
from litex.soc.cores.watchdog import Watchdog
from litex.soc.integration.soc import SoCController
from migen import Signal

from litestereo.gateware.peripherals.frame_link import FrameLink
from litestereo.soc.parts.reset_record import ResetRecord
from litestereo.soc.reports.registers import default_peripheral, fields_of, wishbone_ports
from support.paths import CHECKOUT

FIRMWARE  = CHECKOUT / "firmware"
STUB      = (FIRMWARE / "tests" / "stubs" / "generated" / "csr.h").read_text()
SUBSTITUTES = (FIRMWARE / "drivers" / "registers.h").read_text()

#: Peripherals by their names in the SoC; the screen is LiteX's, and the driver uses none of its fields.
PERIPHERALS = {
    "ctrl":         SoCController,
    "flash":        SPIMaster,
    "frame_link":   lambda: FrameLink(*wishbone_ports(), 19539, streaming=True),
    "reset_record": ResetRecord,
    "stereo":       default_peripheral,
    "watchdog0":    lambda: Watchdog(32, Signal(), 10),
}


def registers():
    """Return the names of all registers, and the macros of LiteX's csr.h for all fields."""
    names, macros = set(), {}
    for peripheral, make in PERIPHERALS.items():
        for csr in make().get_csrs():
            names.add(f"{peripheral}_{csr.name}")
            for field in fields_of(csr):
                macro = f"CSR_{peripheral}_{csr.name}_{field.name}".upper()
                macros |= {f"{macro}_OFFSET": field.offset, f"{macro}_SIZE": field.size}
    return names, macros


def defined(text):
    """Return the macros of fields that a header defines, and their values."""
    return {name: int(value) for name, value in re.findall(r"#define (CSR_\w+_(?:OFFSET|SIZE))\s+(\d+)", text)}


def test_fields_of_the_stub():
    _, macros = registers()
    stub = defined(STUB)
    assert len(stub) > 40
    assert stub == {name: macros.get(name) for name in stub}


def test_registers_of_the_stub():
    names, _ = registers()
    functions = set(re.findall(r"(\w+)_(?:read|write)\(", STUB))
    assert len(functions) > 70
    assert {name for name in functions if not name.startswith(("uart_", "video_"))} <= names


def test_substitutes():
    """The substitutes for missing hardware have registers and fields with the names of the real ones."""
    names, macros = registers()
    functions = set(re.findall(r"^(?:READS|READS_AS|WRITES)\((\w+)", SUBSTITUTES, re.MULTILINE))
    assert len(functions) > 50
    assert {name for name in functions if not name.startswith("video_")} <= names
    assert len(defined(SUBSTITUTES)) > 20
    assert set(defined(SUBSTITUTES)) <= set(macros)


def test_every_field_in_use_is_in_the_stub():
    """The stub has all fields that the drivers use, so the test above compares them all."""
    text = "".join(path.read_text() for path in (FIRMWARE / "drivers").glob("*.[ch]") if path.name != "registers.h")
    used = set(re.findall(r"REGISTER_(?:BIT|FIELD)\((\w+)", text)) - {"STEREO_FEATURES_"}
    assert len(used) > 30
    assert {f"CSR_{name}_OFFSET" for name in used} <= set(defined(STUB))
