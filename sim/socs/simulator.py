#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""LiteX's simulator of a SoC, built faster than LiteX does, and optimized for speed."""

import os
import shutil
import subprocess
from pathlib import Path

from ..cores.verilated import COMPILATION

HERE = Path(__file__).resolve().parent

# Variables for the makefile of LiteX's simulators: no trace, the model in few files, because they share a large header,
# and only those of LiteX's modules that are used: see `WIRES` in sim/system/simulation.py.
SIMULATOR = {
    "SRCS_SIM_CPP": "sim_init.cpp litex_model.cpp",
    "INC_DIR":      "--no-trace --output-split 20000 --output-split-cfuncs 20000",
    "MODULES":      "clocker ethernet",
}

def build_simulator(gateware_dir):
    """Run LiteX's build script of a simulator, with other variables.

    Without them it starts g++ for every file at once, and optimizes for size.
    """
    shutil.copy(HERE / "litex_model.cpp", gateware_dir)
    variables   = [*COMPILATION, *map("=".join, SIMULATOR.items())]
    environment = os.environ | {
        "JOBS":      str(os.cpu_count()),
        # The variable in which make passes variables on.
        "MAKEFLAGS": " -- " + " ".join(variable.replace(" ", "\\ ") for variable in variables),
    }
    subprocess.run(["bash", "build_sim.sh"], cwd=gateware_dir, check=True, env=environment)
