#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Runs tools whose output goes to a log."""

from __future__ import annotations

import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path

#: Of a log, in the message of an error: what a tool that failed said last.
LAST_LINES = 20


class ToolError(RuntimeError):
    """A tool is not there, or failed."""


def run_logged(command: Sequence[str | Path], folder: Path, log: str,
               environment: Mapping[str, str] | None = None) -> None:
    """Run a tool in a folder, with its output in a log there.

    Parameters
    ----------
    command
        Tool and arguments.
    folder, log
        Where it runs, and the name of its log.
    environment
        Of the tool, instead of that of this process.

    Raises
    ------
    ToolError
        The tool failed; the message names the log and has its end.
    """
    path = folder / log
    with open(path, "w") as file:
        status = subprocess.run(command, cwd=folder, stdin=subprocess.DEVNULL, stdout=file, stderr=subprocess.STDOUT,
                                env=environment, check=False).returncode
    if status:
        end = "\n".join(path.read_text(errors="replace").splitlines()[-LAST_LINES:])
        raise ToolError(f"{command[0]} failed with status {status}: see {path}, which ends with\n{end}")
