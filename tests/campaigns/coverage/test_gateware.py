#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Lines of the gateware are counted once, for the core that they come from; lines that cannot run do not count."""

import json

import pytest
from litex.gen import LiteXModule
from litex.gen.fhdl import verilog
from migen import If, Memory, Signal
from migen.genlib.cdc import GrayCounter

from campaigns.coverage import __main__ as page
from campaigns.coverage import gateware
from campaigns.coverage.gateware import Line, dead_lines, lines_of, low, read
from litestereo.sim.cores.owners import owners
from litestereo.sim.cores.verilated import PortsTop

VERILOG = """\
reg part_reset = 1'd0;
reg whole_reset = 1'd0;
wire settings_reset;
reg [1:0] count = 2'd0;
assign settings_reset = count[0];
always @(posedge clk) begin
    if (part_reset) begin
        if (enable) begin
            count <= 2'd0;
        end
    end
    if (settings_reset) begin
        count <= 2'd1;
    end
    if (whole_reset) begin
        count <= 2'd2;
    end
    whole_reset <= enable;
end
"""


def test_dead_lines():
    """Lines under a register that nothing drives are dead, up to its end; lines under a driven one are not."""
    assert dead_lines(VERILOG) == {7, 8, 9, 10, 11}
    assert dead_lines(VERILOG.replace("whole_reset <= enable", "count <= 2'd3")) == {7, 8, 9, 10, 11, 15, 16, 17}
    assert dead_lines(VERILOG.replace("whole_reset <=", "part_reset <=")) == {15, 16, 17}


class Lane(LiteXModule):
    """A part of a core."""
    __module__ = "litestereo.gateware.sums.lane"

    def __init__(self):
        self.value = Signal(8)
        self.add   = Signal()
        self.sync += If(self.add, self.value.eq(self.value + 1))


class Sums(LiteXModule):
    """A core with two parts and a memory."""
    __module__ = "litestereo.gateware.sums.sums"

    def __init__(self):
        self.lanes = [Lane(), Lane()]
        self.submodules += self.lanes
        self.total = Signal(9)
        self.sync += [self.total.eq(self.lanes[0].value + self.lanes[1].value)]
        self.comb += [lane.add.eq(self.total[number]) for number, lane in enumerate(self.lanes)]
        memory = Memory(9, 16)
        port   = memory.get_port(write_capable=True)
        self.specials += memory, port
        self.comb += [port.we.eq(1), port.dat_w.eq(self.total), port.adr.eq(self.total[:4])]


class Foreign(LiteXModule):
    """A core of another project."""
    __module__ = "liteeth.core"

    def __init__(self):
        self.state = Signal()
        self.sync += self.state.eq(~self.state)


def emitted(core):
    """Return the Verilog of a core in a bench, and whose its signals are."""
    top   = PortsTop(core)
    if isinstance(core, Sums):
        top.foreign = Foreign()
    if isinstance(core, Lane):
        top.comb += core.add.eq(top.port("more", 1))
    found = verilog.convert(top, ios=top.ios, name="core")
    return str(found), owners(top, found.ns)


def by_core(source, known):
    """Return the lines of each instance that assign something in a block."""
    result = {}
    for instance, line in lines_of(source, known):
        if instance is not None and "<=" in line.text:
            result.setdefault((instance, known["cores"][instance][0]), set()).add(line)
    return result


def test_lines_are_of_the_innermost_core():
    """The lines of a part are the same in both instances and in its own bench; those of other projects are no lines."""
    alone  = by_core(*emitted(Lane()))
    inside = by_core(*emitted(Sums()))
    assert sorted(name for _, name in inside) == ["Lane", "Lane", "Sums"]
    (lines,) = alone.values()
    assert Line("value <= (value + 'd1);", 0) in lines
    assert all(found == lines for (_, name), found in inside.items() if name == "Lane")
    own = next(found for (_, name), found in inside.items() if name == "Sums")
    assert any(line.text.startswith("total <=") for line in own)
    assert any("memory" in line.text or "storage" in line.text for line in own)
    assert not [line for found in inside.values() for line in found if "state" in line.text]


class Counting(LiteXModule):
    """A core with a part of migen."""
    __module__ = "litestereo.gateware.sums.counting"

    def __init__(self):
        self.counter = GrayCounter(3)
        self.comb += self.counter.ce.eq(1)


def test_parts_of_libraries_belong_to_the_core():
    """Lines of counters, FIFOs and states are of the core that has them."""
    source, known = emitted(Counting())
    assert known["cores"] == [["Counting", "litestereo.gateware.sums.counting"]]
    (lines,) = by_core(source, known).values()
    assert any(line.text.startswith("q <=") for line in lines)


@pytest.fixture
def counts(tmp_path, monkeypatch):
    """Return a function that stores the counts of a bench: which of its model's lines were run."""
    monkeypatch.setattr(gateware, "build_directory", lambda: tmp_path)
    monkeypatch.setattr(gateware, "classes", lambda: {"Lane", "Sums"})
    monkeypatch.setattr(gateware, "UNMEASURED", {})
    for function in (gateware._lines, gateware._dead):
        function.cache_clear()

    def store(bench, core, runs):
        model = f"model-{bench}"
        found = tmp_path / "cosim" / model
        found.mkdir(parents=True)
        source, known = emitted(core)
        (found / "core.v").write_text(source)
        (found / "owners.json").write_text(json.dumps(known))
        data = tmp_path / "coverage" / bench / model
        data.mkdir(parents=True)
        points = [f"C '\1page\2v_line/core\1l\2{number}\1S\2{number}' {int(runs(line))}"
                  for number, line in enumerate(source.splitlines(), 1) if "<=" in line]
        (data / "1.dat").write_text("\n".join(["# SystemC::Coverage-3", *points]))
        return read(tmp_path / "coverage")
    return store


def test_a_core_below_the_floor_is_named(counts):
    """The floor holds for each core, wherever it is simulated; another core's lines do not make up for it."""
    cores = counts("Sums", Sums(), lambda line: "value" not in line.replace("total", "") or "total" in line)
    assert cores["Sums"].percent == 100 and cores["Lane"].percent < 100
    assert cores["Sums"].seen == "own bench" and cores["Lane"].seen == "in `Sums`"
    assert cores["Lane"].file == "gateware/sums/lane.py"
    (line,) = low(cores)
    assert line.startswith("Lane (gateware/sums/lane.py): 0.0 % of")
    lines = len(cores["Lane"].lines)
    # Its own bench runs what was missed: the same lines.
    cores = counts("Lane", Lane(), lambda line: True)
    assert len(cores["Lane"].lines) == lines
    assert cores["Lane"].percent == 100
    assert cores["Lane"].seen == "own bench; in `Sums`"
    assert not low(cores)


def test_a_core_that_is_not_simulated_is_named(counts, monkeypatch):
    """It needs a reason, and a core that is simulated needs none."""
    cores = counts("Lane", Lane(), lambda line: True)
    assert low(cores) == ["Sums: no test simulates it"]
    monkeypatch.setattr(gateware, "UNMEASURED", {"Sums": "a reason", "Lane": "another"})
    assert low(cores) == ["Lane: is measured, so remove its reason"]


def test_the_page(counts):
    """The page has a row per core: file, where it was simulated, lines and shares."""
    text = "\n".join(page.gateware_part(counts("Sums", Sums(), lambda line: True), {}))
    assert "| `Lane` | `gateware/sums/lane.py` | in `Sums` | 1 | " in text
    assert "| `Sums` | `gateware/sums/sums.py` | own bench | 1 | " in text


def test_all_cores_are_known():
    """Cores are found in the sources, and each reason is of one of them."""
    assert {"Matcher", "StereoPeripheral", "Network", "FrameLink"} <= gateware.classes()
    assert set(gateware.UNMEASURED) <= gateware.classes()
