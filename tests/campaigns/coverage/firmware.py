#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Which lines and branches of the firmware the C tests run.

`PYTHONPATH=tests .venv/bin/python -m campaigns.coverage.firmware` prints them.

The firmware is compiled for this computer without the sanitizers, whose checks would count as branches.
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path

from support.firmware_build import UNITS, BuildError, build_for_coverage
from support.paths import CHECKOUT

FIRMWARE = CHECKOUT / "firmware"
FOLDERS  = ("app", "boot", "drivers", "include", "lib", "link", "reference")

#: Reasons to exclude files: most of them need the RISC-V processor.
EXCLUDED = {
    "app/main.c":              "the loop that never ends around app_poll()",
    "boot/boot.c":             "reads the flash by its address and jumps to what it has loaded",
    "drivers/firmware_tag.c":  "a constant, no code",
    "drivers/platform.c":      "caches, interrupts and stack of the processor, and where the linker put the memory",
}

#: Least percentages.
LINES_FLOOR    = 95.0
BRANCHES_FLOOR = 90.0


class CoverageError(RuntimeError):
    """There is nothing to measure; says what is wrong, and what to do."""


@dataclass
class Covered:
    """Counts of one source file, summed over all programs that contain it."""
    name:     str
    lines:    dict[int, int] = field(default_factory=lambda: defaultdict(int))
    #: Branches by line and number in the line. With the function, because many objects contain those of a header.
    branches: dict[tuple[int, str, int], int] = field(default_factory=lambda: defaultdict(int))

    @property
    def missed_lines(self) -> list[int]:
        """Return the lines that were not run."""
        return sorted(line for line, count in self.lines.items() if not count)

    @property
    def missed_branches(self) -> list[tuple[int, int]]:
        """Return the branches not taken in lines that were run: line, and number in the line."""
        return sorted((line, way) for (line, _, way), count in self.branches.items() if not count and self.lines[line])

    @property
    def lines_run(self) -> int:
        """Return how many lines were run."""
        return len(self.lines) - len(self.missed_lines)

    @property
    def branches_taken(self) -> int:
        """Return how many branches were taken."""
        return sum(count > 0 for count in self.branches.values())


def percent(part: int, whole: int) -> float:
    """Return a share in percent; 100 if there is nothing."""
    return 100*part/whole if whole else 100.0


def zero(out: Path) -> None:
    """Delete the counts of earlier runs."""
    for counts in out.rglob("*.gcda"):
        counts.unlink()


def read(out: Path) -> dict[str, Covered]:
    """Return the counts of everything that was run in this folder, by source file of the firmware."""
    counts = sorted(out.rglob("*.gcda"))
    if not counts:
        raise CoverageError(f"nothing was counted in {out}: run the programs there first")
    done = subprocess.run(["gcov", "--json-format", "--stdout", "--branch-probabilities", *counts], cwd=out,
                          capture_output=True, text=True, check=False)
    if done.returncode:
        raise CoverageError(f"gcov failed, of the compiler's version? {done.stderr.strip().splitlines()[-1]}")
    files: dict[str, Covered] = {}
    for report in map(json.loads, filter(None, done.stdout.splitlines())):
        for source in report["files"]:
            path = (Path(report["current_working_directory"]) / source["file"]).resolve()
            if not path.is_relative_to(FIRMWARE):
                continue
            name = path.relative_to(FIRMWARE).as_posix()
            if name.split("/")[0] in FOLDERS and source["lines"]:
                _add(files.setdefault(name, Covered(name)), source["lines"])
    return files


def _add(file: Covered, lines: list[dict]) -> None:
    for line in lines:
        file.lines[line["line_number"]] += line["count"]
        for way, branch in enumerate(line["branches"]):
            file.branches[line["line_number"], line["function_name"], way] += branch["count"]


def measure() -> dict[str, Covered]:
    """Build the C tests, run each once, and return the counts."""
    for tool in ("gcc", "gcov", "make"):
        if not shutil.which(tool):
            raise CoverageError(f"{tool} is needed: .ci/install installs it")
    with build_for_coverage() as out:
        zero(out)
        for unit in UNITS:
            _run(out / unit)
        _run(out / "test_vectors", CHECKOUT / "tests" / "vectors" / "protocol.txt")
        return read(out)


def _run(*command: Path) -> None:
    done = subprocess.run(command, capture_output=True, text=True, timeout=600, check=False)
    if done.returncode:
        raise CoverageError(f"{command[0].name} failed: {done.stderr.strip()}")


def unmeasured(files: dict[str, Covered]) -> list[str]:
    """Return the sources that no program contains and that are not excluded."""
    sources = {path.relative_to(FIRMWARE).as_posix() for folder in FOLDERS for path in (FIRMWARE / folder).rglob("*.c")}
    return sorted(sources - set(files) - set(EXCLUDED))


def totals(files: dict[str, Covered]) -> tuple[float, float]:
    """Return the percentages of all lines and of all branches."""
    lines    = percent(sum(file.lines_run for file in files.values()), sum(len(f.lines) for f in files.values()))
    branches = percent(sum(f.branches_taken for f in files.values()), sum(len(f.branches) for f in files.values()))
    return lines, branches


def page(files: dict[str, Covered], missed: bool = False) -> str:
    """Return the table of all files, with the missed lines if wanted, and the excluded files."""
    rows = [f"{'file':32} {'lines':>6} {'run':>7} {'branches':>9} {'taken':>7}"]
    for name, file in sorted(files.items()):
        rows.append(f"{name:32} {len(file.lines):6} {percent(file.lines_run, len(file.lines)):6.1f}% "
                    f"{len(file.branches):9} {percent(file.branches_taken, len(file.branches)):6.1f}%")
        if missed:
            rows += [f"    line {line} is not run" for line in file.missed_lines]
            rows += [f"    line {line}: branch {way} is not taken" for line, way in file.missed_branches]
    lines, branches = totals(files)
    rows.append(f"{'total':32} {sum(len(f.lines) for f in files.values()):6} {lines:6.1f}% "
                f"{sum(len(f.branches) for f in files.values()):9} {branches:6.1f}%")
    rows += [f"not measured: {name}: {why}" for name, why in EXCLUDED.items()]
    return "\n".join(rows)


def main() -> int:
    """Measure and print; the exit status is 1 below the floors."""
    parser = argparse.ArgumentParser(prog="coverage.firmware", description="what the tests in C run of the firmware")
    parser.add_argument("--missed", action="store_true", help="list lines and branches that are missed")
    options = parser.parse_args()
    try:
        files = measure()
    except (CoverageError, BuildError) as error:
        print(f"coverage: {error}", file=sys.stderr)
        return 1
    print(page(files, options.missed))
    for name in unmeasured(files):
        print(f"coverage: {name} is in no program of firmware/tests/Makefile", file=sys.stderr)
    lines, branches = totals(files)
    if lines < LINES_FLOOR or branches < BRANCHES_FLOOR:
        print(f"coverage: below the floor of {LINES_FLOOR:g} % of lines and {BRANCHES_FLOOR:g} % of branches: add tests"
              " for what --missed lists", file=sys.stderr)
        return 1
    return 1 if unmeasured(files) else 0


if __name__ == "__main__":
    sys.exit(main())
