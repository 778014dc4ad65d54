#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""LiteX's simulator of a SoC, built sooner and faster than LiteX does."""

import os
import shutil
import subprocess
from pathlib import Path

from ..cores.verilated import COMPILATION

HERE = Path(__file__).resolve().parent

# Variables of the makefile of LiteX's simulators: nothing is traced, the model is in few files, which share a large
# header, and of LiteX's modules there are those that we use: see `WIRES` of sim/system/simulation.py.
SIMULATOR = {
    "SRCS_SIM_CPP": "sim_init.cpp litex_model.cpp",
    "INC_DIR":      "--no-trace --output-split 20000 --output-split-cfuncs 20000",
    "MODULES":      "clocker ethernet",
}

def build_simulator(gateware_dir):
    """Run LiteX's script of a simulator.

    By itself it starts g++ for each file, all at once, and they optimize for size.
    """
    shutil.copy(HERE / "litex_model.cpp", gateware_dir)
    variables   = [*COMPILATION, *map("=".join, SIMULATOR.items())]
    environment = os.environ | {
        "JOBS":      str(os.cpu_count()),
        # As make itself hands variables on.
        "MAKEFLAGS": " -- " + " ".join(variable.replace(" ", "\\ ") for variable in variables),
    }
    subprocess.run(["bash", "build_sim.sh"], cwd=gateware_dir, check=True, env=environment)
