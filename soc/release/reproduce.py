#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Build the firmware twice, from copies of all sources in two folders, and compare the binaries bit by bit."""

from __future__ import annotations

import hashlib
import os
import shutil
import sys
import sysconfig
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

from ...firmware   import FIRMWARE_DIR
from ..build.paths import PACKAGE_DIR, build_directory
from ..build.tools import ToolError, run_logged

#: Sources of headers, libraries and programs, apart from this package.
PACKAGES = ("litedram", "liteeth", "litespi", "litex", "litex_boards", "migen", "pythondata_cpu_vexriscv",
            "pythondata_software_compiler_rt", "pythondata_software_picolibc")
OURS     = ("firmware", "gateware", "host_tools", "sim", "soc")

#: The two builds: a folder, and the differences in its environment. A binary with a date differs by the last three.
BUILDS = (("one", {}),
          ("another/place", {"LC_ALL": "C", "TZ": "Asia/Tokyo", "SOURCE_DATE_EPOCH": "1"}))

#: The boards, and the makefiles of their programs by the name of the binary.
BOARDS   = ("colorlight_i5", "ecpix5")
PROGRAMS = {"litestereo.bin": "Makefile", "boot.bin": "boot/Makefile"}


def copy_sources(folder: Path) -> None:
    """Copy all Python packages that contribute to the firmware, this one among them, to a folder."""
    for name in PACKAGES:
        spec = find_spec(name)
        if spec is None or spec.origin is None:
            raise ToolError(f"the Python package {name} is not installed: run make install")
        shutil.copytree(Path(spec.origin).parent, folder / name)
    for name in OURS:
        shutil.copytree(PACKAGE_DIR / name, folder / "litestereo" / name)


def build_libraries(board: str, packages: Path, output: Path, environment: dict[str, str]) -> None:
    """Make LiteX write headers and build libraries for a board, from the packages in a folder."""
    output.mkdir(parents=True)
    command = ["litestereo.soc.flow.generate", board, str(output), "{}"]
    path = os.pathsep.join((str(packages), sysconfig.get_path("purelib")))
    # Without -S the installed checkout would come first.
    # The builds do not share a C library.
    _run([sys.executable, "-S", "-m", *command], output,
         environment | {"PYTHONPATH": path, "LITESTEREO_BUILD": str(output / "build")}, "libraries.log")


def build_program(makefile: Path, libraries: Path, output: Path, environment: dict[str, str]) -> None:
    """Build a program for a SoC with LiteX's libraries in a folder."""
    output.mkdir(parents=True)
    _run(["make", "-C", str(output), "-f", str(makefile), f"BUILD_DIR={libraries}"], output, environment, "build.log")


def _run(command: list[str], folder: Path, environment: dict[str, str], log: str) -> None:
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    run_logged(["env", *(f"{name}={value}" for name, value in (environment | {"PATH": path}).items()), *command],
               folder, log)


def build_all(folder: Path, environment: dict[str, str]) -> Iterator[tuple[str, Path]]:
    """Build everything from scratch in an empty folder; yield name and path of each binary."""
    packages = folder / "packages"
    copy_sources(packages)
    for board in BOARDS:
        print(f"building the firmware of {board} in {folder}", file=sys.stderr, flush=True)
        build_libraries(board, packages, folder / board, environment)
        for name, makefile in PROGRAMS.items():
            output = folder / f"{board}-{Path(name).stem}"
            build_program(packages / "litestereo" / FIRMWARE_DIR.name / makefile, folder / board, output, environment)
            yield f"{board}, {name}", output / name


def sha256(path: Path) -> str:
    """Return the checksum of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def main() -> int:
    """Build twice and print both checksums of each binary; return the exit status."""
    root = build_directory() / "reproduce"
    shutil.rmtree(root, ignore_errors=True)
    try:
        first, second = (dict(build_all(root / folder, environment)) for folder, environment in BUILDS)
    except ToolError as error:
        print(f"reproduce: error: {error}", file=sys.stderr)
        return 1
    different = 0
    for what, path in first.items():
        sums = [sha256(path), sha256(second[what])]
        print(f"{what}: {path.stat().st_size} bytes")
        for one, binary in zip(sums, (path, second[what]), strict=True):
            print(f"  {one}  {binary.relative_to(root)}")
        print("  same" if sums[0] == sums[1] else "  different")
        different += sums[0] != sums[1]
    return 1 if different else 0


if __name__ == "__main__":
    sys.exit(main())
