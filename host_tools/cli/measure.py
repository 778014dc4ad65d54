#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""`litestereo measure`: distance, plane, noise and holes of a flat target."""

from __future__ import annotations

import argparse
import contextlib
import dataclasses
import json
from pathlib import Path
from typing import Any

from ..core.disparity_map import DisparityMap, decimated_geometry
from ..core.errors import ImageError, UsageError
from ..core.geometry import StereoGeometry
from ..data.map_files import read_map
from ..data.sources import open_source
from ..devices.connect import connect
from ..evaluation.flat_target import FIGURES, TEMPORAL_FIGURES, Region, RegionMeter, figure_texts
from ..evaluation.metrics import json_values
from ..live.matching import match_source
from ..live.rectifying import rectification_text
from .arguments import Parser, add_device, add_json, add_map_values, count, natural, positive
from .cameras import add_cameras, chosen_cameras
from .filters import add_filters, decimation_text, filter_values
from .matching import add_settings, device_settings, print_notices, stages_off
from .stopping import stopped_by_ctrl_c
from .stream import (
    SOURCES,
    checked_rectifier,
    chosen_matching,
    print_picture_notices,
    print_shortfalls,
    rectification,
    unmatched,
)

_EPILOG = f"""\
examples:
  litestereo measure --map out/disparity.npy --calibration calibration/ --true-distance 1.5
  litestereo measure left.png right.png --device model: --calibration calibration/ --region 200 150 240 180
  litestereo measure camera:0 camera:1 --device udp://192.168.1.50 --calibration calibration/ --frames 30 --json
  litestereo measure left/ right/ --device model: --focal 700 --baseline 0.12 --filter spatial

Point the cameras at a flat target with texture, as squarely as possible. With --calibration the images of a source are
rectified first; with --calib or --focal they are rectified already, as are the maps of --map, whose smallest disparity
is --min-disparity. Ctrl-C ends the stream, and what was measured until then is printed.

sources:
{SOURCES}

figures, each the mean over the frames:
{chr(10).join(f"  {name:18}  {text}" for name, text in FIGURES.items())}
and over all frames, of two or more:
{chr(10).join(f"  {name:18}  {text}" for name, text in TEMPORAL_FIGURES.items())}

They are those of the Depth Quality Tool of librealsense, by its definitions; flatness and noise over time are added.
The plane is fitted to all points of the region. For what follows, 0.5 % of the points at either end of the depths do
not count. The subpixel error is that of the plane in pixels of disparity: it compares cameras at any distance.
"""

#: The rest of the summary, what is said to people of a decimation, and the exit status.
_Measured = tuple[dict[str, Any], str, int]

_NO_CAMERAS = "measure needs the cameras: give --calibration, --calib, or --focal with --baseline"


def add_parser(commands: argparse._SubParsersAction[Parser]) -> None:
    """Add the command."""
    parser = commands.add_parser("measure", help="measure distance, plane and noise of a flat target", epilog=_EPILOG,
                                 description="Measure a flat target in a region of a map: distance, fitted plane, "
                                             "flatness, noise, and pixels without a depth.")
    parser.add_argument("source", metavar="SOURCE", nargs="*", help="where the pairs come from, one or two names: see "
                                                                    "below (default: --map)")
    parser.add_argument("--map", metavar="FILE", type=Path, nargs="+", dest="maps",
                        help="measure these maps of rectified pairs, a frame each, and match nothing (default: none)")
    parser.add_argument("--frames", metavar="N", type=count, help="stop after N pairs (default: all)")
    parser.add_argument("--region", metavar=("X", "Y", "WIDTH", "HEIGHT"), type=natural, nargs=4,
                        help="first column and row, width and height, in pixels of the images (default: the middle "
                             "40 %% of width and height)")
    parser.add_argument("--true-distance", metavar="METRES", type=positive,
                        help="true distance of the target along the optical axis of the left camera, for the Z "
                             "accuracy (default: none)")
    add_device(parser, required=False)
    add_json(parser)
    add_cameras(parser)
    add_map_values(parser.add_argument_group("maps of files"))
    add_settings(parser)
    add_filters(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Run the command. All that can be checked without the device is checked before connecting to it."""
    _check(options)
    meter   = RegionMeter(None if options.region is None else Region(*options.region), options.true_distance)
    measure = _measure_source if options.source else _measure_maps
    summary, decimation, status = measure(options, meter)
    figures = meter.figures()
    if meter.measured is None:
        raise ImageError("there is no frame to measure")
    if not figures["fill_rate"] > 0:
        raise ImageError(f"no pixel of the region of {meter.measured} has a depth: is the target in it, and does it "
                         "have texture?")
    if options.json:
        print(json.dumps({**summary, "frames": meter.frames, "region": dataclasses.asdict(meter.measured),
                          **json_values(figures)}, indent=2))
    else:
        print("\n".join(f"{label:11} {text}" for label, text in [
            ("frames", str(meter.frames)), ("region", str(meter.measured)),
            *figure_texts(figures, options.true_distance), *([("decimated", decimation)] if decimation else []),
            *([] if summary["rectification"] is None
              else [("rectified", rectification_text(summary["rectification"]))])]))
    return status


def _check(options: argparse.Namespace) -> None:
    """Raise UsageError if the arguments do not go together, or there are no cameras."""
    if bool(options.source) == (options.maps is not None):
        raise UsageError("give either a source of pairs, one or two names, or --map")
    if options.source and options.device is None:
        raise UsageError("a source needs --device, a map alone is measured with --map")
    if options.maps is not None and options.filters:
        raise UsageError("the maps of --map are measured as they are: leave --filter out, or give it to the command "
                         "that matches")
    if all(given is None for given in (options.calibration, options.calib, options.focal, options.baseline)):
        raise UsageError(_NO_CAMERAS)


def _cameras(options: argparse.Namespace, width: int, height: int) -> StereoGeometry:
    """Return the cameras of a command line; raise as `chosen_cameras`, and UsageError if there are none."""
    cameras = chosen_cameras(options, width, height)
    if cameras is None:
        raise UsageError(_NO_CAMERAS)
    return cameras[0]


def _measure_maps(options: argparse.Namespace, meter: RegionMeter) -> _Measured:
    """Measure the maps of files."""
    shape = None
    for path in options.maps:
        read = read_map(path, options.min_disparity or 0, options.map_scale, options.none_values)
        height, width = read.pixels.shape
        if shape not in (None, read.pixels.shape):
            raise ImageError(f"{path}: is {width}x{height} pixels, other than {options.maps[0]}")
        shape = read.pixels.shape
        print_notices(read.notices)
        meter.add(read.pixels, _cameras(options, width, height))
    return {"device": None, "rectification": None}, "", 0


def _measure_source(options: argparse.Namespace, meter: RegionMeter) -> _Measured:
    """Measure the maps of a source."""
    rectifier = checked_rectifier(options)
    last: DisparityMap | None = None
    geometry = None if rectifier is None else rectifier.geometry
    with contextlib.ExitStack() as stack:
        source   = stack.enter_context(open_source(options.source))
        device   = stack.enter_context(connect(options.device))
        stop     = stack.enter_context(stopped_by_ctrl_c())
        choice   = device_settings(options, [device.info()])
        matching = chosen_matching(options, choice.settings, device, rectifier)
        print_notices([*source.notices, *choice.notices])
        for matched in match_source(device, source, matching, options.frames, stop):
            height, width = matched.taken.left.shape
            geometry = geometry or _cameras(options, width, height)
            if last is not None and last.disparity.shape != matched.map.disparity.shape:
                raise ImageError(f"{matched.taken.name}: is {width}x{height} pixels, other than the pairs before it")
            last = matched.map
            meter.add(last.pixels, decimated_geometry(geometry, last.factor, last.disparity.shape), last.factor)
        summary = {"device": device.info().name, **stages_off(choice), **rectification(matching), **unmatched(source),
                   **filter_values(matching.filters, last)}
    print_picture_notices(source)
    return summary, "" if last is None else decimation_text(last), print_shortfalls(source)
