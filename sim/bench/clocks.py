#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Measures the full system in litex_sim, in clocks, and writes the figures to build/bench.json."""

from __future__ import annotations

import argparse
import json
import re
import sys
import time
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import rich.console
import rich.table

from ...host_tools.core.errors import LiteStereoError
from ...host_tools.core.settings import MatcherSettings
from ...host_tools.devices.connect import Device, connect
from ...soc.boards import BOARDS
from ...soc.build.paths import build_directory
from ..models.pattern import LEFT_SEED, RIGHT_SEED, pattern
from ..models.stereo_bm import stereo_bm
from ..system.build import MEMORIES
from .ethernet import CASES as CASES_OF_ETHERNET
from .ethernet import board_cases, ethernet_figures
from .readme import write

#: Width, height, disparities, block size, and the stages: "all", or "sad" for the sum of absolute differences alone.
#: The first case is the one of the README; the second is the same with "sad"; the third and fourth are those of the
#: thesis of 2014.
CASES = [(640, 480, 64, 9, "all"), (640, 480, 64, 9, "sad"), (640, 480, 16, 9, "sad"), (640, 480, 16, 7, "sad"),
         (640, 480, 64, 15, "all")]

#: The case for the CPU of the SoC: small, because the CPU is slow.
CPU_CASE = (160, 32, 64, 9, "sad")

#: The settings of "all", in which every stage has an effect; firmware/app/commands.c has the same.
ALL_STAGES = MatcherSettings(min_disparity=3, texture_threshold=60, uniqueness_ratio=5, disp12_max_diff=1, median=True)

#: The settings of "sad".
NO_STAGE = MatcherSettings(prefilter="none", texture_threshold=0, uniqueness_ratio=0, subpixel=False)

#: Longest wait for a measurement, in seconds. Most of it is the CPU, which fills the images and sums the map.
TIMEOUT_S = 300.0

#: Time for which cv2.StereoBM runs, in seconds.
OPENCV_S = 3.0

Case   = tuple[int, int, int, int, str]
Figure = dict[str, str | float]


@dataclass(frozen=True)
class Measurement:
    """One frame from memory to memory."""
    width: int
    height: int
    disparities: int
    block_size: int
    clocks: int
    first_row_clocks: int
    crc32: int

    @property
    def clocks_per_pixel(self) -> float:
        """Clocks of the frame, divided by its pixels."""
        return self.clocks/(self.width*self.height)


def measure_frame(device: Device, case: Case, command: str = "bench") -> Measurement:
    """Match the firmware's pattern, and check the map's CRC-32 against the model's.

    Parameters
    ----------
    device
        Device with a console.
    case
        Width, height, disparities, block size, "all" or "sad".
    command
        `bench` for the accelerator, `cpu_bench` for the CPU.

    Raises
    ------
    LiteStereoError
        The device refused or failed, or the map is wrong.
    """
    width, height, disparities, block_size, stages = case
    text  = device.console(f"{command} {width} {height} {disparities} {block_size} {stages}", TIMEOUT_S)
    found = dict(re.findall(r"(\w+)=(0x[0-9a-f]+|\d+)", text))
    if "crc32" not in found:
        raise LiteStereoError(f"the device could not measure: {text.strip()}")
    result   = Measurement(**{name: int(value, 0) for name, value in found.items()})
    settings = replace(ALL_STAGES if stages == "all" else NO_STAGE, disparities=disparities, block_size=block_size)
    expected = stereo_bm(pattern(width, height, LEFT_SEED), pattern(width, height, RIGHT_SEED), settings)
    if zlib.crc32(expected.astype("<i2").tobytes()) != result.crc32:
        raise LiteStereoError(f"the map of {case} is wrong")
    return result


def case_name(case: Case) -> str:
    """Return the name of a case, as a part of the names of figures."""
    return "{}x{}/d{}/b{}/{}".format(*case)


def figures(case: Case, result: Measurement, memory: str) -> list[Figure]:
    """Return the figures of a measurement: name, value and unit."""
    name   = f"{case_name(case)}/{memory}"
    pixels = result.width*result.height
    return [
        {"name": f"clocks_per_frame/{name}", "value": result.clocks, "unit": "clocks"},
        {"name": f"clocks_per_pixel/{name}", "value": round(result.clocks_per_pixel, 4), "unit": "clocks"},
        {"name": f"first_row_latency_clocks/{name}", "value": result.first_row_clocks, "unit": "clocks"},
        {"name": f"frames_per_second_at_100_mhz/{name}", "value": round(1e8/result.clocks, 1), "unit": "frames/s"},
        {"name": f"disparity_evaluations_per_second_per_mhz/{name}",
         "value": round(pixels*result.disparities/result.clocks, 2), "unit": "million/s"},
    ]


def cpu_figures(device: Device, accelerator: Measurement) -> list[Figure]:
    """Measure the same arithmetic in C on the CPU of the SoC, and its clocks relative to the accelerator's."""
    cpu = measure_frame(device, CPU_CASE, "cpu_bench")
    return [
        {"name": f"cpu_clocks_per_pixel/{case_name(CPU_CASE)}", "value": round(cpu.clocks_per_pixel, 1),
         "unit": "clocks"},
        {"name": f"clocks_of_cpu_by_clocks_of_accelerator/{case_name(CPU_CASE)}",
         "value": round(cpu.clocks_per_pixel/accelerator.clocks_per_pixel), "unit": "ratio"},
    ]


def opencv_figures(accelerator: Measurement) -> list[Figure]:
    """Measure cv2.StereoBM on one core of this computer, and the accelerator at 100 MHz relative to it."""
    case  = CASES[0]
    left  = pattern(case[0], case[1], LEFT_SEED)
    right = pattern(case[0], case[1], RIGHT_SEED)
    cv2.setNumThreads(1)
    matcher = cv2.StereoBM_create(case[2], case[3])
    matcher.setDisp12MaxDiff(1)
    matcher.compute(left, right)
    begin, frames = time.perf_counter(), 0
    while (seconds := time.perf_counter() - begin) < OPENCV_S:
        matcher.compute(left, right)
        frames += 1
    frames_per_s = frames/seconds
    return [
        {"name": f"opencv_frames_per_second_on_one_core/{case_name(case)}", "value": round(frames_per_s, 1),
         "unit": "frames/s"},
        {"name": f"accelerator_at_100_mhz_by_opencv/{case_name(case)}",
         "value": round(1e8/accelerator.clocks/frames_per_s, 2), "unit": "ratio"},
    ]


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure, print the table, write the file; return the exit status."""
    parser = argparse.ArgumentParser(prog="bench", description=__doc__)
    parser.add_argument("--board", choices=list(BOARDS), help="measure Ethernet on the SoC of this board alone")
    board = parser.parse_args(arguments).board
    try:
        if board:
            show(ethernet_figures(board_cases(board)), f"{board} in litex_sim")
            return 0
        rows = all_figures()
    except LiteStereoError as error:
        print(f"bench: error: {error}", file=sys.stderr)
        return 1
    show(rows, "Full system in litex_sim")
    print("On integrated RAM the matcher has its own port and needs a clock per pixel, plus the rows of the lower\n"
          "border. On SDRAM (32 bits, at most one word per clock) the four bytes of a pixel need the whole bus: all\n"
          "above 1 is row changes, changes between reading and writing, and refresh.\n"
          "Ethernet figures are of uploads while other frames are matched and downloaded, in clocks of the wire.\n"
          "Shares of the memory's time are of the same clocks: a word takes one, and a port may wait in others.")
    path = build_directory() / "bench.json"
    path.write_text(json.dumps(rows, indent=2) + "\n")
    print(f"written: {path}")
    write(rows)
    return 0


def show(rows: Sequence[Figure], title: str) -> None:
    """Print figures as a table."""
    table = rich.table.Table("figure", "value", "unit", title=title)
    for row in rows:
        table.add_row(*(str(row[column]) for column in ("name", "value", "unit")))
    rich.console.Console(width=100).print(table)


def all_figures() -> list[Figure]:
    """Measure everything that the README's tables need, and more.

    Raises
    ------
    LiteStereoError
        A device refused or failed, or a map is wrong.
    """
    rows: list[Figure] = []
    for memory in MEMORIES:
        with connect(f"sim:?ram={memory}&link=serial") as device:
            for case in CASES:
                print(f"measuring {case_name(case)} on {memory}", file=sys.stderr, flush=True)
                result = measure_frame(device, case)
                rows  += figures(case, result, memory)
                if case == CASES[0] and memory == MEMORIES[0]:
                    first = result
            if memory == MEMORIES[0]:
                print("measuring the CPU, and cv2.StereoBM on this computer", file=sys.stderr, flush=True)
                rows += cpu_figures(device, first)
                rows += opencv_figures(first)
    print("measuring Ethernet", file=sys.stderr, flush=True)
    rows += ethernet_figures(CASES_OF_ETHERNET)
    return rows
