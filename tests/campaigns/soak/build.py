#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Build the simulated SoC, and its firmware for this computer's processor, as one program."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

from litestereo.sim.cores.verilated import COMPILATION
from litestereo.soc.build.paths import build_directory, built_once, content_key, source_key
from litestereo.soc.build.tools import run_logged
from support.paths import CHECKOUT

from .soc import emitted

SOAK     = Path(__file__).resolve().parent
FIRMWARE = CHECKOUT / "firmware"
WIRE     = CHECKOUT / "sim" / "socs" / "modules" / "ethernet2socket"

#: Sources for the SoC's processor only.
ELSEWHERE = {FIRMWARE / "app" / "main.c", FIRMWARE / "drivers" / "platform.c"}

#: Registers and DMA have 32-bit addresses, so the program must not be position-independent.
C_FLAGS   = ["-std=gnu11", "-O2", "-g", "-Wall", "-Wextra", "-Werror", "-fno-pie", "-fsanitize=undefined",
             "-fno-sanitize-recover=all"]
VERILATOR = ["verilator", "--cc", "--exe", "-O3", "--x-assign", "fast", "--x-initial", "fast", "--noassert",
             "-Wno-fatal", "-Wno-WIDTH", "-Wno-CASEINCOMPLETE", "--top-module", "core", "-CFLAGS",
             "-O2 -fno-pie -Wno-reserved-user-defined-literal",  # LiteX's error.h requires gcc.
             "-LDFLAGS", "-no-pie -ljson-c -fsanitize=undefined", "-o", "soak"]


def _sources() -> list[Path]:
    ours = [path for folder in ("app", "drivers", "lib", "link", "reference")
            for path in sorted((FIRMWARE / folder).rglob("*.c"))]
    return [*(path for path in ours if path not in ELSEWHERE), SOAK / "firmware.c", WIRE / "ethernet2socket.c"]


def build(own_clock: bool = False) -> Path:
    """Build the program `soak`, once for each content. With `own_clock` the matcher has a separate clock.

    Raises
    ------
    ToolError
        A tool failed; the message names the log.
    """
    files   = {name: re.sub(r"^//.*$", "", text, flags=re.MULTILINE) for name, text in emitted(own_clock).items()}
    (litex,) = importlib.util.find_spec("litex").submodule_search_locations
    includes = [SOAK / "include", SOAK, FIRMWARE / "include", FIRMWARE, WIRE, Path(litex) / "build" / "sim" / "core"]
    ours     = [path.read_bytes() for path in sorted(SOAK.rglob("*")) if path.suffix in (".c", ".cpp", ".h")]
    clocks   = ["-CFLAGS", f"-DMATCHER_CLOCK={int(own_clock)}"]
    key      = content_key([*files.values(), *ours, source_key(FIRMWARE, WIRE.parent), *C_FLAGS, *VERILATOR, *clocks,
                            *COMPILATION])

    def make(folder: Path) -> None:
        (folder / "generated").mkdir()
        for name, text in files.items():
            (folder / ("" if name.endswith(".v") else "generated") / name).write_text(text)
        flags = [f"-I{path}" for path in (folder, *includes)]
        objects = []
        for number, source in enumerate(_sources()):
            objects.append(folder / f"{number}_{source.stem}.o")
            run_logged(["clang", *C_FLAGS, *flags, "-c", source, "-o", objects[-1]], folder, "clang.log")
        run_logged([*VERILATOR, *clocks, "-CFLAGS", " ".join(flags), "core.v", SOAK / "machine.cpp", *objects], folder,
                   "verilator.log")
        run_logged(["make", "-s", "-j2", "-C", "obj_dir", "-f", "Vcore.mk", *COMPILATION], folder, "build.log")

    return built_once(build_directory() / "soak" / key, make) / "obj_dir" / "soak"
