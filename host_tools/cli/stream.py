#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""`litestereo stream`: matches pair after pair, from folders, videos or cameras."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import rich.console
import rich.progress

from ..cameras.rectify import read_calibration
from ..core.errors import ImageError
from ..core.images import FORMATS, summed_notices, write_map
from ..core.settings import MatcherSettings
from ..data.sources import EXAMPLES, Source, open_source
from ..devices.connect import connect
from ..export.depth import write_depth
from ..live.matching import MatchedShot, Matching, match_source
from ..live.meter import RECENT_FRAMES, Meter
from .arguments import Parser, add_calibration, add_device, add_json, count
from .matching import add_settings, chosen_settings, chosen_speckle_filter
from .stopping import stopped_by_ctrl_c

#: The kinds of sources, for the help of the commands that read one.
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

Ctrl-C ends the stream: frames on their way are finished, the summary is printed, and the exit status is 0. A second
Ctrl-C interrupts the command at once.

--json prints a line for each frame, and the summary as the last line. Of a frame:
  latency_s            seconds from taking the pair until its map was here
  recent_frames_per_s  over the last {RECENT_FRAMES} frames; frames_per_s of the summary is over all frames
  valid_of_all         pixels with a disparity, % of all pixels of the map
  median_depth_m       with --calibration: over the pixels that have a depth, in metres
"""


def add_source(parser: argparse.ArgumentParser) -> None:
    """Add the source of a stream, and the number of pairs to take from it."""
    parser.add_argument("source", metavar="SOURCE", nargs="+", help="where the pairs come from, one or two names: see "
                                                                    "below")
    parser.add_argument("--frames", metavar="N", type=count, help="stop after N pairs (default: all)")


def chosen_matching(options: argparse.Namespace, default: MatcherSettings) -> Matching:
    """Return what a command line asks for; settings that it does not name are those of `default`."""
    rectifier = None if options.calibration is None else read_calibration(options.calibration)
    return Matching(chosen_settings(options, default), chosen_speckle_filter(options), rectifier)


def add_parser(commands: argparse._SubParsersAction[Parser]) -> None:
    """Add the command."""
    parser = commands.add_parser("stream", help="match pair after pair, live", epilog=_EPILOG,
                                 description="Match pair after pair, and show frame rate and latency.")
    add_source(parser)
    add_device(parser)
    add_calibration(parser)
    parser.add_argument("-o", "--output", metavar="DIR", type=Path,
                        help="folder for the maps, created if needed (default: they are not written)")
    parser.add_argument("--format", choices=FORMATS, default="png",
                        help="format of the maps: png of 16 bits (KITTI), pfm (Middlebury), npy of int16 (default: "
                             "%(default)s)")
    add_json(parser)
    add_settings(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Run the command. All that can be checked without the device is checked before connecting to it."""
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
            for matched in match_source(device, source, matching, options.frames, stop):
                meter.count(matched.latency_s)
                path = None if options.output is None else _write(options.output, options.format, matched)
                bars.update(bar, advance=1, description=f"{meter.recent_frames_per_s:.1f} frames/s, latency "
                                                        f"{1000*matched.latency_s:.0f} ms")
                if options.json:
                    print(json.dumps(_frame_line(meter, matched, path)), flush=True)
        summary = {"device": device.info().name, **meter.summary()}
    print_picture_notices(source)
    print(json.dumps({"summary": summary}) if options.json else stream_text(summary))
    return 0


def print_picture_notices(source: Source) -> None:
    """Print on stderr what was done to the pictures of a stream, one line for all to which the same was done."""
    for notice in summed_notices(source.picture_notices):
        print(f"litestereo: note: {notice}", file=sys.stderr)


def _write(folder: Path, ending: str, matched: MatchedShot) -> Path:
    """Write the map, and the depth if there is one; return the file of the map."""
    path = folder / f"disparity_{matched.shot.name}.{ending}"
    write_map(path, matched.result.disparity, matched.result.settings)
    if matched.depth_m is not None:
        write_depth(folder / f"depth_{matched.shot.name}.npy", matched.depth_m)
    return path


def _frame_line(meter: Meter, matched: MatchedShot, path: Path | None) -> dict[str, Any]:
    """Return what JSON says of a frame; the help explains the keys."""
    known = None if matched.depth_m is None else matched.depth_m[np.isfinite(matched.depth_m)]
    return {
        "frame":               meter.frames - 1,
        "name":                matched.shot.name,
        "latency_s":           matched.latency_s,
        "recent_frames_per_s": meter.recent_frames_per_s,
        "clocks":              matched.result.clocks,
        "valid_of_all":        matched.valid_of_all,
        "median_depth_m":      None if known is None or not known.size else float(np.median(known)),
        "file":                None if path is None else str(path),
    }


def stream_text(summary: dict[str, Any]) -> str:
    """Return the summary of a stream as text."""
    lines = [f"device   {summary['device']}", f"frames   {summary['frames']} in {summary['seconds']:.2f} s"]
    if summary["frames"]:
        lines += [f"rate     {summary['frames_per_s']:.2f} frames/s over all frames",
                  "latency  " + ", ".join(f"{part} % within {1000*summary[f'latency_p{part}_s']:.1f} ms"
                                          for part in (50, 95, 99)) + " of all frames"]
    return "\n".join(lines)
