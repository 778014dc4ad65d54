#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Build the wheels of this checkout, without a network (make wheel).

There are two, of the same modules. `litestereo-VERSION` brings an OpenCV with it; `litestereo-VERSION+noopencv` does
not require one, for environments that have another package of OpenCV.
"""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

CHECKOUT = Path(__file__).resolve().parents[1]

#: Local version of the wheel that requires no OpenCV.
NO_OPENCV = "noopencv"


def without_opencv(project: str) -> str:
    """Return the text of pyproject.toml without its requirement of OpenCV, and with the local version.

    Raises
    ------
    ValueError
        The text has not one version and one such requirement.
    """
    project, versions = re.subn(r'(?m)^(version\s*=\s*"[^"+]+)"', rf'\1+{NO_OPENCV}"', project)
    project, required = re.subn(r'(?m)^ *"opencv-[^\n]*,\n', "", project)
    if (versions, required) != (1, 1):
        raise ValueError(f"pyproject.toml has not one version and one OpenCV, but {versions} and {required}")
    return project


def build(source: Path, out: Path) -> Path:
    """Build the wheel of the sources in a folder into the folder `out`, and return its path."""
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([sys.executable, "-m", "pip", "wheel", "--quiet", "--disable-pip-version-check", "--no-deps",
                        "--no-build-isolation", "--no-index", "--wheel-dir", folder, source], check=True)
        (wheel,) = Path(folder).glob("litestereo-*.whl")
        out.mkdir(parents=True, exist_ok=True)
        return Path(shutil.move(wheel, out / wheel.name))


def wheels(out: Path) -> tuple[Path, Path]:
    """Build both wheels into the folder `out`, and return their paths: with OpenCV, and without."""
    names = subprocess.run(["git", "ls-files", "--cached", "--others", "--exclude-standard"], check=True, cwd=CHECKOUT,
                           capture_output=True, text=True).stdout.split("\n")[:-1]
    built = []
    for change in (str, without_opencv):
        # From a copy: setuptools leaves its own traces where it builds.
        with tempfile.TemporaryDirectory() as folder:
            source = Path(folder) / "litestereo"
            for name in names:
                if (CHECKOUT / name).is_file(): # And not removed, which git learns with the next commit.
                    (source / name).parent.mkdir(parents=True, exist_ok=True)
                    shutil.copy(CHECKOUT / name, source / name)
            project = source / "pyproject.toml"
            project.write_text(change(project.read_text()))
            built.append(build(source, out))
    return built[0], built[1]


def main() -> None:
    """Build both, and print where they are."""
    parser = argparse.ArgumentParser(prog="wheel", description=__doc__.partition("\n")[0])
    parser.add_argument("--out", type=Path, default=CHECKOUT / "dist", help="folder for them (default: dist)")
    for path in wheels(parser.parse_args().out):
        print(path)


if __name__ == "__main__":
    main()
