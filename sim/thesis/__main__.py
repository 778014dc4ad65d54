#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Writes docs/thesis.md and its pictures; results that are not stored yet are measured first."""

from __future__ import annotations

import subprocess
import sys

import rich.console
import rich.progress

from ...host_tools.core.errors import LiteStereoError
from ...soc.build.paths import PACKAGE_DIR
from ...soc.build.tools import ToolError
from .middlebury import data_key
from .page import SECTIONS, write
from .presets import Scale

DOCUMENT = PACKAGE_DIR / "docs" / "thesis.md"


def main() -> int:
    """Write the page; return the exit status."""
    scale = Scale()
    try:
        data_key()  # Missing pairs are an error now, not after an hour of work.
        with rich.progress.Progress(rich.progress.TextColumn("{task.description}"), rich.progress.BarColumn(),
                                    rich.progress.MofNCompleteColumn(), rich.progress.TimeElapsedColumn(),
                                    console=rich.console.Console(stderr=True)) as bar:
            task     = bar.add_task("", total=len(SECTIONS))
            measured = []
            for section in SECTIONS:
                bar.update(task, description=f"{section.label}: {section.title}")
                measured.append((section, section.measured(scale)))
                bar.advance(task)
        write(measured, scale, DOCUMENT)
    except (LiteStereoError, ToolError, RuntimeError, OSError, subprocess.SubprocessError) as error:
        print(f"thesis: error: {' '.join(str(error).split())}", file=sys.stderr)
        return 1
    print(f"written: {DOCUMENT}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
