#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""`litestereo bench`: how fast a device is, seen from this host."""

from __future__ import annotations

import argparse
import dataclasses
import json
import re
import sys

import rich.console
import rich.table

from ..devices.base import DeviceInfo
from ..devices.connect import connect
from ..live.benchmark import DeviceSpeed, measure_device
from .arguments import Parser, add_device, add_json, count
from .matching import add_settings, device_settings, print_notices, stages_off
from .progress import terminal_bars

#: Sizes that are measured by default, as far as the device accepts them.
_SIZES = ((160, 120), (320, 240), (640, 480))

#: Width of the table in characters if stdout is not a terminal.
_TABLE_WIDTH = 110

_EPILOG = """\
examples:
  litestereo bench --device udp://192.168.1.50
  litestereo bench --device model: --size 320x240 --size 640x480 --frames 5 --json

Each size is measured with made-up pairs: first frame by frame, for the latency from the call to the map, which 50, 95
and 99 % of these frames do not exceed; then as a stream, which keeps the device busy, for the frame rate over all its
frames. The link is what the stream moved in both directions: 4 bytes per pixel, in 10^6 bytes per second.
"""


def add_parser(commands: argparse._SubParsersAction[Parser]) -> None:
    """Add the command."""
    parser = commands.add_parser("bench", help="measure how fast a device is", epilog=_EPILOG,
                                 description="Measure frame rate, latency and link of a device, seen from this host.")
    add_device(parser)
    parser.add_argument("--size", metavar="WxH", type=_size, action="append", dest="sizes",
                        help="size of the images, may be repeated (default: those of "
                             f"{', '.join(f'{width}x{height}' for width, height in _SIZES)} that the device accepts)")
    parser.add_argument("--frames", metavar="N", type=count, default=20,
                        help="frames at each size, one by one and as a stream (default: %(default)s)")
    add_json(parser)
    add_settings(parser, speckle=False)
    parser.set_defaults(run=run)


def _size(text: str) -> tuple[int, int]:
    numbers = re.fullmatch(r"([1-9]\d{0,4})x([1-9]\d{0,4})", text)
    if numbers is None:
        raise argparse.ArgumentTypeError(f"must be a size like 640x480, not '{text}'")
    return int(numbers[1]), int(numbers[2])


def _fits(info: DeviceInfo, width: int, height: int) -> bool:
    return width <= info.max_width and height <= info.max_height and width*height <= info.max_pixels


def run(options: argparse.Namespace) -> int:
    """Run the command."""
    with connect(options.device) as device:
        info     = device.info()
        choice   = device_settings(options, [info])
        settings = choice.settings
        sizes    = options.sizes or [size for size in _SIZES if _fits(info, *size)] or [settings.minimum_size]
        for width, height in sizes:
            info.check(width, height, settings)
        print_notices(choice.notices)
        with terminal_bars() as bars:
            bar     = bars.add_task("measure", total=2*options.frames*len(sizes))
            results = [measure_device(device, width, height, settings, options.frames, lambda: bars.advance(bar))
                       for width, height in sizes]
    if options.json:
        print(json.dumps({"device": info.name, "url": info.url, **dataclasses.asdict(settings), **stages_off(choice),
                          "sizes": [dataclasses.asdict(result) for result in results]}, indent=2))
    else:
        width = None if sys.stdout.isatty() else _TABLE_WIDTH
        rich.console.Console(width=width, highlight=False).print(_table(f"{info.name} at {info.url}", results))
    return 0


def _table(title: str, results: list[DeviceSpeed]) -> rich.table.Table:
    table = rich.table.Table(title=f"{title}, {results[0].frames} frames one by one and as a stream", box=None)
    for name in ("size", "frames/s", "latency 50 %", "95 %", "99 %", "link MB/s", "clocks per frame"):
        table.add_column(name, justify="left" if name == "size" else "right")
    for result in results:
        latencies = (result.latency_p50_s, result.latency_p95_s, result.latency_p99_s)
        table.add_row(f"{result.width}x{result.height}", f"{result.frames_per_s:.1f}",
                      *(f"{1000*latency:.1f} ms" for latency in latencies),
                      "-" if result.link_mb_per_s is None else f"{result.link_mb_per_s:.2f}",
                      "-" if result.clocks is None else str(result.clocks))
    return table
