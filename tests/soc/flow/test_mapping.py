#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Hints for Yosys and nextpnr: memories whose ports never collide, and carries that nothing reads."""

import json

import pytest

from litestereo.soc.flow.mapping import with_garbage, without_collision_logic, without_open_carries

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
