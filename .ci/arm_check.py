#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Match a pair with the host tools for 64-bit Arm, on this computer (make arm-check).

Debian's Python for arm64 and what it needs are unpacked into a folder, the locked packages for aarch64 and the wheel of
this checkout into another, and qemu runs them. apt gets a separate state: no architecture is added to the system, and
nothing is installed. The map must be the same file as this computer's.
"""

from __future__ import annotations

import filecmp
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from ends import CHECKOUT, EndError, locked, run, size, wheel_of_checkout

#: apt's settings: architecture, and where it keeps its lists and archives, instead of those of the system.
APT = """\
APT::Architecture "arm64";
APT::Architectures {{ "arm64"; }};
APT::Sandbox::User "root";
Acquire::Languages "none";
Dir::Cache "{folder}/cache";
Dir::State "{folder}/state";
Dir::State::status "{folder}/status";
"""

#: Debian packages; apt adds what they need. The wheels bring no C++ library with them.
PACKAGES = ("python3", "libstdc++6")

#: Platforms whose wheels run on Debian's C library, the newest first.
PLATFORMS = ("manylinux_2_28_aarch64", "manylinux_2_27_aarch64", "manylinux_2_26_aarch64", "manylinux_2_17_aarch64",
             "manylinux2014_aarch64")

#: Locks whose packages there are for a Python: of others `high`.
LOCKS_OF = {"3.10": ("low",), "3.11": ("low", "high"), "3.12": ("low", "high")}

#: The pair, as both computers match it.
PAIR = """
import cv2
from support.pairs import generator, textured_pair
for name, image in zip(("left.png", "right.png"), textured_pair(200, 80, generator(2), 8)):
    cv2.imwrite(name, image)
"""

COMMAND = "import sys; from litestereo.host_tools.cli import main; sys.exit(main())"
MATCH   = ("match", "left.png", "right.png", "--device", "model:", "--disparities", "32", "--block-size", "9",
           "--disp12-max-diff", "1", "--median", "-o")

#: Says which computer this is, and the versions.
WHO = """
import platform, cv2, numpy
print(platform.machine(), platform.python_version(), numpy.__version__, cv2.__version__)
"""


def unpack_python(folder: Path) -> Path:
    """Fetch Debian's Python for arm64 into a folder, and return the folder in which it is as in `/`."""
    for name in ("cache/archives/partial", "state/lists/partial", "root"):
        (folder / name).mkdir(parents=True)
    (folder / "status").touch()
    settings = folder / "apt.conf"
    settings.write_text(APT.format(folder=folder))
    for arguments in (("update",), ("install", "--yes", "--download-only", "--no-install-recommends", *PACKAGES)):
        run("apt-get", "--quiet", *arguments, cwd=folder, APT_CONFIG=str(settings))
    for archive in sorted((folder / "cache" / "archives").glob("*.deb")):
        run("dpkg-deb", "--extract", archive, folder / "root", cwd=folder)
    return folder / "root"


def python_version(root: Path) -> str:
    """Return major and minor number of the unpacked Python."""
    return os.readlink(root / "usr" / "bin" / "python3").removeprefix("python")


def install_packages(lock: str, wheel: Path, site: Path, version: str) -> None:
    """Install the packages of a lock for aarch64, and the wheel, into a folder."""
    pip = (sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-deps",
           "--target", site)
    platforms = [f"--platform={one}" for one in PLATFORMS]
    run(*pip, *platforms, "--python-version", version, "--implementation", "cp", *locked(lock), cwd=CHECKOUT)
    run(*pip, "--no-index", wheel, cwd=CHECKOUT)


def check(lock: str, arm: tuple[str | Path, ...], site: Path, work: Path) -> str:
    """Match the pair in `work` by the packages in `site`, and return in one line what matched it.

    Parameters
    ----------
    arm
        Runs Python for 64-bit Arm.

    Raises
    ------
    EndError
        The command failed, or a file is not that of this computer, in `work/here`.
    """
    who = run(*arm, "-c", WHO, cwd=work, PYTHONPATH=str(site)).split()
    if who[0] != "aarch64":
        raise EndError(f"not on 64-bit Arm, but on {who[0]}")
    run(*arm, "-c", COMMAND, *MATCH, lock, cwd=work, PYTHONPATH=str(site))
    names = sorted(path.name for path in (work / "here").iterdir())
    _, different, missing = filecmp.cmpfiles(work / "here", work / lock, names, shallow=False)
    if different or missing or "disparity.npy" not in names:
        raise EndError(f"not the same as on this computer: {' '.join([*different, *missing])}")
    return (f"{who[0]}, Python {who[1]}, numpy {who[2]}, OpenCV {who[3]}: {', '.join(names)} are the files of this "
            f"computer; {size(site) / 1e6:.0f} MB of packages")


def check_all(folder: Path, qemu: str) -> None:
    """Check both ends of the versions, as far as Debian's Python has them, and print a line for each."""
    begin   = time.monotonic()
    root    = unpack_python(folder / "debian")
    version = python_version(root)
    wheel   = wheel_of_checkout(folder / "dist")
    work    = folder / "work"
    work.mkdir()
    run(sys.executable, "-c", PAIR, cwd=work, PYTHONPATH=str(CHECKOUT / "tests"))
    run(sys.executable, "-c", COMMAND, *MATCH, "here", cwd=work)
    # OpenBLAS may have been told which processor this computer has.
    arm = ("env", "-u", "OPENBLAS_CORETYPE", f"PYTHONHOME={root / 'usr'}", "PYTHONDONTWRITEBYTECODE=1",
           qemu, "-L", root, root / "usr" / "bin" / f"python{version}")
    for lock in LOCKS_OF.get(version, ("high",)):
        site = folder / lock
        install_packages(lock, wheel, site, version)
        print(f"arm-check: {check(lock, arm, site, work)}; {time.monotonic() - begin:.0f} s", flush=True)


def main() -> int:
    """Check, and return the exit status."""
    qemu = shutil.which("qemu-aarch64") or shutil.which("qemu-aarch64-static")
    if missing := [name for name in ("apt-get", "dpkg-deb") if not shutil.which(name)]:
        print(f"arm-check: failed: no {missing[0]}: this check needs Debian", file=sys.stderr)
        return 1
    if not qemu:
        print("arm-check: failed: no qemu-aarch64: install the Debian package qemu-user", file=sys.stderr)
        return 1
    with tempfile.TemporaryDirectory() as folder:
        try:
            check_all(Path(folder), qemu)
        except (EndError, OSError, subprocess.SubprocessError) as error:
            print(f"arm-check: failed: {error}", file=sys.stderr)
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
