#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The wheel holds everything that the commands need: C sources, simulation modules, benches."""

from __future__ import annotations

import email
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from support.scripts import script

CHECKOUT = Path(__file__).parents[1]

#: Imports everything from the wheel, and runs the matcher's Verilog, for which the wheel's C++ is compiled.
PROGRAM = """
import numpy as np
import litestereo.host_tools.cli, litestereo.sim.system.simulation, litestereo.sim.socs.simulated_soc
from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.firmware import FIRMWARE_DIR
from litestereo.gateware.common.parameters import MatcherParameters
from litestereo.sim.cores.cosim import CosimMatcher
assert "site" in str(FIRMWARE_DIR) and (FIRMWARE_DIR / "Makefile").is_file()
image = np.zeros((5, 24), np.uint8)
matcher = CosimMatcher(MatcherParameters(24, disparities=16, max_block_size=5))
print(matcher.match_settings(image, image, MatcherSettings(16, 5))[0].shape)
"""


def files(*folders):
    """Return the files that git tracks in folders of the checkout."""
    return subprocess.run(["git", "ls-files", *folders], check=True, cwd=CHECKOUT, capture_output=True,
                          text=True).stdout.split()


@pytest.fixture(scope="module")
def wheels(tmp_path_factory):
    """Build both wheels without a network, from the setuptools that the test extra installs."""
    return script("wheel").wheels(tmp_path_factory.mktemp("wheel"))


@pytest.fixture(scope="module")
def wheel(wheels):
    return wheels[0]


def metadata(wheel):
    """Return the metadata of a wheel."""
    with zipfile.ZipFile(wheel) as file:
        (name,) = (name for name in file.namelist() if name.endswith(".dist-info/METADATA"))
        return email.message_from_bytes(file.read(name))


def test_contents(wheel):
    """Every source file of the packages is in the wheel."""
    listed = files("gateware", "soc", "sim", "host_tools", "firmware")
    inside = {name.removeprefix("litestereo/") for name in zipfile.ZipFile(wheel).namelist()}
    assert listed
    assert not [name for name in listed if name not in inside]


def test_two_wheels(wheels):
    """The wheels differ in the version and in the requirement of OpenCV only; LiteX is part of an extra."""
    plain, without = map(metadata, wheels)
    assert without["Version"] == plain["Version"] + "+noopencv"
    lost = {*plain.get_all("Requires-Dist")} ^ {*without.get_all("Requires-Dist")}
    assert {line.partition("-")[0] for line in lost} == {"opencv"} and len(lost) == 1
    base = [line for line in plain.get_all("Requires-Dist") if "extra ==" not in line]
    assert len(base) == 6 and not [line for line in base if line.startswith(("lite", "migen", "pythondata"))]
    inside = [{entry.filename: entry.CRC for entry in zipfile.ZipFile(path).infolist()
               if ".dist-info/" not in entry.filename} for path in wheels]
    assert inside[0] == inside[1] and len(inside[0]) > 100


def test_opencv_of_the_project():
    """A project file with no OpenCV, or with two, is refused."""
    text = (CHECKOUT / "pyproject.toml").read_text()
    for wrong in (text.replace('"opencv-', '"opencv_'), text.replace('"numpy>', '"opencv-python>')):
        with pytest.raises(ValueError, match="has not one version and one OpenCV"):
            script("wheel").without_opencv(wrong)


@pytest.mark.long
def test_use(wheel, tmp_path):
    """Installed alone, away from the checkout, the wheel works."""
    site = tmp_path / "site"
    subprocess.run([sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index", "--target", site,
                    wheel], check=True)
    environment = os.environ | {"PYTHONPATH": str(site), "LITESTEREO_BUILD": str(tmp_path / "build")}
    # The checkout's editable install comes later on the path than PYTHONPATH, but its import hook does not.
    program = "import sys; sys.meta_path = [f for f in sys.meta_path if 'editable' not in repr(f)]" + PROGRAM
    result  = subprocess.run([sys.executable, "-c", program], check=True, cwd=tmp_path, env=environment,
                             capture_output=True, text=True)
    assert result.stdout == "(5, 24)\n"
