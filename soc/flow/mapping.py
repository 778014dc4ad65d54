#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Edit Verilog and netlist so that the tools spend no logic on guarantees that this design does not need."""

from __future__ import annotations

import json
import re
from collections import Counter
from pathlib import Path

# Memories of which no word is read in the clock in which it is written, or is not used then. Verilog promises the old
# word, a block RAM does not, and Yosys compensates with a comparator, registers and multiplexers around each.
# `storage` is the memory of LiteX's FIFOs. Simulations of cores get garbage in place of such words.
COLLISION_FREE = ("storage", "column_sums", "line_buffer", "prefilter_rows", "costs", "median_rows", "message_buffer",
    "row_ring", "map_nodes")

_DECLARATION = re.compile(rf"^reg \[\d+:0\] ((?:{'|'.join(COLLISION_FREE)})(?:_\d+)?)\[0:", re.MULTILINE)

def without_collision_logic(verilog: str) -> str:
    """Return Verilog that tells Yosys of the memories in `COLLISION_FREE`."""
    return _DECLARATION.sub(r"(* no_rw_check *) \g<0>", verilog)

def with_garbage(verilog: str) -> str:
    """Return Verilog for a simulation: memories in `COLLISION_FREE` give inverted words where words collide."""
    for name in _DECLARATION.findall(verilog):
        write = re.search(rf"if \((\w+)\)\n\s*{name}\[(\w+)\] <=", verilog)
        if write is None:
            raise ValueError(f"no port that writes {name} whole words")
        enable, target = write.groups()
        verilog = re.sub(rf"({name}_dat\d+) <= {name}\[(?!{target}\])(\w+)\];",
            rf"\1 <= ({enable} & (\2 == {target})) ? ~{name}[\2] : {name}[\2];", verilog)
    return verilog

def without_open_carries(netlist: Path) -> None:
    """Disconnect carries of an ECP5 netlist, as JSON, that nothing reads: nextpnr takes a LUT, two sites, for each."""
    design = json.loads(netlist.read_text())
    for module in design["modules"].values():
        read = _readers(module)
        for cell in module["cells"].values():
            if cell["type"] == "CCU2C" and not any(read[bit] for bit in cell["connections"].get("COUT", [])):
                cell["connections"]["COUT"] = ["x"]
    netlist.write_text(json.dumps(design))

def without_fed_carries(netlist: Path) -> None:
    """Begin the chains of carries of an ECP5 netlist, as JSON, in their first bit.

    Yosys begins a chain with a carry of 0 or 1, and nextpnr takes two sites to feed it in. Here the first bit, A op B
    without a carry before it, makes its own: A and B in a sum, A or not B in a difference. Its result, A xor B in both,
    is a LUT, if anything reads it.

    Raises
    ------
    ValueError
        A chain that begins with a constant is not as Yosys 0.70 maps sums and differences.
    """
    design = json.loads(netlist.read_text())
    for module in design["modules"].values():
        read  = _readers(module)
        heads = [(name, cell) for name, cell in module["cells"].items()
            if cell["type"] == "CCU2C" and cell["connections"]["CIN"][0] in ("0", "1")]
        for name, cell in heads:
            nets, parameters = cell["connections"], cell["parameters"]
            carry = nets["CIN"][0]
            if (parameters["INIT0"], nets["C0"], nets["D0"]) != (SUM_INIT, [carry], ["1"]):
                raise ValueError(f"{netlist}: the carries of {name} do not begin as Yosys 0.70 maps them; "
                    "mend without_fed_carries, or leave it out")
            (result,) = nets["S0"]
            if read[result]:
                module["cells"][f"{name}_first"] = _lut(nets["A0"], nets["B0"], result)
            parameters["INIT0"] = FIRST_INIT[carry]
            nets["CIN"] = nets["S0"] = ["x"]
    netlist.write_text(json.dumps(design))

def with_global_resets(netlist: Path) -> None:
    """Give resets of an ECP5 netlist, as JSON, that are registers and have many flip-flops a global network each.

    nextpnr promotes clocks alone. As a common net, a reset has an arc for each of thousands of flip-flops, all of them
    into the two wires that a tile has for resets and for the writing of distributed RAM. There its router took wires
    from one arc for the next and back for an hour, and ended or not by the seed.
    """
    design = json.loads(netlist.read_text())
    for module in design["modules"].values():
        cells  = module["cells"]
        resets = Counter(bit for cell in cells.values() if cell["type"] == "TRELLIS_FF"
            for bit in cell["connections"].get("LSR", []))
        many   = [cell["connections"]["Q"][0] for cell in cells.values()
            if cell["type"] == "TRELLIS_FF" and resets[cell["connections"]["Q"][0]] >= GLOBAL_RESETS]
        free   = 1 + max((bit for cell in cells.values() for bits in cell["connections"].values() for bit in bits
            if isinstance(bit, int)), default=1)
        moved  = {bit: free + number for number, bit in enumerate(many)}
        for cell in cells.values():
            if cell["type"] == "TRELLIS_FF" and "LSR" in cell["connections"]:
                cell["connections"]["LSR"] = [moved.get(bit, bit) for bit in cell["connections"]["LSR"]]
        for bit, driven in moved.items():
            cells[f"global_reset_{bit}"] = _global_buffer(bit, driven)
    netlist.write_text(json.dumps(design))

# Flip-flops from which on a reset has a global network: there are 16 of these, and a design has few such resets.
GLOBAL_RESETS = 1000

# Contents of the LUT of a bit, as Yosys maps it: its result without the carry, and the carry that it makes itself, A.
SUM_INIT = "1001011010101010"

# The same of a first bit: the carry before it never passes, and it makes that of a sum, of a difference.
FIRST_INIT = {"0": "0000000000001000", "1": "0000000000001011"}

def _readers(module: dict) -> Counter:
    """Return how many inputs and pins read each net."""
    read = Counter(bit for port in module["ports"].values() for bit in port["bits"])
    for cell in module["cells"].values():
        for port, bits in cell["connections"].items():
            if cell["port_directions"].get(port) != "output":
                read.update(bits)
    return read

def _lut(a: list, b: list, z: object) -> dict:
    """Return the cell of a LUT4 with A xor B."""
    return {
        "hide_name":       0,
        "type":            "LUT4",
        "parameters":      {"INIT": "0110011001100110"},
        "attributes":      {},
        "port_directions": {"A": "input", "B": "input", "C": "input", "D": "input", "Z": "output"},
        "connections":     {"A": a, "B": b, "C": ["0"], "D": ["0"], "Z": [z]},
    }

def _global_buffer(net: int, driven: int) -> dict:
    """Return the cell of a buffer from a net onto a global network."""
    return {
        "hide_name":       0,
        "type":            "DCCA",
        "parameters":      {},
        "attributes":      {},
        "port_directions": {"CLKI": "input", "CE": "input", "CLKO": "output"},
        "connections":     {"CLKI": [net], "CE": ["1"], "CLKO": [driven]},
    }
