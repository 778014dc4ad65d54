#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""`litestereo stream`: pair after pair, from folders, videos or cameras."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
import rich.console
import rich.progress

from ..cameras.rectify import read_calibration
from ..core.errors import ImageError
from ..core.images import FORMATS, write_map
from ..core.settings import MatcherSettings
from ..data.sources import EXAMPLES, open_source
from ..devices.connect import connect
from ..export.depth import write_depth
from ..live.watch import Matching, Meter, Seen, watch
from .arguments import Parser, add_calibration, add_device, add_json, count
from .matching import add_settings, chosen_settings, chosen_speckle_filter
from .stopping import stopped_by_ctrl_c

#: Sources for the help of the commands that take one.
SOURCES = "\n".join(f"  {name:18}  {text}" for name, text in EXAMPLES.items())

_EPILOG = f"""\
examples:
  litestereo stream left/ right/ --device udp://192.168.1.50 -o maps
  litestereo stream both.avi --device model: --frames 100 --json
  litestereo stream camera:0 camera:1 --device udp://192.168.1.50 --calibration calibration/

sources:
{SOURCES}

files written with -o:
  disparity_NAME.png  or .pfm or .npy, see --format
  depth_NAME.npy      with --calibration: float32, metres, nan where there is none

Ctrl-C ends the stream: frames under way are finished, the summary is printed, and the exit status is 0. A second
Ctrl-C ends it at once. With --json each frame is a line, and the last line is the summary.
"""


def add_source(parser: argparse.ArgumentParser) -> None:
    """Adds the source of a stream, and how much of it is taken."""
    parser.add_argument("source", metavar="SOURCE", nargs="+", help="where the pairs come from, one or two names: see "
                                                                    "below")
    parser.add_argument("--frames", metavar="N", type=count, help="end after so many pairs (default: all there are)")


def chosen_matching(options: argparse.Namespace, default: MatcherSettings) -> Matching:
    """What a command line wants done to each pair, for what it does not say with the settings `default`."""
    rectifier = None if options.calibration is None else read_calibration(options.calibration)
    return Matching(chosen_settings(options, default), chosen_speckle_filter(options), rectifier)


def add_parser(commands: argparse._SubParsersAction[Parser]) -> None:
    """Adds the command."""
    parser = commands.add_parser("stream", help="match pair after pair, live", epilog=_EPILOG,
                                 description="Match pair after pair, and show frame rate and latency.")
    add_source(parser)
    add_device(parser)
    add_calibration(parser)
    parser.add_argument("-o", "--output", metavar="DIR", type=Path,
                        help="folder for the maps, made if need be (default: they are not written)")
    parser.add_argument("--format", choices=FORMATS, default="png",
                        help="kind of file: png of 16 bits (KITTI), pfm (Middlebury), npy of int16 (default: "
                             "%(default)s)")
    add_json(parser)
    add_settings(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Runs the command; whatever can be checked without the device is checked before connecting."""
    chosen_matching(options, MatcherSettings())
    if options.output is not None and options.output.exists() and not options.output.is_dir():
        raise ImageError(f"{options.output}: is a file, the maps need a folder")
    with open_source(options.source) as source, connect(options.device) as device, stopped_by_ctrl_c() as stop:
        matching = chosen_matching(options, device.info().default_settings())
        terminal = rich.console.Console(stderr=True)
        columns  = (rich.progress.TextColumn("{task.description}"), rich.progress.BarColumn(),
                    rich.progress.MofNCompleteColumn(), rich.progress.TimeElapsedColumn())
        meter    = Meter()
        with rich.progress.Progress(*columns, console=terminal, transient=True,
                                    disable=not terminal.is_terminal) as bars:
            bar = bars.add_task("waiting for the first map", total=options.frames or source.length)
            for seen in watch(device, source, matching, options.frames, stop):
                meter.count(seen.latency_s)
                path = None if options.output is None else _write(options.output, options.format, seen)
                bars.update(bar, advance=1, description=f"{meter.frames_per_s:.1f} frames/s, latency "
                                                        f"{1000*seen.latency_s:.0f} ms")
                if options.json:
                    print(json.dumps(_line(meter, seen, path)), flush=True)
        summary = {"device": device.info().name, **meter.summary()}
    print(json.dumps({"summary": summary}) if options.json else text(summary))
    return 0


def _write(folder: Path, ending: str, seen: Seen) -> Path:
    """Writes the map, and the depth if there is one; returns the file of the map."""
    path = folder / f"disparity_{seen.shot.name}.{ending}"
    write_map(path, seen.result.disparity, seen.result.settings)
    if seen.depth_m is not None:
        write_depth(folder / f"depth_{seen.shot.name}.npy", seen.depth_m)
    return path


def _line(meter: Meter, seen: Seen, path: Path | None) -> dict[str, Any]:
    """A frame as JSON has it."""
    known = None if seen.depth_m is None else seen.depth_m[np.isfinite(seen.depth_m)]
    return {
        "frame":          meter.frames - 1,
        "name":           seen.shot.name,
        "latency_s":      seen.latency_s,
        "frames_per_s":   meter.frames_per_s,
        "clocks":         seen.result.clocks,
        "density":        seen.density,
        "median_depth_m": None if known is None or not known.size else float(np.median(known)),
        "file":           None if path is None else str(path),
    }


def text(summary: dict[str, Any]) -> str:
    """The summary for people."""
    lines = [f"device   {summary['device']}", f"frames   {summary['frames']} in {summary['seconds']:.2f} s"]
    if summary["frames"]:
        lines += [f"rate     {summary['frames_per_s']:.2f} frames/s",
                  "latency  " + ", ".join(f"{part} % within {1000*summary[f'latency_p{part}_s']:.1f} ms"
                                          for part in (50, 95, 99))]
    return "\n".join(lines)
