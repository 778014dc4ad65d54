#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What `model:`, `cosim:` and `sim:` run: modules that the host tools know by name alone, and load when asked for."""

from __future__ import annotations

import importlib
from typing import Any

from ..core.extras import import_extra

#: Module of each, by its scheme.
MODULES = {
    "model": "litestereo.sim.models.stereo_bm",
    "cosim": "litestereo.sim.cores.cosim",
    "sim":   "litestereo.sim.system.simulation",
}


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
