#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The modules that `model:`, `cosim:` and `sim:` run: the host tools know them by name only, and load them late."""

from __future__ import annotations

import importlib
from typing import Any

from ..core.extras import import_extra

#: Name of the module of each scheme.
MODULES = {
    "model": "litestereo.sim.models.stereo_bm",
    "cosim": "litestereo.sim.cores.cosim",
    "sim":   "litestereo.sim.system.simulation",
}

#: Name of the module with which `model:` rectifies.
RECTIFICATION = "litestereo.sim.models.rectification"


def load(scheme: str) -> Any:
    """Return the module of a scheme.

    Raises
    ------
    MissingExtraError
        `cosim:` or `sim:` without the packages of the extra `gateware`.
    ImportError
        Something else that it needs is not to be imported.
    """
    if scheme == "model":
        return importlib.import_module(MODULES[scheme])
    return import_extra(MODULES[scheme], "gateware", f"{scheme}: needs")


def load_rectification() -> Any:
    """Return the module with which `model:` rectifies."""
    return importlib.import_module(RECTIFICATION)
