#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The real firmware with a fake accelerator, as a process of this computer."""

from __future__ import annotations

import contextlib
import fcntl
import functools
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

from .paths import CHECKOUT

OUT  = CHECKOUT / "build" / "native_device"


@functools.cache
def build() -> Path:
    """Build the program, or bring it up to date; skip the test if there is no compiler."""
    if not shutil.which("gcc") or not shutil.which("make"):
        pytest.skip("gcc and make are needed to build the firmware for this computer")
    OUT.mkdir(parents=True, exist_ok=True)
    with open(OUT / "lock", "w", encoding="ascii") as lock:
        # Several test processes may build at the same time.
        fcntl.flock(lock, fcntl.LOCK_EX)
        command = ["make", "-f", CHECKOUT / "firmware" / "tests" / "Makefile", f"OUT={OUT}", "native_device"]
        done    = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return OUT / "native_device"


@contextlib.contextmanager
def native_device(*options: str) -> Iterator[int]:
    """Run the program, and return its TCP port; at the end, an error of a sanitizer fails the test."""
    with _running(options) as process:
        yield _port(process, "listening on 127.0.0.1:")


@contextlib.contextmanager
def native_udp_device(*options: str) -> Iterator[int]:
    """Run the program on a network too, and return its UDP port."""
    with native_ports(*options) as (_, port):
        yield port


@contextlib.contextmanager
def native_ports(*options: str) -> Iterator[tuple[int, int]]:
    """Run the program, and return both of its ports: TCP, which carries the serial line, and UDP."""
    with _running(["--udp-port", "0", *options]) as process:
        yield _port(process, "listening on 127.0.0.1:"), _port(process, "listening on udp 127.0.0.1:")


@contextlib.contextmanager
def _running(options: Sequence[str]) -> Iterator[subprocess.Popen[str]]:
    pipe = subprocess.PIPE
    with subprocess.Popen([build(), *options], stdout=pipe, stderr=pipe, text=True) as process:
        try:
            yield process
        finally:
            process.terminate()
            _, complaint = process.communicate(timeout=10)
        assert (process.returncode, complaint) == (0, "")


def _port(process: subprocess.Popen[str], announcement: str) -> int:
    line = process.stdout.readline()
    assert line.startswith(announcement), line + process.stderr.read()
    return int(line.rsplit(":", 1)[1])
