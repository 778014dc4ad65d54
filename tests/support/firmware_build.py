#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Builds the firmware's C sources for this computer: under the sanitizers, or with counts of what is run."""

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

#: Programs that are silent and end with 0 if all is well.
UNITS = sorted({path.stem for path in (CHECKOUT / "firmware" / "tests").rglob("test_*.c")} - {"test_vectors"})


class BuildError(RuntimeError):
    """The firmware does not compile: what the compiler says first."""


@functools.cache
def build_tests() -> Path:
    """Builds all test programs, or brings them up to date; skips the test if there is no compiler."""
    if not shutil.which("gcc") or not shutil.which("make"):
        pytest.skip("gcc and make are needed to build the firmware for this computer")
    with _locked(OUT):
        _make(OUT)
    return OUT


@contextlib.contextmanager
def build_for_coverage() -> Iterator[Path]:
    """The same programs without sanitizers, in a folder where they count what they run, for this process alone."""
    with _locked(COUNTED):
        _make(COUNTED, "SANITIZE=-O0 --coverage -fprofile-update=atomic")
        yield COUNTED


@contextlib.contextmanager
def _locked(out: Path) -> Iterator[None]:
    out.mkdir(parents=True, exist_ok=True)
    with open(out / "lock", "w", encoding="ascii") as lock:
        # Test processes may run side by side.
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def _make(out: Path, *variables: str) -> None:
    command = ["make", "-j2", "-f", CHECKOUT / "firmware" / "tests" / "Makefile", f"OUT={out}", *variables, "all"]
    done    = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise BuildError(f"the firmware does not compile: {done.stderr.strip().splitlines()[0]}")
