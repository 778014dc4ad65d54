#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Table 5.4: resources, by Yosys, and clocks, by nextpnr."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

from ...soc.build.pages import FPGA_LOCK
from ...soc.flow.place import PACKAGE, SEED, SPEED_GRADE, place
from ...soc.flow.synthesis import FAMILIES as COMMANDS
from ...soc.flow.synthesis import PRIMITIVES, emit, resources, synthesize
from ...soc.reports.markdown import table, tools
from ...soc.reports.resources import PLACEMENTS
from .presets import BARE, Preset, Scale
from .section import Section

#: Families: that of the board of the thesis, and the one that open tools place and route.
FAMILIES = ("Spartan-6", "ECP5")

#: ECP5 on which presets are placed, and the clock that is constrained: those of resources.md.
DEVICE, CONSTRAINT_MHZ = PLACEMENTS[0][:2]

#: Most disparities that are placed, without further stages: more take too long for a page that is often remade.
MOST_PLACED = 64


def placed_by() -> list[str]:
    """Return what synthesis, place and route depend on, apart from the Verilog."""
    return [repr((COMMANDS, PRIMITIVES, PACKAGE, SPEED_GRADE, SEED)), FPGA_LOCK.read_text()]


def placed_mhz(scale: Scale, preset: Preset) -> float | None:
    """Return the clock, in MHz, that a preset reaches on the ECP5; None if it is not placed. Raise as `place` does."""
    if preset.features != BARE or preset.disparities > MOST_PLACED:
        return None
    return round(place(DEVICE, CONSTRAINT_MHZ, preset.parameters(scale.width)).mhz, 1)


def measure_resources(scale: Scale, folder: Path) -> dict[str, Any]:
    """Return the resources of each preset on each family, and its clock."""
    rows = []
    for preset in scale.presets:
        for family in FAMILIES:
            found = resources(synthesize(emit(preset.parameters(scale.width)), family), family)
            rows.append({"name": preset.name, "family": family, "mhz": None} | asdict(found))
        rows[-1]["mhz"] = placed_mhz(scale, preset)
    return {"rows": rows, "tools": tools(), "width": scale.width}


def fields(result: dict[str, Any]) -> dict[str, object]:
    """Return the fields of the table."""
    header = ["configuration", "family", "LUT sites", "LUT cells", "FF", "BRAM", "DSP", "clock, MHz"]
    rows   = [[row["name"], row["family"], row["lut"], row["cells"], row["ff"], f"{row['bram']:g}", row["dsp"],
               row["mhz"] or ""] for row in result["rows"]]
    return {"table": table(header, rows), "tools": result["tools"], "width": result["width"], "most": MOST_PLACED,
            "device": f"LFE5U-{DEVICE.upper()[:-1]}F", "package": PACKAGE, "grade": SPEED_GRADE,
            "constraint": CONSTRAINT_MHZ}


SECTIONS = [
    Section("Table 5.4", "resources", """\
The matcher alone, for images {width} pixels wide, without CPU, memory and link; [resources.md](resources.md)
defines the columns and has more builds. The Spartan-6 is the family of the board of the thesis. There is no open
place and route for it, so it has no clock here. The clock is that of an {device} ({package}, speed grade {grade},
the slowest), with a constraint of {constraint} MHz. Only matchers without further stages are placed, of up to
{most} disparities; [resources.md](resources.md#place-and-route-on-an-ecp5) has a matcher with all stages. {tools}.

{table}""", measure_resources, fields, Scale.narrow, more=placed_by),
]
