#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The command `litestereo` in this process."""

from __future__ import annotations

from typing import Any

import pytest

from litestereo.host_tools import cli


def run(*arguments: object) -> Any:
    """Run the command; return its exit status."""
    try:
        return cli.main([str(argument) for argument in arguments])
    except SystemExit as end:
        return end.code


def error_line(capfd: pytest.CaptureFixture[str]) -> str:
    """Return the one line that a failed command has written."""
    out, err = capfd.readouterr()
    assert out == "", out
    assert err.startswith("litestereo: error: ") and err.endswith("\n") and err.count("\n") == 1, err
    return err
