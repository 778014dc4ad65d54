#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Build the firmware's C sources for this computer: under the sanitizers, or with counts of executed lines."""

from __future__ import annotations

import contextlib
import fcntl
import functools
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from .paths import CHECKOUT

OUT     = CHECKOUT / "build" / "firmware_tests"
COUNTED = CHECKOUT / "build" / "firmware_coverage"

#: Programs that print nothing and end with 0 if all is well.
UNITS = sorted({path.stem for path in (CHECKOUT / "firmware" / "tests").rglob("test_*.c")} - {"test_vectors"})


class BuildError(RuntimeError):
    """The firmware does not compile; holds the compiler's first error."""


@functools.cache
def build_tests() -> Path:
    """Build all test programs that are not up to date; skip the test if there is no compiler."""
    if not shutil.which("gcc") or not shutil.which("make"):
        pytest.skip("gcc and make are needed to build the firmware for this computer")
    with _locked(OUT):
        _make(OUT)
    return OUT


@contextlib.contextmanager
def build_for_coverage() -> Iterator[Path]:
    """Build the same programs without sanitizers, in a private folder, where they count what they run."""
    with _locked(COUNTED):
        _make(COUNTED, "SANITIZE=-O0 --coverage -fprofile-update=atomic")
        yield COUNTED


@contextlib.contextmanager
def _locked(out: Path) -> Iterator[None]:
    out.mkdir(parents=True, exist_ok=True)
    with open(out / "lock", "w", encoding="ascii") as lock:
        # Several test processes may build at the same time.
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def _make(out: Path, *variables: str) -> None:
    command = ["make", "-j2", "-f", CHECKOUT / "firmware" / "tests" / "Makefile", f"OUT={out}", *variables, "all"]
    done    = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise BuildError(f"the firmware does not compile: {done.stderr.strip().splitlines()[0]}")
