#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""`make coverage`: write, as one page, the counts of all tests, and what the C tests run of the firmware."""

from __future__ import annotations

import os
import subprocess
import sys

from litestereo.sim.cores.verilated_core import coverage_directory
from litestereo.sim.docs import COVERAGE
from litestereo.soc.build.commit import commit
from litestereo.soc.build.paths import build_directory
from support.paths import CHECKOUT

from . import firmware, gateware, python

#: Tests of small cores: toggles of bits are counted only there, because that takes a hundred times as long.
TOGGLE_TESTS = ("engines/test_sums.py", "post/test_selection.py", "post/test_map.py")


def toggles() -> dict[str, gateware.Core]:
    """Run the tests of small cores with a counter at every bit."""
    environment = os.environ | {"LITESTEREO_COVERAGE": "toggle", "LITESTEREO_COVERAGE_DIRECTORY": "toggles"}
    tests = [f"tests/gateware/{name}" for name in TOGGLE_TESTS]
    subprocess.run([sys.executable, "-m", "pytest", "-q", *tests], cwd=CHECKOUT, env=environment, check=True)
    return gateware.read(build_directory() / "toggles")


def gateware_part(lines: dict[str, gateware.Core], bits: dict[str, gateware.Core]) -> list[str]:
    """Return the table of the cores."""
    def share(counts) -> str:
        return f"{100*gateware.run(counts)/len(counts):.1f} %" if counts else ""
    rows = [f"| `{name}` | `{core.file}` | {core.seen} | {len(core.models)} | {len(core.lines)} | {share(core.lines)} "
            f"| {share(core.branches)} | {share(bits[name].toggles) if name in bits else ''} |"
            for name, core in sorted(lines.items())]
    reasons = "; ".join(f"`{name}`, {why}" for name, why in gateware.UNMEASURED.items())
    return ["## Gateware", "",
            "Verilator counts, in the Verilog of each core that a test simulates. A line is of the innermost core that "
            "it comes from, and is the same line in the core's own bench, inside others, and in all models, which "
            "differ by their parameters. Lines of LiteEth's cores and of benches are not counted. What is under a "
            "signal that nothing drives is not counted: synthesis leaves nothing of it. Bits are those that went "
            f"up and those that went down, in {', '.join(TOGGLE_TESTS)} alone.", "",
            "| core | file | simulated | models | lines | run | branches | bits |",
            "| --- | --- | --- | --- | --- | --- | --- | --- |", *rows, "",
            f"All lines: {gateware.percent(lines):.1f} %. The floor of each core is {gateware.LINES_FLOOR:g} %. "
            f"Not measured: {reasons}.", ""]


def firmware_part(files: dict[str, firmware.Covered]) -> list[str]:
    """Return the table of the firmware's sources."""
    lines, branches = firmware.totals(files)
    rows = [f"| `{name}` | {len(file.lines)} | {firmware.percent(file.lines_run, len(file.lines)):.1f} % | "
            f"{len(file.branches)} | {firmware.percent(file.branches_taken, len(file.branches)):.1f} % |"
            for name, file in sorted(files.items())]
    return ["## Firmware", "", "gcov counts, in the tests in C.", "",
            "| source | lines | run | branches | taken |", "| --- | --- | --- | --- | --- |", *rows, "",
            f"All: {lines:.1f} % of lines (floor: {firmware.LINES_FLOOR:g} %), {branches:.1f} % of branches (floor: "
            f"{firmware.BRANCHES_FLOOR:g} %). Not measured: "
            + "; ".join(f"`{name}`, {why}" for name, why in firmware.EXCLUDED.items()) + ".", ""]


def python_part(folders: list[python.Folder]) -> list[str]:
    """Return the tables of the Python files."""
    parts = []
    for folder in folders:
        rows = [f"| `{name}` | {lines} | {100*run/lines if lines else 100:.1f} % |"
                for name, (lines, run) in folder.files.items()]
        parts += [f"### `{folder.name}`", "", "| source | lines | run |", "| --- | --- | --- |", *rows, "",
                  f"All lines: {folder.percent:.1f} % (floor: {python.FLOORS[folder.name]:g} %).", ""]
    return ["## Python", "", "coverage.py counts, while all tests run.", "", *parts]


def main() -> int:
    """Write the page; the exit status is 1 if any part is below its floor."""
    lines = gateware.read(coverage_directory())
    if not lines or not python.DATA.is_file():
        print("coverage: no run of all tests has left its counts: run make coverage", file=sys.stderr)
        return 1
    files   = firmware.measure()
    folders = python.measured()
    parts   = [*gateware_part(lines, toggles()), *firmware_part(files), *python_part(folders)]
    COVERAGE.write("\n".join(["# Coverage", "",
        f"What the tests run, written by `make coverage` after commit `{commit()}`.", "",
        *parts]))
    code, branches = firmware.totals(files)
    counts = ", ".join(f"{folder.name} {folder.percent:.1f} %" for folder in folders)
    print(f"gateware: {gateware.percent(lines):.1f} % of lines; firmware: {code:.1f} % of lines, {branches:.1f} % of "
          f"branches; Python: {counts} of lines; written to {COVERAGE.name}")
    low = [*gateware.low(lines), *python.low(folders)]
    if code < firmware.LINES_FLOOR or branches < firmware.BRANCHES_FLOOR:
        low.append("firmware: below its floors")
    for line in low:
        print(f"coverage: {line}", file=sys.stderr)
    return int(bool(low))


if __name__ == "__main__":
    sys.exit(main())
