#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Table 5.7: a serial program in C against the accelerator."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...firmware import FIRMWARE_DIR
from ...gateware.common.parameters import MatcherParameters
from ...host_tools.data.datasets import StereoPair
from ...host_tools.devices.connect import Device, connect
from ...soc.reports.markdown import table
from ..bench.clocks import measure_frame
from .clocks import WrongMap
from .measured import BENCH, CPU_MATCHER
from .middlebury import stereo_pair
from .presets import BARE, Preset, Scale
from .section import PACKAGE, Section

#: The pairs of the table.
PAIRS = ("tsukuba", "venus")

#: The firmware's matcher for the CPU, and the options for this computer: one thread.
SOURCES = [*(FIRMWARE_DIR / "reference" / name for name in ("stereo_bm.c", "prefilter.c", "left_right.c", "median.c")),
           FIRMWARE_DIR / "lib" / "stereo_settings.c", PACKAGE / "serial_sad.c"]
OPTIONS = ["-std=gnu11", "-O3", "-Wall", "-Wextra", "-Werror", f"-I{FIRMWARE_DIR / 'include'}", f"-I{FIRMWARE_DIR}"]

#: Frames of which the fastest counts.
FRAMES = 20


def compiled(folder: Path) -> Path:
    """Build the program for this computer; raise RuntimeError if it cannot be built."""
    if shutil.which("gcc") is None:
        raise RuntimeError("gcc is not installed: install the package gcc")
    program = folder / "serial_sad"
    done    = subprocess.run(["gcc", *OPTIONS, "-o", program, *SOURCES], capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"gcc cannot build {program}: {done.stderr.strip()}")
    return program


def serial(program: Path, pair: StereoPair, preset: Preset) -> tuple[float, NDArray[np.int16]]:
    """Run the program; return the shortest processor time of a frame in seconds, and the map."""
    height, width = pair.left.shape
    numbers = (width, height, preset.disparities, preset.block_size, FRAMES)
    done    = subprocess.run([program, *map(str, numbers)], input=pair.left.tobytes() + pair.right.tobytes(),
                             capture_output=True, check=True)
    (time_ns,) = np.frombuffer(done.stdout[:8], np.uint64)
    return int(time_ns)/1e9, np.frombuffer(done.stdout[8:], np.int16).reshape(height, width)


def strips(scale: Scale) -> tuple[int, int]:
    """Return the rows of the two strips that the CPU matches, both higher than a block."""
    return scale.strip_rows//2, scale.strip_rows


def cpu_clocks(device: Device, scale: Scale, preset: Preset, pair: StereoPair) -> int:
    """Return the clocks of the CPU of the SoC for a frame of the pair's size.

    Two strips are measured, and the rows that the frame has beyond them are extrapolated. The clocks of a row depend
    on its place in the CPU's data cache, so the strips differ by about as many rows as that cache holds: with two rows
    the result was a fifth off. The whole frame would take an hour of simulation.
    """
    height, width = pair.left.shape
    low, high     = strips(scale)
    cases         = [(width, rows, preset.disparities, preset.block_size, "sad") for rows in (low, high)]
    less, more    = (measure_frame(device, case, "cpu_bench").clocks for case in cases)
    return more + (height - high)*(more - less)//(high - low)


def measured_presets(scale: Scale) -> list[Preset]:
    """Return the presets without further stages."""
    return [preset for preset in scale.presets if preset.features == BARE]


def programs_builds(scale: Scale) -> list[MatcherParameters]:
    """Return the matchers of the presets, for the widest frame."""
    return [preset.parameters(scale.max_width) for preset in measured_presets(scale)]


def measure_programs(scale: Scale, folder: Path) -> dict[str, Any]:
    """Return the clocks of the accelerator, the program's time divided by its time, and the clocks of the CPU."""
    program = compiled(folder)
    presets = measured_presets(scale)
    rows    = []
    with connect("sim:?ram=integrated-ram&link=serial") as device:
        for name in PAIRS:
            pair = stereo_pair(name)
            for preset in presets:
                matcher = preset.cosim(scale.max_width)
                expected, clocks, _ = matcher.match_settings(pair.left, pair.right, preset.settings())
                matcher.close()
                seconds, disparity = serial(program, pair, preset)
                if not np.array_equal(disparity, expected):
                    raise WrongMap(f"the maps of {name} by gateware and by C differ: {preset.name}")
                # One configuration only: it takes minutes, and the CPU has no memory for more disparities.
                cpu = cpu_clocks(device, scale, preset, pair) if preset == presets[0] else None
                rows.append({"pair": name, "preset": preset.name, "clocks": clocks, "cpu": cpu,
                             "ratio": seconds*1e6*scale.clock_mhz/clocks})
    return {"rows": rows, "mhz": scale.clock_mhz, "strips": strips(scale)}


def fields(result: dict[str, Any]) -> dict[str, object]:
    """Return the fields of the table."""
    header = ["pair", "configuration", "accelerator, clocks", "C on this computer, times the accelerator's time",
              "C on the VexRiscv, clocks", "times the accelerator's clocks"]
    rows   = [[row["pair"].capitalize(), row["preset"], row["clocks"], f"{row['ratio']:.1f}", row["cpu"] or "",
               f"{row['cpu']/row['clocks']:.0f}" if row["cpu"] else ""] for row in result["rows"]]
    return {"table": table(header, rows), "mhz": result["mhz"], "low": result["strips"][0],
            "high": result["strips"][1], "options": OPTIONS[1]}


SECTIONS = [
    Section("Table 5.7", "a serial program in C against the accelerator", """\
The program is the firmware's matcher for the CPU (`firmware/reference/stereo_bm.c`, running sums, one thread). The
accelerator is its Verilog in Verilator. Their maps are equal. On the computer that made this page (gcc {options},
processor time) the table gives the program's time divided by that of the accelerator at {mhz} MHz. On the VexRiscv
of the SoC in litex_sim both are in clocks: the console's `cpu_bench`, on noise of the pair's width and of {low}
and {high} rows. The clocks of the remaining rows are extrapolated, within some percent, because the cost of a row
depends on its place in the data cache. Only one configuration is measured, because it takes minutes of simulation.

{table}""", measure_programs, fields, programs_builds, system=True,
            sources=(*BENCH, *CPU_MATCHER, PACKAGE / "serial_sad.c"), more=lambda: OPTIONS[:2], needs_pairs=True),
]
