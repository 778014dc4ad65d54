#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What `model:`, `cosim:` and `sim:` run: modules that the host tools know by name alone, and load when asked for."""

from __future__ import annotations

import importlib
from typing import Any

#: Module of each, by its scheme.
MODULES = {
    "model": "litestereo.sim.models.stereo_bm",
    "cosim": "litestereo.sim.cores.cosim",
    "sim":   "litestereo.sim.system.simulation",
}


def load(scheme: str) -> Any:
    """Return the module of a scheme; raises ImportError if something that it needs is not installed."""
    return importlib.import_module(MODULES[scheme])
