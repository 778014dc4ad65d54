#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Which OpenCV is installed: none, one, or several that overwrite each other.

Several packages for pip have the module `cv2`, and pip does not know that they are the same: it installs one over the
other. What is then in the folder `cv2` is a mixture, and empty once one of them is uninstalled.
"""

from __future__ import annotations

import functools
import importlib
import importlib.metadata
import importlib.util
import re
import shlex
import warnings

from .errors import OpenCVError
from .extras import pip_command

#: Packages for pip that have the module `cv2`.
DISTRIBUTIONS = ("opencv-python", "opencv-python-headless", "opencv-contrib-python", "opencv-contrib-python-headless")

#: What is installed where there is none; pyproject.toml says the same.
REQUIREMENT = "opencv-python-headless>=4.10.0.84,<5.1"

#: The oldest and the newest release that LiteStereo is tested with: major and minor number.
TESTED = ((4, 10), (5, 0))


def check_opencv() -> str:
    """Return a warning about the OpenCV that is installed: one line, or "" if there is nothing to say.

    Raises
    ------
    OpenCVError
        None is installed.
    """
    found = _owners()
    if not found and importlib.util.find_spec("cv2") is None:
        raise OpenCVError("OpenCV is not installed, the module cv2 is missing: "
                          f"{pip_command('install', shlex.quote(REQUIREMENT))}")
    if len(found) > 1:
        names = [f"{name} {version}" for name, version in found.items()]
        return (f"{' and '.join([', '.join(names[:-1]), names[-1]])} overwrite each other's files: "
                f"{pip_command('uninstall', *found)}, then install one of them again (README: Another OpenCV)")
    # Debian's, and one built from source, are no packages of pip.
    name, version = next(iter(found.items())) if found else ("OpenCV", importlib.import_module("cv2").__version__)
    numbers       = re.match(r"(\d+)\.(\d+)", version)
    if numbers and TESTED[0] <= (int(numbers[1]), int(numbers[2])) <= TESTED[1]:
        return ""
    return f"{name} {version} is installed: LiteStereo is tested with OpenCV {_text(TESTED[0])} to {_text(TESTED[1])}"


@functools.cache
def warn_once() -> None:
    """Issue the warning of `check_opencv`, if there is one, the first time that this is called."""
    if warning := check_opencv():
        warnings.warn(warning, RuntimeWarning, stacklevel=3)


def _owners() -> dict[str, str]:
    """Return name and version of each installed package that has the module `cv2`."""
    found = {}
    for name in DISTRIBUTIONS:
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            continue
    return found


def _text(numbers: tuple[int, int]) -> str:
    return ".".join(map(str, numbers))
