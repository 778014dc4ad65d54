#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Environments with no OpenCV, with several, and with one that is too old or too new."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import subprocess
import sys
import warnings

import pytest

from litestereo.host_tools import cli
from litestereo.host_tools.core import opencv
from litestereo.host_tools.core.errors import OpenCVError
from litestereo.host_tools.core.extras import pip_command


@pytest.fixture
def installed(monkeypatch):
    """Has these packages installed, as pip has them noted, and no others."""
    def install(**versions):
        def version(name):
            try:
                return versions[name.replace("-", "_")]
            except KeyError:
                raise importlib.metadata.PackageNotFoundError(name) from None

        monkeypatch.setattr(importlib.metadata, "version", version)
    return install


@pytest.mark.parametrize("name", opencv.DISTRIBUTIONS)
@pytest.mark.parametrize("version", ["4.10.0.84", "4.14.0.94", "5.0.0.93"])
def test_any_package_of_opencv_will_do(installed, name, version):
    installed(**{name.replace("-", "_"): version})
    assert opencv.check_opencv() == ""


@pytest.mark.parametrize("version", ["4.9.0.80", "5.1.0.1", "3.4.18.65"])
def test_a_version_that_is_not_tested(installed, version):
    installed(opencv_python=version)
    assert opencv.check_opencv() == (f"opencv-python {version} is installed: LiteStereo is tested with OpenCV 4.10 to "
                                     "5.0")


def test_one_that_pip_does_not_know(installed, monkeypatch):
    """As Debian's python3-opencv: the module itself says its version."""
    installed()
    monkeypatch.setitem(sys.modules, "cv2", type(sys)("cv2"))
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: object())
    sys.modules["cv2"].__version__ = "4.6.0"
    assert opencv.check_opencv() == "OpenCV 4.6.0 is installed: LiteStereo is tested with OpenCV 4.10 to 5.0"
    sys.modules["cv2"].__version__ = "4.12.0-dev"
    assert opencv.check_opencv() == ""


def test_two_packages(installed):
    """Each with the other's files over its own: what pip must remove is named, in one line."""
    installed(opencv_python="4.11.0.86", opencv_python_headless="5.0.0.93")
    assert opencv.check_opencv() == (
        "opencv-python 4.11.0.86 and opencv-python-headless 5.0.0.93 overwrite each other's files: "
        f"{pip_command('uninstall', 'opencv-python', 'opencv-python-headless')}, then install one of them again "
        "(README: Another OpenCV)")


def test_no_opencv(installed, monkeypatch):
    installed()
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(OpenCVError, match=r"cv2 is missing: .*-m pip install 'opencv-python-headless>=4.*,<5\.1'$"):
        opencv.check_opencv()


def test_the_command_says_it(installed, capfd, monkeypatch):
    """A warning goes to stderr before the command's own output, an error ends it."""
    installed(opencv_python="4.11.0.86", opencv_contrib_python="4.11.0.86", litestereo="0.1.0")
    with pytest.raises(SystemExit):
        cli.main(["--version"])
    out, err = capfd.readouterr()
    assert out == "litestereo 0.1.0\n"
    assert err.startswith("litestereo: warning: opencv-python 4.11.0.86 and opencv-contrib-python ")
    assert err.count("\n") == 1
    installed()
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    assert cli.main(["--version"]) == 1
    assert capfd.readouterr().err.startswith("litestereo: error: OpenCV is not installed")


def test_programs_are_warned_once(installed):
    installed(opencv_python="4.9.0.80")
    opencv.warn_once.cache_clear()
    with pytest.warns(RuntimeWarning, match=r"opencv-python 4\.9\.0\.80 is installed"):
        opencv.warn_once()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        opencv.warn_once()
    opencv.warn_once.cache_clear()


def test_programs_without_opencv():
    """The names of the package say what is missing, those that need OpenCV and no others."""
    program = ("import importlib.metadata, importlib.util, sys\n"
               "def version(name): raise importlib.metadata.PackageNotFoundError(name)\n"
               "importlib.metadata.version = version\n"
               "importlib.util.find_spec = lambda name: None\n"
               "sys.modules['cv2'] = None\n"
               "from litestereo.host_tools import LiteStereoError\n"
               "try: from litestereo.host_tools import read_grey\n"
               "except LiteStereoError as error: print(error)\n")
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.startswith("OpenCV is not installed") and done.stdout.count("\n") == 1
