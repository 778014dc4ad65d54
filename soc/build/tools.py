#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Run tools with their output in a log."""

from __future__ import annotations

import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path

#: Lines of a failed tool's log that the error quotes.
LAST_LINES = 20


class ToolError(RuntimeError):
    """A tool is missing, or has failed."""


def run_logged(command: Sequence[str | Path], folder: Path, log: str,
               environment: Mapping[str, str] | None = None) -> None:
    """Run a tool in a folder, with its output in a log there.

    Parameters
    ----------
    command
        Tool and arguments.
    folder, log
        Folder in which the tool runs, and the name of its log.
    environment
        Environment of the tool, instead of this process's.

    Raises
    ------
    ToolError
        The tool failed; the message names the log and quotes its end.
    """
    path = folder / log
    with open(path, "w") as file:
        status = subprocess.run(command, cwd=folder, stdin=subprocess.DEVNULL, stdout=file, stderr=subprocess.STDOUT,
                                env=environment, check=False).returncode
    if status:
        end = "\n".join(path.read_text(errors="replace").splitlines()[-LAST_LINES:])
        raise ToolError(f"{command[0]} failed with status {status}: see {path}, which ends with\n{end}")
