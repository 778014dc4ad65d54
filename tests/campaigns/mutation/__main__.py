#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""`make mutation`: break gateware, firmware and host tools in small ways, and check that the narrow tests notice."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from itertools import islice
from queue import SimpleQueue

from .areas import AREAS, Area
from .explained import EXPLAINED
from .judge import CampaignError, Judge, Verdict
from .mutant import Mutant, shuffled


@dataclass
class Tally:
    """The mutants of an area, by what their tests say."""
    caught:    list[Mutant] = field(default_factory=list)
    hung:      list[Mutant] = field(default_factory=list) #: Of the caught ones, those whose tests did not end.
    explained: list[Mutant] = field(default_factory=list)
    unchanged: list[Mutant] = field(default_factory=list) #: Of the explained ones, those that give the same code.
    survived:  list[Mutant] = field(default_factory=list)

    @property
    def drawn(self) -> int:
        """Return how many were judged."""
        return len(self.caught) + len(self.explained) + len(self.survived)

    def add(self, mutant: Mutant, result: str) -> str:
        """Count a verdict; return it, "explained" for a survivor of the list.

        A mutant that gives the same Verilog, or the same assembly, explains itself.
        """
        if result == "survived" and (mutant.file, mutant.code, mutant.before, mutant.after) in EXPLAINED:
            result = "explained"
        counted = {"hung": "caught", "unchanged": "explained"}.get(result, result)
        for name in {counted, result}:
            getattr(self, name).append(mutant)
        return result


def files_of(area: Area) -> list[str]:
    """Return the files that faults are drawn from."""
    return [area.prefix + name for name in area.tests]


def judged(area: Area, mutants: Iterable[Mutant], judges: list[Judge]) -> Iterator[tuple[Mutant, Verdict]]:
    """Yield mutants with their verdicts, in their order; each judge has one at a time."""
    free: SimpleQueue[Judge] = SimpleQueue()
    for judge in judges:
        free.put(judge)

    def one(mutant: Mutant) -> Verdict:
        judge = free.get()
        try:
            return judge.judge(area, mutant)
        finally:
            free.put(judge)

    mutants = list(mutants)
    pool    = ThreadPoolExecutor(len(judges))
    try:
        yield from zip(mutants, pool.map(one, mutants), strict=True)
    finally:
        pool.shutdown(cancel_futures=True)


def campaign(area: Area, files: list[str], count: int, seed: int, judges: list[Judge]) -> Tally:
    """Judge `count` mutants of an area; those that the compiler refuses do not count."""
    tally   = Tally()
    mutants = shuffled(area.faults, files, seed)
    while tally.drawn < count and (drawn := list(islice(mutants, count - tally.drawn))):
        for mutant, verdict in judged(area, drawn, judges):
            if verdict.result != "refused":
                result = tally.add(mutant, verdict.result)
                print(f"{result:10} {verdict.seconds:6.1f} s  {mutant.name[:150]}", flush=True)
    return tally


def main() -> int:
    """Judge the mutants; the exit status is 1 if one survives that is not explained."""
    parser = argparse.ArgumentParser(prog="mutation", description="put small faults into files, and run their tests")
    parser.add_argument("--areas", nargs="+", choices=AREAS, default=list(AREAS), metavar="AREA",
                        help=f"what to break: {', '.join(AREAS)} (default: all)")
    parser.add_argument("--count", type=int, default=50, help="mutants of each area (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="what draws them (default: %(default)s)")
    parser.add_argument("--files", nargs="+", metavar="FILE",
                        help="draw from these files only, such as gateware/post/border.py")
    parser.add_argument("--jobs", type=int, default=1, help="mutants to judge at a time (default: %(default)s)")
    options = parser.parse_args()
    wanted  = {name: [file for file in files_of(AREAS[name]) if not options.files or file in options.files]
               for name in options.areas}
    if unknown := set(options.files or []) - {file for files in wanted.values() for file in files}:
        parser.error(f"no such file in these areas: {', '.join(sorted(unknown))}")
    tallies = {}
    try:
        judges = [Judge(number) for number in range(options.jobs)]
        for name, files in wanted.items():
            if files:
                print(f"{name}:", flush=True)
                tallies[name] = campaign(AREAS[name], files, options.count, options.seed, judges)
    except CampaignError as error:
        print(f"mutation: {error}", file=sys.stderr)
        return 1
    for tally in tallies.values():
        for mutant in tally.survived:
            print(f"survived: {mutant.name}\n{mutant.diff}")
    print(table(tallies))
    return int(any(tally.survived for tally in tallies.values()))


def table(tallies: dict[str, Tally]) -> str:
    """Return the counts of all areas."""
    rows = [f"{'area':13} {'drawn':>6} {'caught':>7} {'(hung)':>7} {'explained':>10} {'(same)':>7} "
            f"{'survived':>9}"]
    for name, tally in tallies.items():
        rows.append(f"{name:13} {tally.drawn:6} {len(tally.caught):7} {f'({len(tally.hung)})':>7} "
                    f"{len(tally.explained):10} {f'({len(tally.unchanged)})':>7} {len(tally.survived):9}")
    return "\n".join(rows)


if __name__ == "__main__":
    sys.exit(main())
