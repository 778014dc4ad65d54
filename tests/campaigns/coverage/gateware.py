#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Which lines of the gateware's Verilog the tests run, and which bits rise and fall; Verilator counts."""

from __future__ import annotations

import functools
import re
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

from litestereo.soc.build.paths import build_directory

#: Least percentage of the lines.
LINES_FLOOR = 95.0


@dataclass(frozen=True, order=True)
class Line:
    """A line of a core's Verilog, the same in all models of the core."""
    text:   str
    number: int #: number among the lines with this text, from 0


@dataclass
class Core:
    """Counts of one core, summed over its models: there is one for each set of parameters that the tests use."""
    name:     str
    models:   set[str]                   = field(default_factory=set)
    lines:    Counter[Line]              = field(default_factory=Counter)
    branches: Counter[tuple[Line, str]]  = field(default_factory=Counter) #: conditions, with "if" or "else"
    toggles:  Counter[str]               = field(default_factory=Counter) #: bits, each with its direction

    @property
    def missed(self) -> list[Line]:
        """Return the lines that were not run."""
        return sorted(line for line, count in self.lines.items() if not count)


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


@functools.cache
def _verilog(model: str) -> list[Line]:
    seen: Counter[str] = Counter()
    lines  = []
    source = _source(model)
    # Widths depend on parameters: `4'd0` and `5'd0` are the same 0.
    for text in map(str.strip, re.sub(r"\b\d+'", "'", source).splitlines()):
        lines.append(Line(text, seen[text]))
        seen[text] += 1
    return lines


def read(folder: Path) -> dict[str, Core]:
    """Return the counts of the models in `folder`: a folder per core, in it one per model, in it a file per run."""
    cores: dict[str, Core] = {}
    for path in sorted(folder.glob("*/*/*.dat")):
        core  = cores.setdefault(path.parts[-3], Core(path.parts[-3]))
        lines = _verilog(path.parts[-2])
        dead  = _dead(path.parts[-2])
        core.models.add(path.parts[-2])
        for text in path.read_text().splitlines():
            if not text.startswith("C "):
                continue
            point, count = _record(text)
            if point["page"].startswith("v_toggle"):
                core.toggles[point["o"]] += count
                continue
            if int(point["l"]) in dead:
                continue
            if point["page"].startswith("v_branch"):
                core.branches[lines[int(point["l"]) - 1], point["o"]] += count
            # An omitted `else` has no lines.
            for number in _numbers(point.get("S", "")):
                if number not in dead:
                    core.lines[lines[number - 1]] += count
    return cores


def percent(cores: dict[str, Core]) -> float:
    """Return the share of run lines of all cores."""
    whole = sum(len(core.lines) for core in cores.values())
    return 100*sum(run(core.lines) for core in cores.values())/whole if whole else 0.0
