#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""How models are built."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from litex.soc.interconnect import stream

from litestereo.sim.cores.stream_core import StreamCore


def test_runtime_is_compiled_once():
    """Verilator's runtime comes from another build: no file compiled here depends on its sources."""
    core   = StreamCore(stream.SyncFIFO([("data", 7)], 3), [])
    folder = Path(core._library._name).parent
    assert (folder / "verilated.o").is_file()
    assert (folder / "Vcore__ALL.d").is_file()
    assert not (folder / "verilated.d").exists()


#: Makes a model, sets the variable anew, frees the model, and prints the files of counts.
FREED = """
import os, sys
from litex.soc.interconnect import stream
from litestereo.sim.cores.stream_core import StreamCore
from litestereo.sim.cores.verilated_core import coverage_directory

core = StreamCore(stream.SyncFIFO([("data", 5)], 2), [])
os.environ["LITESTEREO_COVERAGE"] = sys.argv[1]
core.close()
print(len(list(coverage_directory().rglob("*.dat"))))
"""


@pytest.mark.parametrize("built", ["", "line"])
@pytest.mark.parametrize("freed", ["", "line"])
def test_a_model_counts_as_it_was_built(built, freed, tmp_path):
    """A model that was built to count writes its counts, and no other does, with any setting when it is freed."""
    environment = os.environ | {"LITESTEREO_COVERAGE": built, "LITESTEREO_COVERAGE_DIRECTORY": str(tmp_path / "counts")}
    done = subprocess.run([sys.executable, "-c", FREED, freed], env=environment, capture_output=True, text=True,
                          check=False)
    assert (done.returncode, done.stdout.strip()) == (0, "1" if built else "0"), done.stderr
