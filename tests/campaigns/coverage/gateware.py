#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Which lines of the gateware's Verilog the tests run, and which bits rise and fall; Verilator counts.

The Verilog of a model is one module, of all cores inside each other. Its lines are counted for the core that they come
from, the innermost one of this project: a core's lines are the same in its own bench and inside others, and count once.
"""

from __future__ import annotations

import ast
import functools
import json
import re
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from litestereo.soc.build.paths import build_directory
from support.paths import CHECKOUT

#: Least percentage of the lines of each core.
LINES_FLOOR = 95.0

#: Cores that no test simulates in a model of this process, and why.
UNMEASURED = {
    "BusRegister": "only the SoC of a board has it: `make boards-sim` runs it, in litex_sim",
}


@dataclass(frozen=True, order=True)
class Line:
    """A line of a core's Verilog, the same in all models of the core."""
    text:   str
    number: int #: number among the lines with this text in an instance of the core, from 0


@dataclass
class Core:
    """Counts of one core, summed over its instances in all models."""
    name:     str
    file:     str = ""                                                    #: its module, from the checkout on
    benches:  set[str]                   = field(default_factory=set)     #: cores that tests simulate and that have it
    models:   set[str]                   = field(default_factory=set)     #: one for each set of parameters
    lines:    Counter[Line]              = field(default_factory=Counter)
    branches: Counter[tuple[Line, str]]  = field(default_factory=Counter) #: conditions, with "if" or "else"
    toggles:  Counter[str]               = field(default_factory=Counter) #: bits, each with its direction

    @property
    def missed(self) -> list[Line]:
        """Return the lines that were not run."""
        return sorted(line for line, count in self.lines.items() if not count)

    @property
    def percent(self) -> float:
        """Return the share of run lines; 100 if there are none."""
        return 100*run(self.lines)/len(self.lines) if self.lines else 100.0

    @property
    def seen(self) -> str:
        """Return where it was simulated: in its own bench, or inside which others."""
        others = ", ".join(f"`{name}`" for name in sorted(self.benches - {self.name}))
        return "; ".join(filter(None, ["own bench" if self.name in self.benches else "", others and f"in {others}"]))


def run(counts: Counter) -> int:
    """Return how many lines were run."""
    return sum(count > 0 for count in counts.values())


def _record(text: str) -> tuple[dict[str, str], int]:
    # `C '<1>key<2>value<1>key<2>value...' count`
    fields, count = text.rsplit("' ", 1)
    return dict(part.split("\2", 1) for part in fields[3:].split("\1")[1:]), int(count)


def _numbers(spans: str) -> list[int]:
    # "4-6,9": lines 4, 5, 6 and 9.
    ends = [[int(end) for end in span.split("-")] for span in spans.split(",") if span]
    return [line for end in ends for line in range(end[0], end[-1] + 1)]


def _source(model: str) -> str:
    return (build_directory() / "cosim" / model / "core.v").read_text()


def dead_lines(source: str) -> set[int]:
    """Return the numbers, from 1, of the lines under a signal that nothing drives.

    Such a signal is the reset of a core inside a core whose reset includes it, or an unused option of a FIFO.
    Synthesis removes these lines.
    """
    driven = set(re.findall(r"\b(\w+)(?:\[[^]]*\])? <= ", source)) | set(re.findall(r"assign (\w+)", source))
    never  = set(re.findall(r"^reg\s+(\w+) = 1'd0;", source, re.MULTILINE)) - driven
    dead: set[int] = set()
    end = None
    for number, line in enumerate(source.splitlines(), 1):
        begin = re.fullmatch(r"( *)if \((\w+)\) begin", line)
        if end is None and begin and begin[2] in never:
            end = begin[1] + "end"
        if end is not None:
            dead.add(number)
            end = None if line == end else end
    return dead


@functools.cache
def _dead(model: str) -> set[int]:
    return dead_lines(_source(model))


def instances(source: str, targets: dict[str, int]) -> list[int | None]:
    """Return the instance of a core that each line comes from: that which drives what it assigns.

    The line of a condition is of what is under it, an end of what is above it.
    """
    found: list[int | None] = []
    waiting = 0 #: lines of conditions that nothing has followed yet
    last: int | None = None
    for line in source.splitlines():
        assigned = re.match(r"\s*(?:assign )?(\w+)(?:\[[^]]*\])*\s*(?:<=|=) ", line)
        if assigned:
            name = assigned[1]
            last = targets.get(name, targets.get(re.sub(r"_(?:dat|adr)\d+$", "", name)))
            found[len(found) - waiting:] = [last]*(waiting + 1)
            waiting = 0
        elif line.rstrip().endswith("begin") or line.lstrip().startswith("case"):
            found.append(None)
            waiting += 1
        else:
            found.append(last)
    return found


def lines_of(source: str, owners: dict[str, Any]) -> list[tuple[int | None, Line]]:
    """Return, of each line of a model's Verilog, the instance of its core and the line in all models of the core."""
    names = owners["names"]
    seen: Counter[tuple[int | None, str]] = Counter()
    result = []
    # Widths depend on parameters: `4'd0` and `5'd0` are the same 0.
    plain = re.sub(r"\b\d+'", "'", source).splitlines()
    for instance, text in zip(instances(source, owners["targets"]), map(str.strip, plain), strict=True):
        # Names of a core inside others begin with theirs, and those of several instances end with a number.
        text = re.sub(r"(?<!')\b[a-z_]\w*", lambda name: names.get(name[0]) or re.sub(r"_?\d+$", "", name[0]), text)
        # So do places of lanes in a word.
        text = re.sub(r"\[\d+(?::\d+)?\]", "[]", text)
        result.append((instance, Line(text, seen[instance, text])))
        seen[instance, text] += 1
    return result


@functools.cache
def _lines(model: str) -> tuple[list[list[str]], list[tuple[int | None, Line]]]:
    path   = build_directory() / "cosim" / model / "owners.json"
    owners = json.loads(path.read_text())
    return owners["cores"], lines_of(_source(model), owners)


def read(folder: Path) -> dict[str, Core]:
    """Return the counts of all cores; `folder` has a folder per bench, in it one per model, in it a file per run."""
    cores: dict[str, Core] = {}
    for path in sorted(folder.glob("*/*/*.dat")):
        bench, model = path.parts[-3:-1]
        names, lines = _lines(model)
        dead         = _dead(model)
        inside       = []
        for name, module in names:
            inside.append(core := cores.setdefault(name, Core(name)))
            core.file = module.removeprefix("litestereo.").replace(".", "/") + ".py"
            core.benches.add(bench)
            core.models.add(model)
        for text in path.read_text().splitlines():
            if not text.startswith("C "):
                continue
            point, count = _record(text)
            if point["page"].startswith("v_toggle"):
                cores.setdefault(bench, Core(bench)).toggles[point["o"]] += count
                continue
            if int(point["l"]) in dead:
                continue
            instance, line = lines[int(point["l"]) - 1]
            if point["page"].startswith("v_branch") and instance is not None:
                inside[instance].branches[line, point["o"]] += count
            # An omitted `else` has no lines.
            for number in _numbers(point.get("S", "")):
                instance, line = lines[number - 1]
                if instance is not None and number not in dead:
                    inside[instance].lines[line] += count
    return cores


def percent(cores: dict[str, Core]) -> float:
    """Return the share of run lines of all cores."""
    whole = sum(len(core.lines) for core in cores.values())
    return 100*sum(run(core.lines) for core in cores.values())/whole if whole else 0.0


def classes() -> set[str]:
    """Return the names of all cores of the gateware."""
    found = set()
    for path in (CHECKOUT / "gateware").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ClassDef) and any(ast.unparse(base) == "LiteXModule" for base in node.bases):
                found.add(node.name)
    return found


def low(cores: dict[str, Core]) -> list[str]:
    """Return, a line for each, the cores below the floor, and those that no test has simulated."""
    found = [f"{name} ({core.file}): {core.percent:.1f} % of {len(core.lines)} lines, below the floor of "
             f"{LINES_FLOOR:g} %" for name, core in sorted(cores.items()) if core.percent < LINES_FLOOR]
    found += [f"{name}: no test simulates it" for name in sorted(classes() - set(cores) - set(UNMEASURED))]
    return found + [f"{name}: is measured, so remove its reason" for name in sorted(set(UNMEASURED) & set(cores))]
