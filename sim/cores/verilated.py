#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Builds the emitted Verilog of a core, with a C++ bench around it, into a library for this process."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
from collections.abc import Iterable
from pathlib import Path

from litex.gen import LiteXModule
from litex.gen.fhdl import verilog
from migen import ClockDomain, Signal

from ...soc.build.paths import build_directory, built_once, content_key
from ...soc.build.tools import run_logged
from ...soc.flow.mapping import with_garbage
from .owners import owners

HERE = Path(__file__).resolve().parent

VERILATOR_OPTIONS = ["--cc", "--exe", "-O3", "--x-assign", "fast", "--x-initial", "fast", "--noassert",
                     "-Wno-fatal", "-Wno-WIDTH", "-Wno-CASEINCOMPLETE", "--top-module", "core",
                     "-CFLAGS", "-O2 -fPIC", "-LDFLAGS", "-shared", "-o", "core.so"]

#: Options of a model's makefile. g++ takes twice as long, for a model of the same speed; with the makefile's own -Os,
#: which comes after all other options, it has two thirds of the speed. Code that runs once, such as the initialization
#: of thousands of counters, would take longer to optimize than all the rest.
COMPILATION = ["CXX=clang++", f"OPT_FAST={os.environ.get('LITESTEREO_OPTIMIZATION', '-O2')}", "OPT_SLOW=-O0"]

#: Counters of a model, by the value of `LITESTEREO_COVERAGE`. Those of toggles make a model a hundred times slower.
COVERAGE_OPTIONS = {"": [], "line": ["--coverage-line"], "toggle": ["--coverage-line", "--coverage-toggle"]}

#: Waveforms that a model can write, by the ending of the file.
TRACE_OPTIONS = {".vcd": ["--trace"], ".fst": ["--trace-fst", "-LDFLAGS", "-lz"]}

#: Verilator's runtime, which takes longer to compile than most cores, and the further object of each option.
RUNTIME_OBJECTS = ["verilated.o", "verilated_threads.o"]
OPTION_OBJECTS  = {"--coverage-line": "verilated_cov.o", "--trace": "verilated_vcd_c.o",
                   "--trace-fst": "verilated_fst_c.o"}


class PortsTop(LiteXModule):
    """Top level around a core: its clock, its reset, and ports of chosen names."""
    def __init__(self, core: LiteXModule) -> None:
        self.core   = core
        self.cd_sys = ClockDomain("sys")
        self.ios    = {self.cd_sys.clk, self.cd_sys.rst}

    def port(self, name: str, bits: int) -> Signal:
        """Add a port; its use makes it an input or an output."""
        signal = Signal(bits, name_override=name)
        self.ios.add(signal)
        return signal


def compile_model(folder: Path, options: list[str], sources: list[str], targets: Iterable[str] = (),
                  objects: Iterable[Path] = ()) -> None:
    """Run Verilator in `folder`, then make in its `obj_dir`, with `objects` compiled already; raise ToolError."""
    run_logged(["verilator", *options, *sources], folder, "verilator.log")
    for path in objects:
        # Copied now, they are newer than Verilator's makefile, and are not compiled again.
        shutil.copy(path, folder / "obj_dir")
    run_logged(["make", "-s", "-j2", "-C", "obj_dir", "-f", "Vcore.mk", *COMPILATION, *targets], folder, "build.log")


def build_runtime(options: list[str], version: str) -> list[Path]:
    """Compile Verilator's runtime, once for all models with the same options; return its objects."""
    objects = RUNTIME_OBJECTS + [name for option, name in OPTION_OBJECTS.items() if option in options]

    def build(folder: Path) -> None:
        (folder / "core.v").write_text("module core(input sys_clk); endmodule\n")
        (folder / "main.cpp").write_text("")
        compile_model(folder, options, ["core.v", "main.cpp"], objects)

    key    = content_key([version, *COMPILATION, *options])
    folder = built_once(build_directory() / "cosim" / f"runtime-{key}", build) / "obj_dir"
    return [folder / name for name in objects]


def build_library(top: PortsTop, header: str, bench: str, trace: str = "") -> Path:
    """Emit Verilog, compile it with the bench, once for each content; return the path of the shared library.

    Memories return garbage where the output of block RAM is undefined: see `with_garbage`.

    Parameters
    ----------
    top
        Top level.
    header
        Contents of `ports.h`, which gives the bench access to the ports.
    bench
        Name of the bench's C++ file, in this folder.
    trace
        Ending of the waveform that the model writes, one of `TRACE_OPTIONS`; none if empty.

    Raises
    ------
    ToolError
        Verilator or the compiler failed; the message names the log.
    """
    emitted = verilog.convert(top, ios=top.ios, name="core")
    source  = with_garbage(str(emitted))
    sources = {name: (HERE / name).read_text() for name in ("core.h", bench)} | {"ports.h": header}
    counted = os.environ.get("LITESTEREO_COVERAGE", "")
    options = [*VERILATOR_OPTIONS, *COVERAGE_OPTIONS[counted], *TRACE_OPTIONS.get(trace, [])]
    version = subprocess.run(["verilator", "--version"], check=True, capture_output=True, text=True).stdout
    if counted:
        # Counts are of lines: this says whose each is.
        sources["owners.json"] = json.dumps(owners(top, emitted.ns), sort_keys=True)
    # Comments are not part of the key: they have the date.
    logic   = re.sub(r"^//.*$", "", source, flags=re.MULTILINE)
    key     = content_key([logic, *sources.values(), version, *COMPILATION, *options])
    runtime = build_runtime(options, version)

    def build(folder: Path) -> None:
        for name, text in {"core.v": source, **sources}.items():
            (folder / name).write_text(text)
        compile_model(folder, [*options, "-CFLAGS", f"-I{folder}"], ["core.v", bench], objects=runtime)

    return built_once(build_directory() / "cosim" / key, build) / "obj_dir" / "core.so"
