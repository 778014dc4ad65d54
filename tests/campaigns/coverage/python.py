#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Which lines of the Python code the tests run; coverage.py counts.

`PYTHONPATH=tests .venv/bin/python -m campaigns.coverage.python` judges the counts of the last `make test-long COUNT=1`.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from litestereo.soc.build.paths import build_directory
from support.paths import CHECKOUT

#: Least percentage of the lines of each folder. Much of `soc` and `sim` runs in processes that are not counted: what
#: generates a SoC, and boots it. Their floors have not been set by a measurement yet.
FLOORS = {"host_tools": 90.0, "soc": 25.0, "sim": 25.0}

#: Counts of the tests.
DATA = build_directory() / "python.coverage"


@dataclass
class Folder:
    """Counts of the files of one folder."""
    name:  str
    files: dict[str, tuple[int, int]] #: lines and run lines by name, from the checkout on

    @property
    def percent(self) -> float:
        """Return the share of run lines; 0 if nothing was counted."""
        whole = sum(lines for lines, _ in self.files.values())
        return 100*sum(run for _, run in self.files.values())/whole if whole else 0.0


def measured(data: Path = DATA) -> list[Folder]:
    """Return the folders with the counts in `data`, which coverage.py has written."""
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.json"
        subprocess.run([sys.executable, "-m", "coverage", "json", "-q", f"--data-file={data}", "-o", str(report)],
                       cwd=CHECKOUT, check=True)
        counted = json.loads(report.read_text())["files"]
    files = {name: (file["summary"]["num_statements"], file["summary"]["covered_lines"])
             for name, file in sorted(counted.items())}
    return [Folder(folder, {name: counts for name, counts in files.items() if name.startswith(f"{folder}/")})
            for folder in FLOORS]


def low(folders: list[Folder]) -> list[str]:
    """Return the folders below their floors, a line for each."""
    return [f"{folder.name}: {folder.percent:.1f} % of its lines, below the floor of {FLOORS[folder.name]:g} %"
            for folder in folders if folder.percent < FLOORS[folder.name]]


def main() -> int:
    """Print the percentages, with `--quiet` only those below a floor; the exit status is 1 if there are any."""
    if not DATA.is_file():
        print("coverage: the tests have left no counts of Python: run make test COUNT=1", file=sys.stderr)
        return 1
    folders = measured()
    if "--quiet" in sys.argv[1:]:
        for line in low(folders):
            print(f"coverage: {line}", file=sys.stderr)
        return int(bool(low(folders)))
    for folder in folders:
        print(f"{folder.name}: the tests have run {folder.percent:.1f} % of its lines "
              f"(floor: {FLOORS[folder.name]:g} %)")
    return int(bool(low(folders)))


if __name__ == "__main__":
    sys.exit(main())
