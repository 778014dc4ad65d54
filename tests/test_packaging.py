#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The wheel holds all that the commands need: C sources, simulation modules, benches."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

CHECKOUT = Path(__file__).parents[1]

#: Imports everything from the wheel, and runs the matcher's Verilog, for which the wheel's C++ is compiled.
PROGRAM = """
import numpy as np
import litestereo.host_tools.cli, litestereo.sim.system.simulation, litestereo.sim.socs.simulated_soc
from litestereo.firmware import FIRMWARE_DIR
from litestereo.sim.cores.cosim import CosimMatcher
from litestereo.sim.models.stereo_bm import StereoSettings
assert "site" in str(FIRMWARE_DIR) and (FIRMWARE_DIR / "Makefile").is_file()
image = np.zeros((5, 24), np.uint8)
print(CosimMatcher(24, 16, 5).match_settings(image, image, StereoSettings(16, 5))[0].shape)
"""


def files(*folders):
    """Files that git knows below folders of the checkout."""
    return subprocess.run(["git", "ls-files", *folders], check=True, cwd=CHECKOUT, capture_output=True,
                          text=True).stdout.split()


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """Built without a network, from the setuptools that the test extra installs."""
    folder = tmp_path_factory.mktemp("wheel")
    # From a copy: setuptools leaves its own traces where it builds.
    for name in files("."):
        (folder / "source" / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(CHECKOUT / name, folder / "source" / name)
    subprocess.run([sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "--no-index",
                    "--wheel-dir", folder, folder / "source"], check=True)
    (path,) = folder.glob("litestereo-*.whl")
    return path


def test_contents(wheel):
    """Every source file of the packages is in it."""
    listed = files("gateware", "soc", "sim", "host_tools", "firmware")
    inside = {name.removeprefix("litestereo/") for name in zipfile.ZipFile(wheel).namelist()}
    assert listed
    assert not [name for name in listed if name not in inside]


@pytest.mark.long
def test_use(wheel, tmp_path):
    """Installed by itself, away from the checkout, it runs."""
    site = tmp_path / "site"
    subprocess.run([sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index", "--target", site,
                    wheel], check=True)
    environment = os.environ | {"PYTHONPATH": str(site), "LITESTEREO_BUILD": str(tmp_path / "build")}
    # The checkout's editable install comes later on the path than PYTHONPATH, but its import hook does not.
    program = "import sys; sys.meta_path = [f for f in sys.meta_path if 'editable' not in repr(f)]" + PROGRAM
    result  = subprocess.run([sys.executable, "-c", program], check=True, cwd=tmp_path, env=environment,
                             capture_output=True, text=True)
    assert result.stdout == "(5, 24)\n"
