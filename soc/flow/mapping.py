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
        read = Counter(bit for port in module["ports"].values() for bit in port["bits"])
        for cell in module["cells"].values():
            for port, bits in cell["connections"].items():
                if cell["port_directions"].get(port) != "output":
                    read.update(bits)
        for cell in module["cells"].values():
            if cell["type"] == "CCU2C" and not any(read[bit] for bit in cell["connections"].get("COUT", [])):
                cell["connections"]["COUT"] = ["x"]
    netlist.write_text(json.dumps(design))
