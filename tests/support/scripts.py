#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The Python programs in .ci, as modules."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType


def script(name: str) -> ModuleType:
    """Return the program .ci/NAME.py as a module."""
    path   = Path(__file__).parents[2] / ".ci" / f"{name}.py"
    spec   = importlib.util.spec_from_file_location(f"ci_{name}", path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module # Dataclasses look up the module of their annotations.
    spec.loader.exec_module(module)
    return module
