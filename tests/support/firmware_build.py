#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Builds the firmware's C sources for this computer, under the sanitizers."""

from __future__ import annotations

import fcntl
import functools
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
OUT  = ROOT / "build" / "firmware_tests"


@functools.cache
def build_tests() -> Path:
    """Builds all test programs, or brings them up to date; skips the test if there is no compiler."""
    if not shutil.which("gcc") or not shutil.which("make"):
        pytest.skip("gcc and make are needed to build the firmware for this computer")
    OUT.mkdir(parents=True, exist_ok=True)
    with open(OUT / "lock", "w", encoding="ascii") as lock:
        # Test processes may run side by side.
        fcntl.flock(lock, fcntl.LOCK_EX)
        command = ["make", "-j2", "-f", ROOT / "firmware" / "tests" / "Makefile", f"OUT={OUT}", "all"]
        done    = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return OUT
