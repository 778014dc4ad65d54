#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""A private network namespace: a test's network is invisible outside, and disappears at the end."""

from __future__ import annotations

import functools
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

import pytest

#: The loopback interface of a new namespace is down: set it up.
ENTER = ("unshare", "--net", "sh", "-c", 'ip link set lo up && exec "$@"', "sh")

#: Succeeds where a TAP can be made.
MAKE_TAP = ("ip", "tuntap", "add", "dev", "tap0", "mode", "tap")


@functools.cache
def _obstacle() -> str | None:
    """Return why namespaces with a TAP are not available here; None if they are."""
    for tool in ("unshare", "ip"):
        if not shutil.which(tool):
            return f"the command {tool} is needed for a network namespace"
    done = subprocess.run([*ENTER, *MAKE_TAP], capture_output=True, text=True, timeout=10, check=False)
    return f"no network namespace with a TAP: {done.stderr.strip()}" if done.returncode else None


def run_in_namespace(command: Sequence[str | Path], timeout_s: float = 300.0) -> str:
    """Run a command in a network namespace that has only a loopback interface; return its output.

    Skips the test where this is not permitted, and fails it if the command fails.
    """
    if obstacle := _obstacle():
        pytest.skip(obstacle)
    done = subprocess.run([*ENTER, *command], capture_output=True, text=True, timeout=timeout_s, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout
