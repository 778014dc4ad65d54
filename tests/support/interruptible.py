#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Programs that end with Ctrl-C."""

from __future__ import annotations

import contextlib
import subprocess
from collections.abc import Iterator, Sequence
from typing import IO


@contextlib.contextmanager
def interruptible(command: Sequence[str], **streams: int | IO[str]) -> Iterator[subprocess.Popen[str]]:
    """Start a program that obeys SIGINT, even if the tests run in the background of a shell; it ends with its test."""
    with subprocess.Popen(["env", "--default-signal=INT", *command], text=True, **streams) as program:
        try:
            yield program
        finally:
            program.kill()
