#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Packages that only some commands need: the extras of the installation."""

from __future__ import annotations

import importlib
from typing import Any

from .errors import MissingExtraError


def import_extra(module: str, extra: str, purpose: str) -> Any:
    """The module `module`.

    Parameters
    ----------
    extra
        Name of the extra that installs it.
    purpose
        What it is needed for, as the error says it: "an MCAP bag needs".

    Raises
    ------
    MissingExtraError
        It is not installed.
    """
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError:
        raise MissingExtraError(f"{purpose} {module.partition('.')[0]}, which is not installed: "
                                f"pip install litestereo[{extra}]") from None
