#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""`litestereo stream`: matches pair after pair, from folders, videos or cameras."""

from __future__ import annotations

import argparse
import contextlib
import dataclasses
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import rich.progress

from ..cameras.rectify import FILES, Rectifier, read_calibration
from ..core.disparity_map import DisparityMap
from ..core.errors import ImageError, UsageError
from ..core.images import FORMATS, summed_notices, write_map
from ..core.outputs import DEPTH_NPY, MAP_KINDS, Kind, Outputs
from ..core.settings import MatcherSettings
from ..data.sources import EXAMPLES, Source, open_source
from ..devices.base import Device
from ..devices.connect import connect
from ..export.depth import write_depth
from ..export.recorder import RECORDED_MCAP, Recorder, recording
from ..live.matching import MatchedShot, Matching, match_source
from ..live.meter import RECENT_FRAMES, Meter
from ..live.rectifying import choose_rectifying, rectification_text
from .arguments import Parser, add_calibration, add_device, add_force, add_json, count
from .filters import add_filters, calibrated_filters, decimation_text, filter_values
from .matching import (
    add_settings,
    chosen_settings,
    chosen_speckle_filter,
    device_settings,
    print_notices,
    stages_off,
)
from .progress import terminal_bars
from .stopping import stopped_by_ctrl_c
from .streams import stdout_failed

#: The kinds of sources, for the help of the commands that read one.
SOURCES = "\n".join(f"  {name:18}  {text}" for name, text in EXAMPLES.items())

#: Most numbered frames whose files are checked before the first one is written; others are checked one by one.
_MOST_PLANNED = 100_000

_EPILOG = f"""\
examples:
  litestereo stream left/ right/ --device udp://192.168.1.50 -o maps
  litestereo stream both.avi --device model: --frames 100 --json
  litestereo stream camera:0 camera:1 --device udp://192.168.1.50 --calibration calibration/
  litestereo stream left/ right/ --device model: -o maps --filter decimation --filter spatial --filter temporal
  litestereo stream camera:0 camera:1 --device udp://192.168.1.50 --record walk.mcap
  litestereo stream walk.mcap --device model: -o maps

sources:
{SOURCES}

files written with -o:
  disparity_NAME.png  or .pfm or .npy, see --format
  depth_NAME.npy      with --calibration: float32, metres, nan where there is none

--record writes a recording: images as they are taken, maps after all filters, cameras with --calibration. If this
command is killed, all finished chunks can be read. As a SOURCE its pairs are matched again; `litestereo play` shows
what is in it, and writes the maps that were recorded.

Frames without a partner at the end of the longer video, and the missing end of a file that is cut short, are named on
stderr and by --json (`unmatched`), and the exit status is 1: the maps of the other frames are there.

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


def checked_rectifier(options: argparse.Namespace) -> Rectifier | None:
    """Check what a command line asks for, before there is a device; return the rectifier of its calibration, if any."""
    chosen_settings(options, MatcherSettings())
    chosen_speckle_filter(options)
    calibrated_filters(options)
    return None if options.calibration is None else read_calibration(options.calibration)


def chosen_matching(options: argparse.Namespace, settings: MatcherSettings, device: Device,
                    rectifier: Rectifier | None) -> Matching:
    """Return what a command line asks for, with `settings`; the device rectifies if it can."""
    rectifying = None if rectifier is None else choose_rectifying(device, rectifier)
    return Matching(settings, chosen_speckle_filter(options), rectifying, calibrated_filters(options))


def rectification(matching: Matching) -> dict[str, Any]:
    """Return what JSON says of the rectification."""
    return {"rectification": None if matching.rectifying is None else matching.rectifying.summary()}


def source_inputs(options: argparse.Namespace, source: Source) -> list[Path]:
    """Return the files that a stream reads."""
    return [*source.files, *([] if options.calibration is None else [options.calibration/name for name in FILES])]


def print_shortfalls(source: Source) -> int:
    """Print on stderr which frames were not matched; return the exit status."""
    for shortfall in source.shortfalls:
        print(f"litestereo: error: {shortfall}", file=sys.stderr)
    return 1 if source.shortfalls else 0


def unmatched(source: Source) -> dict[str, Any]:
    """Return what JSON says of the frames that were not matched."""
    return {"unmatched": [dataclasses.asdict(shortfall) for shortfall in source.shortfalls]}


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
    parser.add_argument("--record", metavar="FILE.mcap", type=Path,
                        help="write images, maps and cameras into a recording of ROS 2 messages, which is a SOURCE too "
                             "(default: none)")
    parser.add_argument("--record-png", action="store_true",
                        help="write the images of --record as PNG: smaller, and slower (default: as they are)")
    add_json(parser)
    add_force(parser)
    add_settings(parser)
    add_filters(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Run the command. All that can be checked without the device is checked before connecting to it."""
    rectifier = checked_rectifier(options)
    if options.output is not None and options.output.exists() and not options.output.is_dir():
        raise ImageError(f"{options.output}: is a file, the maps need a folder")
    with contextlib.ExitStack() as stack:
        source   = stack.enter_context(open_source(options.source))
        outputs  = Outputs(source_inputs(options, source), options.force)
        # Numbered frames that do not come are planned too: that does no harm. Headers may give absurd numbers.
        names    = source.names or [f"{number:06}" for number in range(min(source.length or 0, _MOST_PLANNED))]
        planned  = {path for name in names[:options.frames] for path in _plan(options, outputs, name)}
        _check_recording(options, source, outputs)
        device   = stack.enter_context(connect(options.device))
        stop     = stack.enter_context(stopped_by_ctrl_c())
        choice   = device_settings(options, [device.info()])
        matching = chosen_matching(options, choice.settings, device, rectifier)
        print_notices([*source.notices, *choice.notices])
        columns  = (rich.progress.TextColumn("{task.description}"), rich.progress.BarColumn(),
                    rich.progress.MofNCompleteColumn(), rich.progress.TimeElapsedColumn())
        meter    = Meter()
        last     = None
        recorder = _recorder(options, stack, matching)
        with terminal_bars(*columns) as bars:
            bar = bars.add_task("waiting for the first map", total=options.frames or source.length)
            # Without files and without a reader there is nothing more to do.
            files = options.output is not None or recorder is not None
            for matched in match_source(device, source, matching, options.frames,
                                        lambda: stop() or not files and stdout_failed()):
                meter.count(matched.latency_s)
                last = matched.map
                if recorder is not None:
                    recorder.add(matched.taken, matched.map)
                path = None if options.output is None else _write(options, outputs, planned, matched)
                bars.update(bar, advance=1, description=f"{meter.recent_frames_per_s:.1f} frames/s, latency "
                                                        f"{1000*matched.latency_s:.0f} ms")
                if options.json:
                    print(json.dumps(_frame_line(meter, matched, path)), flush=True)
        summary = {"device": device.info().name, **meter.summary(), **stages_off(choice), **rectification(matching),
                   **unmatched(source), **filter_values(matching.filters, last),
                   "recording": None if options.record is None or not meter.frames else str(options.record)}
    print_picture_notices(source)
    if options.json:
        print(json.dumps({"summary": summary}))
    else:
        wrote = [] if summary["recording"] is None else [f"wrote    {summary['recording']}"]
        print("\n".join([stream_text(summary, last), *wrote]))
    return print_shortfalls(source)


def _check_recording(options: argparse.Namespace, source: Source, outputs: Outputs) -> None:
    """Check the recording of a command line, before there is a device.

    Raises
    ------
    UsageError
        There is `--record-png` without `--record`.
    ImageError
        The file is there already, or it is being read.
    """
    path: Path | None = options.record
    if path is None:
        if options.record_png:
            raise UsageError("--record-png goes with --record")
        return
    outputs.add(path, RECORDED_MCAP)
    if path.exists() and any(other.exists() and other.samefile(path) for other in source.files):
        raise ImageError(f"{path}: is the source, and cannot be recorded into at the same time")
    if path.is_file() and path.stat().st_size and not options.force:
        raise ImageError(f"{path}: is there already: name another file, or give --force to replace it")


def _recorder(options: argparse.Namespace, stack: contextlib.ExitStack, matching: Matching) -> Recorder | None:
    """Return the recorder of a command line, which `stack` closes; None if there is none."""
    if options.record is None:
        return None
    rectifier = matching.rectifier
    cameras   = None if rectifier is None else (rectifier.geometry, rectifier.cameras)
    return stack.enter_context(recording(options.record, matching.settings, cameras, options.record_png))


def print_picture_notices(source: Source) -> None:
    """Print on stderr what was done to the pictures of a stream, one line for all to which the same was done."""
    print_notices(summed_notices(source.picture_notices))


def _results(options: argparse.Namespace, name: str) -> list[tuple[Path, Kind]]:
    """Return the files of a frame: the map, and the depth if there is one."""
    if options.output is None:
        return []
    depth = [] if options.calibration is None else [(options.output / f"depth_{name}.npy", DEPTH_NPY)]
    return [(options.output / f"disparity_{name}.{options.format}", MAP_KINDS[options.format]), *depth]


def _plan(options: argparse.Namespace, outputs: Outputs, name: str) -> list[Path]:
    """Plan the files of a frame, and return them; raise ImageError as `Outputs.add`."""
    return [outputs.add(path, kind) for path, kind in _results(options, name)]


def _write(options: argparse.Namespace, outputs: Outputs, planned: set[Path], matched: MatchedShot) -> Path:
    """Write the map, and the depth if there is one; return the file of the map."""
    results = _results(options, matched.taken.name)
    for path, kind in results:
        if path not in planned: # Of a camera.
            outputs.check(path, kind)
    write_map(results[0][0], matched.map.disparity, matched.map.settings)
    if matched.depth_m is not None:
        write_depth(results[1][0], matched.depth_m)
    return results[0][0]


def _frame_line(meter: Meter, matched: MatchedShot, path: Path | None) -> dict[str, Any]:
    """Return what JSON says of a frame; the help explains the keys."""
    known = None if matched.depth_m is None else matched.depth_m[np.isfinite(matched.depth_m)]
    return {
        "frame":               meter.frames - 1,
        "name":                matched.taken.name,
        "latency_s":           matched.latency_s,
        "recent_frames_per_s": meter.recent_frames_per_s,
        "clocks":              matched.result.clocks,
        "valid_of_all":        matched.valid_of_all,
        "median_depth_m":      None if known is None or not known.size else float(np.median(known)),
        "file":                None if path is None else str(path),
    }


def stream_text(summary: dict[str, Any], last: DisparityMap | None) -> str:
    """Return the summary of a stream as text; `last` is its last map."""
    lines = [f"device   {summary['device']}", f"frames   {summary['frames']} in {summary['seconds']:.2f} s"]
    if summary["frames"]:
        lines += [f"rate     {summary['frames_per_s']:.2f} frames/s over all frames",
                  "latency  " + ", ".join(f"{part} % within {1000*summary[f'latency_p{part}_s']:.1f} ms"
                                          for part in (50, 95, 99)) + " of all frames"]
    if summary["rectification"] is not None:
        lines.append(f"rectified {rectification_text(summary['rectification'])}")
    if last is not None and (decimated := decimation_text(last)):
        lines.append(f"decimated {decimated}")
    return "\n".join(lines)
