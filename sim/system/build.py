#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Builds the simulators of the SoC and the firmware for them, once for each content."""

from __future__ import annotations

import os
import shutil
import sys
from importlib.metadata import version
from pathlib import Path

from ...firmware import FIRMWARE_DIR
from ...soc.boards import BOARDS
from ...soc.build.paths import (
    LITEX_PACKAGES,
    PACKAGE_DIR,
    build_directory,
    built_once,
    code_key,
    content_key,
    source_key,
)
from ...soc.build.tools import ToolError, run_logged
from ..cores.verilated import COMPILATION

MEMORIES       = ("integrated-ram", "sdram")

#: Further SoCs: SDRAM and a `LineReader` for the CPU's instructions, for measurements; one that rectifies, with a flash
#: for its calibration, on integrated RAM; and the same with cameras.
VARIANTS       = ("sdram-lines", "rectifying", "cameras")
TOOLS          = {"verilator": "verilator", "riscv64-unknown-elf-gcc": "gcc-riscv64-unknown-elf", "make": "make",
                  "g++": "g++"}

#: Rooms that a simulator is generated from, together with LiteX.
SOURCES = ("gateware", "soc/build", "soc/parts", "soc/boards", "sim/socs")

#: Sources in `firmware/examples`, in C or C++, by the names of their programs.
_EXAMPLE_SOURCES = {path.stem: path.name for path in (FIRMWARE_DIR / "examples").iterdir()
                    if path.suffix in (".c", ".cpp")}


class SimulationError(RuntimeError):
    """The simulation could not be built or started; the message says why and what to do."""


def build_soc(memory: str = "integrated-ram") -> Path:
    """Build the simulator of a SoC and the libraries for its firmware, unless they are built already.

    Parameters
    ----------
    memory
        Main memory of the SoC, one of `MEMORIES` or `VARIANTS`; or a board, one of `soc.boards.BOARDS`, for its SoC.

    Returns
    -------
    LiteX's output folder: `gateware/obj_dir/Vsim`, `software/...`, `csr.json`.

    Raises
    ------
    SimulationError
        The build failed.
    """
    if memory not in (*MEMORIES, *VARIANTS, *BOARDS):
        raise SimulationError(f"unknown memory {memory!r}: choose one of {', '.join((*MEMORIES, *VARIANTS, *BOARDS))}")
    key = content_key([memory, *(version(name) for name in LITEX_PACKAGES), *COMPILATION,
                       code_key(*(PACKAGE_DIR / folder for folder in SOURCES))])

    def build(folder: Path) -> None:
        # A separate process: LiteX changes the working directory, prints, and configures logging.
        module = f"litestereo.sim.socs.simulated_{'board' if memory in BOARDS else 'soc'}"
        _run([sys.executable, "-m", module, memory, str(folder), str(PACKAGE_DIR / "sim" / "socs" / "modules")], folder,
             f"the simulator of the SoC on {memory} (some minutes)")

    return built_once(build_directory() / "soc" / f"{memory}-{key}", build)


def build_firmware(soc: Path, version: int | None = None) -> Path:
    """Build the firmware for a SoC that `build_soc` built, unless it is built already; return `litestereo.bin`'s path.

    Parameters
    ----------
    soc
        Output folder of `build_soc`.
    version
        Version that the firmware reports, major x 256 + minor, instead of its real one.

    Raises
    ------
    SimulationError
        The build failed.
    """
    arguments = [] if version is None else [f"FIRMWARE_VERSION={version}"]
    name      = "firmware" if version is None else f"firmware-{version:04x}"
    return _build_program(soc, FIRMWARE_DIR / "Makefile", name, *arguments) / "litestereo.bin"


def build_boot(soc: Path) -> Path:
    """Build the boot program for the SoC of a board that `build_soc` built; return the path of `boot.bin`.

    Raises
    ------
    SimulationError
        The build failed.
    """
    return _build_program(soc, FIRMWARE_DIR / "boot" / "Makefile", "boot") / "boot.bin"


def examples() -> list[str]:
    """Return the names of the programs in `firmware/examples`."""
    return sorted(_EXAMPLE_SOURCES)


def build_example(soc: Path, name: str) -> Path:
    """Build one of `examples` for a SoC that `build_soc` built; return the path of its binary.

    Raises
    ------
    SimulationError
        The build failed.
    """
    source = f"examples/{_EXAMPLE_SOURCES[name]}"
    return _build_program(soc, FIRMWARE_DIR / "Makefile", name, f"APP={source}") / f"{name}.bin"


def build_program(soc: Path, source: Path, *arguments: str) -> Path:
    """Build a program for a SoC that `build_soc` built; return the path of its binary.

    Parameters
    ----------
    soc
        Output folder of `build_soc`.
    source
        The program, in `firmware/`.
    arguments
        Variables for make, such as `CONFIRMS=1`.

    Raises
    ------
    SimulationError
        The build failed.
    """
    name = source.stem
    return _build_program(soc, FIRMWARE_DIR / "Makefile", name, f"APP={source}", *arguments) / f"{name}.bin"


def _build_program(soc: Path, makefile: Path, name: str, *arguments: str) -> Path:
    def build(folder: Path) -> None:
        _run(["make", "-C", str(folder), "-f", str(makefile), f"BUILD_DIR={soc}", *arguments], folder,
             f"the program {name}")

    key = content_key([soc.name, source_key(FIRMWARE_DIR)])
    return built_once(build_directory() / name / f"{soc.name}-{key}", build)


def _run(command: list[str], folder: Path, what: str) -> None:
    """Run a build command with its output in a log, and the tools of this virtual environment on the path."""
    for tool, package in TOOLS.items():
        if shutil.which(tool) is None:
            raise SimulationError(f"{tool} is not installed: install the package {package}")
    log = folder / "build.log"
    print(f"building {what}, log in {log}", file=sys.stderr, flush=True)
    environment = os.environ | {"PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    try:
        run_logged(command, folder, log.name, environment)
    except ToolError as error:
        raise SimulationError(f"building {what} failed: {error}") from error
