#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""`litestereo play`: what is in a recording, and the maps, images and cameras that were recorded."""

from __future__ import annotations

import argparse
import dataclasses
import json
import sys
from pathlib import Path
from typing import Any

from ..cameras.kinds import CALIBRATED_CAMERA
from ..cameras.rectify import FILES, write_calibration
from ..core.errors import ImageError, UsageError
from ..core.images import FORMATS, write_map, write_png
from ..core.outputs import DEPTH_NPY, MAP_KINDS, Outputs, png_kind
from ..data.recordings import RecordedFrame, RecordingReader
from ..export.depth import write_depth
from .arguments import Parser, add_force, add_json, count

#: Kind of the images that are written.
_IMAGE_PNG = png_kind("recorded image")

_EPILOG = """\
examples:
  litestereo play walk.mcap
  litestereo play walk.mcap -o played --format npy
  litestereo play walk.mcap -o played --images
  litestereo stream walk.mcap --device model: --calibration played/calibration -o maps
  litestereo export played/disparity_000000.npy -o out --format ply --calibration played/calibration

files written with -o, of frames that are numbered from 000000 on:
  disparity_NAME.png  or .pfm or .npy, see --format: the maps that were recorded, after all filters
  depth_NAME.npy      if there was a calibration: float32, metres, nan where there is none
  calibration/        if there was a calibration: left.yaml and right.yaml
  left/ and right/    with --images: NAME.png, the images as they were taken

A recording is also a SOURCE of `stream`, `view` and `measure`, which match its pairs again. A device, settings, filters
and a calibration as they were give the maps that were recorded. A recording that was not finished is played up to its
last finished chunk; that is said on stderr, and the exit status is 1.
"""


def add_parser(commands: argparse._SubParsersAction[Parser]) -> None:
    """Add the command."""
    parser = commands.add_parser("play", help="show what is in a recording, and write its maps", epilog=_EPILOG,
                                 description="Show what is in a recording of `litestereo stream --record`, and write "
                                             "the maps that were recorded.")
    parser.add_argument("file", metavar="FILE.mcap", type=Path, help="the recording")
    parser.add_argument("-o", "--output", metavar="DIR", type=Path,
                        help="folder for the maps, created if needed (default: they are not written)")
    parser.add_argument("--format", choices=FORMATS, default="png",
                        help="format of the maps: png of 16 bits (KITTI), pfm (Middlebury), npy of int16 (default: "
                             "%(default)s)")
    parser.add_argument("--images", action="store_true", help="write the images too (default: the maps only)")
    parser.add_argument("--frames", metavar="N", type=count, help="stop after N frames (default: all)")
    add_json(parser)
    add_force(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Run the command."""
    if options.images and options.output is None:
        raise UsageError("--images needs -o, the folder for the images")
    if options.output is not None and options.output.exists() and not options.output.is_dir():
        raise ImageError(f"{options.output}: is a file, the maps need a folder")
    reader  = RecordingReader(options.file)
    outputs = Outputs([options.file], options.force)
    files   = list[Path]()
    stamps  = list[int]()
    last: RecordedFrame | None = None
    for frame in reader.frames():
        if options.output is not None:
            if last is None:
                files += _write_cameras(options.output, reader, outputs)
            files += _write_frame(options, outputs, frame)
        last   = frame
        stamps = [*stamps[:1], frame.stamp_ns]
        if options.frames is not None and frame.number + 1 == options.frames:
            break
    if last is None or reader.recorded is None:
        raise ImageError(f"{options.file}: has no frame that is whole")
    height, width = last.left.shape
    summary = {
        "file":         str(options.file),
        "frames":       last.number + 1,
        "seconds":      (stamps[-1] - stamps[0])/1e9,
        "begin_ns":     stamps[0],
        "width":        width,
        "height":       height,
        "calibrated":   reader.cameras is not None,
        "decimated_by": last.map.factor,
        "settings":     dataclasses.asdict(reader.recorded.matched),
        "whole":        not reader.cut,
        "files":        [str(path) for path in files],
    }
    print(json.dumps(summary, indent=2) if options.json else _text(summary))
    if reader.cut:
        print(f"litestereo: error: {options.file}: what follows after {last.number + 1} frames cannot be read: the "
              "recording was not finished", file=sys.stderr)
    return 1 if reader.cut else 0


def _write_cameras(folder: Path, reader: RecordingReader, outputs: Outputs) -> list[Path]:
    """Write the cameras, if there are any; return the files."""
    if reader.cameras is None:
        return []
    written = [outputs.add(folder/"calibration"/name, CALIBRATED_CAMERA) for name in FILES]
    write_calibration(folder/"calibration", reader.cameras)
    return written


def _write_frame(options: argparse.Namespace, outputs: Outputs, frame: RecordedFrame) -> list[Path]:
    """Write the map of a frame, its depth if there are cameras, and the images if they are wanted; return the files."""
    name  = f"{frame.number:06}"
    path  = options.output/f"disparity_{name}.{options.format}"
    outputs.check(path, MAP_KINDS[options.format])
    write_map(path, frame.map.disparity, frame.map.settings)
    files   = [path]
    depth_m = frame.map.depth_m()
    if depth_m is not None:
        files.append(options.output/f"depth_{name}.npy")
        outputs.check(files[-1], DEPTH_NPY)
        write_depth(files[-1], depth_m)
    if options.images:
        for side, image in (("left", frame.left), ("right", frame.right)):
            files.append(options.output/side/f"{name}.png")
            outputs.check(files[-1], _IMAGE_PNG)
            write_png(files[-1], image, _IMAGE_PNG)
    return files


def _text(summary: dict[str, Any]) -> str:
    """Return the summary as text."""
    settings = summary["settings"]
    lines = [
        f"file      {summary['file']}" + ("" if summary["whole"] else ", not finished"),
        f"frames    {summary['frames']} in {summary['seconds']:.2f} s",
        f"size      {summary['width']}x{summary['height']} pixels, {settings['disparities']} disparities, block size "
        f"{settings['block_size']}",
        f"cameras   {'calibrated' if summary['calibrated'] else 'not known'}",
    ]
    if summary["decimated_by"] > 1:
        lines.append(f"decimated by {summary['decimated_by']}")
    return "\n".join([*lines, *(f"wrote     {path}" for path in summary["files"])])
