#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Measures the full system in litex_sim, in clocks, and writes the figures to build/bench.json."""

from __future__ import annotations

import json
import re
import sys
import zlib
from dataclasses import dataclass

import rich.console
import rich.table

from ..host_tools.device import Device, connect
from ..host_tools.errors import LiteStereoError
from .build import MEMORIES
from .model import match
from .paths import build_directory
from .pattern import LEFT_SEED, RIGHT_SEED, pattern

#: Width, height, disparities, block size. The first is the promise; the second and third are the thesis of 2014.
CASES = [(640, 480, 64, 9), (640, 480, 16, 9), (640, 480, 16, 7), (320, 240, 64, 15)]

#: Longest wait for a measurement: the CPU takes most of it, to fill the images and to sum the map; seconds.
TIMEOUT_S = 300.0

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
    def case(self) -> str:
        """The case as the names of figures have it."""
        return f"{self.width}x{self.height}/d{self.disparities}/b{self.block_size}"


def measure(device: Device, case: tuple[int, int, int, int]) -> Measurement:
    """Match the firmware's pattern, and check the map's CRC-32 against the model's.

    Raises
    ------
    LiteStereoError
        The device refused or failed, or the map is wrong.
    """
    text = device.console("bench {} {} {} {}".format(*case), TIMEOUT_S)
    found = dict(re.findall(r"(\w+)=(0x[0-9a-f]+|\d+)", text))
    if "crc32" not in found:
        raise LiteStereoError(f"the device could not measure: {text.strip()}")
    result   = Measurement(**{name: int(value, 0) for name, value in found.items()})
    width, height, disparities, block_size = case
    expected = match(pattern(width, height, LEFT_SEED), pattern(width, height, RIGHT_SEED), disparities, block_size)
    if zlib.crc32(expected.astype("<i2").tobytes()) != result.crc32:
        raise LiteStereoError(f"the map of {result.case} is wrong")
    return result


def figures(result: Measurement, memory: str) -> list[Figure]:
    """What a measurement says, as name, value and unit."""
    per_pixel = result.clocks/(result.width*result.height)
    return [
        {"name": f"clocks_per_frame/{result.case}/{memory}", "value": result.clocks, "unit": "clocks"},
        {"name": f"clocks_per_pixel/{result.case}/{memory}", "value": round(per_pixel, 4), "unit": "clocks"},
        {"name": f"first_row_latency_clocks/{result.case}/{memory}", "value": result.first_row_clocks,
         "unit": "clocks"},
        {"name": f"frames_per_second_at_100_mhz/{result.case}/{memory}", "value": round(1e8/result.clocks, 1),
         "unit": "frames/s"},
    ]


def main() -> int:
    """Measure, print the table, write the file; returns the exit status."""
    rows: list[Figure] = []
    try:
        for memory in MEMORIES:
            with connect(f"sim:?ram={memory}") as device:
                for case in CASES:
                    print(f"measuring {case} on {memory}", file=sys.stderr, flush=True)
                    rows += figures(measure(device, case), memory)
    except LiteStereoError as error:
        print(f"bench: error: {error}", file=sys.stderr)
        return 1
    table = rich.table.Table("figure", "value", "unit", title="Full system in litex_sim, memory to memory")
    for row in rows:
        table.add_row(*(str(row[column]) for column in ("name", "value", "unit")))
    rich.console.Console(width=100).print(table)
    print("On integrated RAM the matcher has a port of its own and takes a pixel per clock, plus the rows of the\n"
          "lower border. On SDRAM (32 bits, one word per clock at best) a pixel's four bytes take the whole bus:\n"
          "what is above 1 is row changes, turns between reading and writing, and refresh.")
    path = build_directory() / "bench.json"
    path.write_text(json.dumps(rows, indent=2) + "\n")
    print(f"written: {path}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
