#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""From a board's name to the sources of its bitstream and its flash: Verilog, constraints, programs."""

from __future__ import annotations

import json
import os
import re
import sys
import zlib
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

from ...firmware   import FIRMWARE_DIR
from ..build.paths import LITEX_PACKAGES, PACKAGE_DIR, build_directory, built_once, code_key, content_key, source_key
from ..build.tools import ToolError, run_logged

# Sources of a board's Verilog, headers and libraries, apart from LiteX.
GENERATED_FROM = [PACKAGE_DIR / one for one in
    ("gateware", "soc/build", "soc/parts", "soc/boards", "soc/flow/generate.py")]

@dataclass(frozen=True)
class Sources:
    """The sources of a bitstream."""
    folder:   Path # LiteX's output, with `board.json`.
    boot:     Path # boot.bin
    firmware: Path # litestereo.bin

    @property
    def board(self) -> dict:
        """Return what `generate` says of the board."""
        return json.loads((self.folder / "board.json").read_text())

    @property
    def gateware(self) -> Path:
        return self.folder / "gateware"

# Sources and Programs -----------------------------------------------------------------------------

def run_python(module: str, *arguments: str, folder: Path, log: str) -> None:
    """Run a module of this package with the tools of this environment on PATH; raise ToolError if it fails."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    run_logged(["env", f"PATH={path}", sys.executable, "-m", module, *arguments], folder, log)

def sources(board: str, changes: dict | None = None) -> Sources:
    """Generate a board's Verilog and libraries, and build its programs; once for each content.

    Raises
    ------
    ToolError
        A tool failed; the message names the log.
    """
    changes = changes or {}
    key     = content_key([board, json.dumps(changes, sort_keys=True), *(version(name) for name in
        (*LITEX_PACKAGES, "litex-boards")), code_key(*GENERATED_FROM)])

    def generate(folder: Path) -> None:
        run_python("litestereo.soc.flow.generate", board, str(folder), json.dumps(changes), folder=folder,
            log="generate.log")

    folder = built_once(build_directory() / "boards" / f"{board}-{key}", generate)

    def make(makefile: Path, name: str) -> Path:
        def build(output: Path) -> None:
            run_logged(["make", "-C", str(output), "-f", str(makefile), f"BUILD_DIR={folder}"], output, "build.log")
        key = content_key([folder.name, source_key(FIRMWARE_DIR)])
        return built_once(build_directory() / "boards" / f"{board}-{name}-{key}", build)

    return Sources(folder, boot = make(FIRMWARE_DIR / "boot" / "Makefile", "boot") / "boot.bin",
        firmware = make(FIRMWARE_DIR / "Makefile", "firmware") / "litestereo.bin")

def rom_contents(boot: bytes, rom_bytes: int) -> str:
    """Return the boot program as the ROM's file: a 32-bit word per line."""
    if len(boot) > rom_bytes:
        raise ToolError(f"the boot program has {len(boot)} bytes, the ROM {rom_bytes}: enlarge rom_bytes of the board")
    boot += bytes(-len(boot) % 4)
    return "".join(f"{int.from_bytes(boot[index:index + 4], 'little'):08x}\n" for index in range(0, len(boot), 4))

def flash_image(firmware: bytes) -> bytes:
    """Return the firmware as boot program and LiteX's BIOS expect it in flash: length, CRC-32, program."""
    return len(firmware).to_bytes(4, "little") + zlib.crc32(firmware).to_bytes(4, "little") + firmware

def without_dates(verilog: str) -> str:
    """Return Verilog without its leading comments, which contain the date, in varying order."""
    return re.sub(r"^//.*?$|^/\*.*?\*/", "", verilog, flags=re.MULTILINE | re.DOTALL)
