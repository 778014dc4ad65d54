#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""`make coverage`: write, as one page, the counts of all tests, and what the C tests run of the firmware."""

from __future__ import annotations

import json
import os
import subprocess
import sys

from litestereo.sim.cores.verilated_core import coverage_directory
from litestereo.sim.docs import COVERAGE
from litestereo.soc.build.commit import commit
from litestereo.soc.build.paths import build_directory
from support.paths import CHECKOUT

from . import firmware, gateware

#: Least percentage of the host tools' lines, and the folder of their counts.
HOST_FLOOR = 90.0
HOST_DATA  = build_directory() / "host_tools.coverage"

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
    rows = [f"| `{name}` | {len(core.models)} | {len(core.lines)} | {share(core.lines)} | {share(core.branches)} | "
            f"{share(bits[name].toggles) if name in bits else ''} |" for name, core in sorted(lines.items())]
    return ["## Gateware", "",
            "Verilator counts, in the Verilog of each core that a test simulates alone: the matcher has its parts. A "
            "line is the same line in all models of a core, which differ by their parameters. What is under a signal "
            "that nothing drives is not counted: synthesis leaves nothing of it. Bits are those that went "
            f"up and those that went down, in {', '.join(TOGGLE_TESTS)} alone.", "",
            "| core | models | lines | run | branches | bits |", "| --- | --- | --- | --- | --- | --- |", *rows, "",
            f"All lines: {gateware.percent(lines):.1f} % (floor: {gateware.LINES_FLOOR:g} %).", ""]


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


def host_part() -> tuple[list[str], float]:
    """Return the table of the host tools' folders, and the percentage of all of them."""
    report = build_directory() / "host_tools.json"
    subprocess.run([sys.executable, "-m", "coverage", "json", "-q", f"--data-file={HOST_DATA}", "-o", str(report)],
                   cwd=CHECKOUT, check=True)
    data = json.loads(report.read_text())
    rows = [f"| `{name}` | {file['summary']['num_statements']} | {file['summary']['percent_covered']:.1f} % |"
            for name, file in sorted(data["files"].items())]
    percent = data["totals"]["percent_covered"]
    return ["## Host tools", "", "coverage.py counts, while all tests run.", "",
            "| source | lines | run |", "| --- | --- | --- |", *rows, "",
            f"All lines: {percent:.1f} % (floor: {HOST_FLOOR:g} %).", ""], percent


def main() -> int:
    """Write the page; the exit status is 1 if any part is below its floor."""
    lines = gateware.read(coverage_directory())
    if not lines or not HOST_DATA.is_file():
        print("coverage: no run of all tests has left its counts: run make coverage", file=sys.stderr)
        return 1
    files           = firmware.measure()
    host, host_run  = host_part()
    parts           = [*gateware_part(lines, toggles()), *firmware_part(files), *host]
    COVERAGE.write("\n".join(["# Coverage", "",
        f"What the tests run, written by `make coverage` after commit `{commit()}`.", "",
        *parts]))
    gateware_run       = gateware.percent(lines)
    code, branches     = firmware.totals(files)
    print(f"gateware: {gateware_run:.1f} % of lines; firmware: {code:.1f} % of lines, {branches:.1f} % of branches; "
          f"host tools: {host_run:.1f} % of lines; written to {COVERAGE.name}")
    low = (gateware_run < gateware.LINES_FLOOR or code < firmware.LINES_FLOOR
           or branches < firmware.BRANCHES_FLOOR or host_run < HOST_FLOOR)
    return int(low)


if __name__ == "__main__":
    sys.exit(main())
