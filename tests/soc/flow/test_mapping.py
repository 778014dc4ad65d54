#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Hints for Yosys and nextpnr: memories whose ports never collide, unread carries, first carries, resets."""

import json
import random

import pytest

from litestereo.soc.flow.mapping import (
    GLOBAL_RESETS,
    SUM_INIT,
    with_garbage,
    with_global_resets,
    without_collision_logic,
    without_fed_carries,
    without_open_carries,
)

MEMORY = """\
reg [7:0] {name}[0:15];
reg [7:0] {name}_dat0;
reg [7:0] {name}_dat1;
always @(posedge sys_clk) begin
	if (write_we)
		{name}[write_adr] <= write_dat_w;
	{name}_dat0 <= {name}[write_adr];
end
always @(posedge sys_clk) begin
	{name}_dat1 <= {name}[read_adr];
end
"""


@pytest.mark.parametrize("name", ["storage", "storage_12", "column_sums_3"])
def test_memories_without_collisions(name):
    """Yosys gets the hint, and in simulation a collision corrupts the word at the read port."""
    verilog = MEMORY.format(name=name)
    assert without_collision_logic(verilog).startswith(f"(* no_rw_check *) reg [7:0] {name}[0:15];\n")
    garbage = with_garbage(verilog)
    assert f"\t{name}_dat0 <= {name}[write_adr];\n" in garbage
    assert f"\t{name}_dat1 <= (write_we & (read_adr == write_adr)) ? ~{name}[read_adr] : {name}[read_adr];\n" in garbage


@pytest.mark.parametrize("name", ["votes_even", "storages", "arrived_chunks"])
def test_other_memories(name):
    """Other memories are unchanged."""
    verilog = MEMORY.format(name=name)
    assert without_collision_logic(verilog) == with_garbage(verilog) == verilog


def test_memory_of_another_form():
    """A memory of unknown form is an error: a simulation of it would show nothing."""
    with pytest.raises(ValueError, match="no port that writes storage whole words"):
        with_garbage(MEMORY.format(name="storage").replace("storage[write_adr] <=", "storage[write_adr][3:0] <="))


def test_open_carries(tmp_path):
    """Only the unread carry at the end of a chain loses its net."""
    directions = {"CIN": "input", "COUT": "output"}
    cells = {name: {"type": "CCU2C", "port_directions": directions, "connections": {"CIN": [low], "COUT": [high]}}
             for name, low, high in [("first", 2, 3), ("last", 3, 4), ("read", 5, 6), ("pin", 7, 8)]}
    cells["reader"] = {"type": "LUT4", "port_directions": {"A": "input"}, "connections": {"A": [6]}}
    path = tmp_path / "top.json"
    path.write_text(json.dumps({"modules": {"top": {"ports": {"out": {"bits": [8]}}, "cells": cells}}}))
    without_open_carries(path)
    after = json.loads(path.read_text())["modules"]["top"]["cells"]
    assert {name: after[name]["connections"]["COUT"] for name in ("first", "last", "read", "pin")} == {
        "first": [3], "last": ["x"], "read": [6], "pin": [8]}


def lut(init, *inputs):
    """Return the output of a LUT: bit n of `init`, written from the highest down, n with the first input low."""
    return int(init[-1 - sum(bit << place for place, bit in enumerate(inputs))])


def simulate(cells, nets, carry_in):
    """Follow LUTs and carries of a netlist, in order, as Lattice's models of LUT4 and CCU2C; an open carry is drawn."""
    def value(cell, port):
        (net,) = cell["connections"][port]
        return {"0": 0, "1": 1, "x": carry_in}[net] if isinstance(net, str) else nets[net]

    def drive(cell, port, bit):
        nets[cell["connections"][port][0]] = bit

    for cell in cells:
        if cell["type"] == "LUT4":
            drive(cell, "Z", lut(cell["parameters"]["INIT"], *(value(cell, port) for port in "ABCD")))
            continue
        carry = value(cell, "CIN")
        for half in "01":
            init    = cell["parameters"][f"INIT{half}"]
            a, b, *rest = (value(cell, port + half) for port in "ABCD")
            through = lut(init, a, b, *rest)
            drive(cell, f"S{half}", through ^ carry)
            carry = carry if through else lut(init[-4:], a, b)
        drive(cell, "COUT", carry)


def chain(bits, *, difference, reads_first):
    """Return a sum or difference of two numbers as Yosys maps it: a netlist, and the nets of A, B and the result."""
    a, b, out = (list(range(start, start + bits)) for start in (100, 200, 300))
    constant  = str(int(difference))
    cells, carry = {}, constant
    for bit in range(0, bits, 2):
        ports = {"CIN": [carry], "COUT": [400 + bit]}
        for half in (0, 1):
            ports |= {f"A{half}": [a[bit + half]], f"B{half}": [b[bit + half]], f"C{half}": [constant],
                      f"D{half}": ["1"], f"S{half}": [out[bit + half]]}
        directions = {port: "output" if port[0] == "S" or port == "COUT" else "input" for port in ports}
        cells[f"slice{bit}"] = {"type": "CCU2C", "parameters": {"INIT0": SUM_INIT, "INIT1": SUM_INIT},
                                "port_directions": directions, "connections": ports}
        carry = 400 + bit
    read = [*out[0 if reads_first else 1:], carry]
    return {"modules": {"top": {"ports": {"out": {"bits": read}}, "cells": cells}}}, a, b, read


@pytest.mark.parametrize("bits", [2, 4, 10])
@pytest.mark.parametrize("difference", [False, True], ids=["sum", "difference"])
@pytest.mark.parametrize("reads_first", [False, True], ids=["comparison", "result"])
def test_first_carries(tmp_path, bits, difference, reads_first):
    """A chain that begins in its first bit gives the same bits, for any open carry; its LUT is only there if read."""
    netlist, a, b, read = chain(bits, difference=difference, reads_first=reads_first)
    path = tmp_path / "top.json"
    path.write_text(json.dumps(netlist))
    without_fed_carries(path)
    after = json.loads(path.read_text())["modules"]["top"]["cells"]
    assert after["slice0"]["connections"]["CIN"] == after["slice0"]["connections"]["S0"] == ["x"]
    assert sum(cell["type"] == "LUT4" for cell in after.values()) == reads_first
    rng = random.Random(bits)
    for number in range(4**bits if bits < 5 else 3000):
        drawn = number if bits < 5 else rng.getrandbits(2*bits)
        pins  = {net: drawn >> place & 1 for place, net in enumerate(a + b)}
        before, now = dict(pins), dict(pins)
        simulate(netlist["modules"]["top"]["cells"].values(), before, 0)
        simulate(after.values(), now, rng.getrandbits(1))
        assert [before[net] for net in read] == [now[net] for net in read]
        first, second = drawn & (1 << bits) - 1, drawn >> bits
        total = first + (~second & (1 << bits) - 1) + 1 if difference else first + second
        assert [before[net] for net in read[:-1]] == [total >> place & 1 for place in range(not reads_first, bits)]


def test_first_carries_of_another_form(tmp_path):
    """A chain that another release of Yosys maps in another way is an error."""
    netlist, *_ = chain(2, difference=False, reads_first=True)
    netlist["modules"]["top"]["cells"]["slice0"]["parameters"]["INIT0"] = "0"*16
    path = tmp_path / "top.json"
    path.write_text(json.dumps(netlist))
    with pytest.raises(ValueError, match="slice0 do not begin as Yosys 0.70 maps them"):
        without_fed_carries(path)


def test_global_resets(tmp_path):
    """A reset of many flip-flops that a register drives is on a global network, and nothing else is changed."""
    def flip_flop(reset, output):
        return {"type": "TRELLIS_FF", "port_directions": {"DI": "input", "LSR": "input", "Q": "output"},
                "connections": {"DI": ["0"], "LSR": [reset], "Q": [output]}}

    registered, few, combinational = 2, 3, 4
    cells = {"registered": flip_flop("0", registered), "few": flip_flop("0", few),
             "lut": {"type": "LUT4", "port_directions": {"A": "input", "Z": "output"},
                     "connections": {"A": [registered], "Z": [combinational]}}}
    for reset, count in ((registered, GLOBAL_RESETS), (few, GLOBAL_RESETS - 1), (combinational, GLOBAL_RESETS + 1)):
        cells |= {f"{reset}_{number}": flip_flop(reset, 100 + len(cells) + number) for number in range(count)}
    before = json.loads(json.dumps(cells))
    path   = tmp_path / "top.json"
    path.write_text(json.dumps({"modules": {"top": {"ports": {}, "cells": cells}}}))
    with_global_resets(path)
    after = json.loads(path.read_text())["modules"]["top"]["cells"]
    (name,) = set(after) - set(before)
    buffer  = after.pop(name)
    (network,) = buffer["connections"]["CLKO"]
    assert buffer["type"] == "DCCA"
    assert buffer["connections"] | {"CLKO": 0} == {"CLKI": [registered], "CE": ["1"], "CLKO": 0}
    used = {bit for cell in before.values() for bits in cell["connections"].values() for bit in bits}
    assert network not in used
    for number in range(GLOBAL_RESETS):
        before[f"{registered}_{number}"]["connections"]["LSR"] = [network]
    assert after == before
