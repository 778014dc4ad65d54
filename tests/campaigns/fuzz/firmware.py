#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Run the firmware's fuzz targets: `PYTHONPATH=tests .venv/bin/python -m campaigns.fuzz.firmware`."""

from __future__ import annotations

import argparse
import fcntl
import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from litestereo.soc.build.paths import build_directory
from support.paths import CHECKOUT

SOURCES = CHECKOUT / "firmware" / "fuzz"
CORPUS  = SOURCES / "corpus"
TARGETS = sorted(path.stem.removeprefix("fuzz_") for path in SOURCES.glob("fuzz_*.c"))

#: Longest input in bytes: a message and more, or a long conversation.
LENGTHS = {"calibration": 400, "cobs": 1200, "message": 1200, "pool": 300, "records": 120, "session": 400}

#: Seconds that one input may take.
LIMIT_S = 10


class FuzzError(RuntimeError):
    """A target cannot be built or run; says what is wrong, and what to do."""


@dataclass(frozen=True)
class Result:
    """The result of a target."""
    target:     str
    executions: int
    edges:      int          #: edges of the program that the inputs reached
    corpus:     int          #: inputs that each reach something new
    crash:      Path | None  #: input that shows a fault
    complaint:  str          #: description of the fault

    def __str__(self) -> str:
        """Return the result in one line."""
        line = f"{self.target:8} {self.executions:10} executions {self.edges:5} edges {self.corpus:5} inputs"
        return f"{line}  FAULT: {self.complaint}: {self.crash}" if self.crash else line


def build(target: str, planted: bool = False) -> Path:
    """Build a target if it is not up to date, as it is or with the planted fault."""
    for tool in ("clang", "make"):
        if not shutil.which(tool):
            raise FuzzError(f"{tool} is needed for the fuzz targets: .ci/install installs it")
    out = build_directory() / ("fuzz_planted" if planted else "fuzz_targets")
    out.mkdir(parents=True, exist_ok=True)
    command = ["make", "-f", SOURCES / "Makefile", f"OUT={out}", f"FAULT={'-DPLANTED_FAULT' if planted else ''}",
               f"fuzz_{target}"]
    with open(out / "lock", "w", encoding="ascii") as lock:
        # Several test processes may build at the same time.
        fcntl.flock(lock, fcntl.LOCK_EX)
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise FuzzError(f"fuzz_{target} does not compile: {done.stderr.strip().splitlines()[0]}")
    return out / f"fuzz_{target}"


def run(target: str, seconds: int, seed: int = 1, planted: bool = False) -> Result:
    """Run a target from its corpus on, until it fails or the time is over; new inputs are discarded."""
    program = build(target, planted)
    crashes = build_directory() / "fuzz_crashes"
    crashes.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as found:
        command = [program, f"-max_total_time={seconds}", f"-max_len={LENGTHS[target]}", f"-timeout={LIMIT_S}",
                   f"-seed={seed}", f"-artifact_prefix={crashes}/{target}-", "-print_final_stats=1", found,
                   CORPUS / target]
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
    return judged(target, done.returncode, done.stdout.decode("utf-8", "replace"))


def judged(target: str, status: int, log: str) -> Result:
    """Return the result that the output of a target means."""
    executions = re.search(r"stat::number_of_executed_units:\s*(\d+)", log)
    progress   = re.findall(r"cov: (\d+) ft: \d+ corp: (\d+)", log)
    edges, corpus = map(int, progress[-1]) if progress else (0, 0)
    crash     = re.search(r"Test unit written to (\S+)", log)
    complaint = re.search(r"(?:ERROR: |runtime error: |.*does not hold: ).*", log)
    if status and not crash:
        raise FuzzError(f"fuzz_{target} ended with status {status}: {log.strip().splitlines()[-1]}")
    return Result(target, int(executions[1]) if executions else 0, edges, corpus, Path(crash[1]) if crash else None,
                  complaint[0].strip() if complaint and crash else "")


def main() -> int:
    """Run the targets, and print a line for each; the exit status is 1 if one has found a fault."""
    parser = argparse.ArgumentParser(prog="fuzz.firmware", description="run the firmware's fuzz targets")
    parser.add_argument("--seconds", type=int, default=60, help="for each target (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="of what is tried (default: %(default)s)")
    parser.add_argument("--targets", nargs="+", choices=TARGETS, default=TARGETS, help="targets to run")
    options = parser.parse_args()
    if options.seconds < 1:
        parser.error("--seconds: 1 or more")
    faults = 0
    for target in options.targets:
        try:
            result = run(target, options.seconds, options.seed)
        except FuzzError as error:
            print(f"fuzz: {error}", file=sys.stderr)
            return 1
        print(result, flush=True)
        faults += result.crash is not None
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
