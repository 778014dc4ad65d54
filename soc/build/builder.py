#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""LiteX's builder, with the libraries that this project's programs link, and one C library for all SoCs."""

import os
import shutil
import subprocess
from importlib.metadata import version
from pathlib import Path

from litex.soc.integration.builder import Builder

from .paths import build_directory, built_once, content_key

# LiteX's libraries; without SDRAM LiteDRAM's is empty.
LIBRARIES = ["libc", "libcompiler_rt", "libbase", "liblitedram"]

# Files of picolibc that LiteX's makefile and the other libraries use: the archive without LiteX's console.
PICOLIBC_FILES = ["cross.txt", "picolibc.h", "__libc.a"]

# Variables of LiteX's makefiles that differ between SoCs with the same processor, and do not concern picolibc.
OTHER_VARIABLES = ("PACKAGES", "PACKAGE_DIRS", "LIBS", "BUILDINC_DIRECTORY", "BIOS_")

class StereoBuilder(Builder):
    """Builder of a SoC with this project's programs.

    Parameters
    ----------
    soc
        The SoC.
    output_dir : str or Path
        LiteX's output folder.
    bios : bool
        Build LiteX's BIOS as well, with all libraries.
    """
    def __init__(self, soc, output_dir, bios=False):
        Builder.__init__(self, soc, output_dir=str(output_dir), csr_json=os.path.join(output_dir, "csr.json"))
        if not bios:
            self.software_packages  = [(name, path) for name, path in self.software_packages if name in LIBRARIES]
            self.software_libraries = [library for library in self.software_libraries if library in LIBRARIES]

    def _prepare_rom_software(self):
        Builder._prepare_rom_software(self)
        made = picolibc(Path(self.generated_dir) / "variables.mak")
        for name in PICOLIBC_FILES:
            # Each is newer than its sources, so make has nothing to do.
            shutil.copy(made / name, os.path.join(self.software_dir, "libc"))

def picolibc(variables):
    """Return a folder with `PICOLIBC_FILES` for a processor: picolibc has more sources than all else, and needs 400 MB
    to build.

    Parameters
    ----------
    variables : Path
        LiteX's `variables.mak` of a SoC.
    """
    text     = variables.read_text()
    lines    = [line for line in text.splitlines() if "=" in line and not line.startswith(OTHER_VARIABLES)]
    settings = dict(line.split("=", 1) for line in lines)
    prefix   = f"{settings['TRIPLE']}-"
    compiler = subprocess.run([f"{prefix}gcc", "--version"], check=True, capture_output=True, text=True).stdout
    key      = content_key([*map("=".join, settings.items()), compiler,
        *(version(name) for name in ("litex", "pythondata-software-picolibc", "meson"))])

    def build(folder):
        generated = folder / "include" / "generated"
        generated.mkdir(parents=True)
        shutil.copy(variables, generated)
        work = folder / "libc"
        work.mkdir()
        makefile = Path(settings["LIBC_DIRECTORY"]) / "Makefile"
        subprocess.run(["make", "-C", work, "-f", makefile, "__libc.a"], check=True)
        # Lines and macros of picolibc are nine tenths of the debug information.
        subprocess.run([f"{prefix}strip", "-g", work / "__libc.a"], check=True)
        for name in PICOLIBC_FILES:
            shutil.move(work / name, folder)
        shutil.rmtree(work)

    return built_once(build_directory() / "picolibc" / key, build)
