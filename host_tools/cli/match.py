#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""`litestereo match`: a pair of images to a disparity map."""

from __future__ import annotations

import argparse
import dataclasses
import json
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import rich.console
import rich.progress
from numpy.typing import NDArray

from ..calibration.depth import write_cloud, write_depth
from ..calibration.rectify import read_calibration
from ..call import LinkCounters
from ..device import connect
from ..devices.base import DeviceInfo, Result, check_minimum_size, check_pair
from ..errors import ImageError
from ..ground_truth import read_ground_truth
from ..images import read_grey, write_disparity
from ..metrics import Quality, rate
from ..settings import MatcherSettings
from ..speckle import SpeckleFilter
from .arguments import Parser, add_calibration, add_device, add_json, positive
from .matching import add_settings, chosen_settings, chosen_speckle_filter

#: Clock that frame rates are given for, so that simulations and boards can be compared.
_RATE_CLOCK_HZ = 100_000_000

_EPILOG = """\
examples:
  litestereo match left.png right.png -o out --device model:
  litestereo match left.png right.png -o out --device tcp://127.0.0.1:2000 --disparities 32 --block-size 15
  litestereo match left.png right.png -o out --device cosim: --ground-truth truth.png --ground-truth-scale 4
  litestereo match left.png right.png -o out --device model: --disp12-max-diff 1 --speckle-window 100 --speckle-range 2
  litestereo match left.png right.png -o out --device model: --calibration calibration/

files written:
  disparity.npy        int16, sixteenths of a pixel, (min_disparity - 1)*16 where there is no disparity
  disparity.pfm        float32, pixels, inf where there is none (Middlebury)
  disparity.png        16 bits, 256 times the disparity in pixels, 0 where there is none (KITTI)
  disparity_color.png  for viewing, black where there is none
with --calibration, besides, of the rectified left image:
  depth.npy            float32, metres, nan where there is none
  cloud.ply            points in metres, with the image's colours
"""


def add_parser(commands: argparse._SubParsersAction[Parser]) -> None:
    """Adds the command."""
    parser = commands.add_parser("match", help="match a pair of images", epilog=_EPILOG,
                                 description="Match a rectified pair of images and write the disparity map.")
    parser.add_argument("left", metavar="LEFT", type=Path, help="left image, any kind that OpenCV reads")
    parser.add_argument("right", metavar="RIGHT", type=Path, help="right image, of the same size")
    parser.add_argument("-o", "--output", metavar="DIR", type=Path, required=True,
                        help="folder for the results, made if need be")
    add_device(parser)
    add_calibration(parser)
    parser.add_argument("--ground-truth", metavar="FILE", type=Path,
                        help="true disparities to rate the map by: PNG, PFM, .npy or .npz (default: none)")
    parser.add_argument("--ground-truth-scale", metavar="S", type=positive,
                        help="what the file's values are divided by to become pixels (default: 256 for "
                             "16-bit images, else 1)")
    add_json(parser)
    add_settings(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Runs the command; whatever can be checked without the device is checked before connecting."""
    left, left_notices   = read_grey(options.left)
    right, right_notices = read_grey(options.right)
    check_pair(left, right)
    rectifier = None if options.calibration is None else read_calibration(options.calibration)
    if rectifier is not None:
        left, right = rectifier.rectify(left, right)
    height, width = left.shape
    truth         = None
    if options.ground_truth is not None:
        truth = read_ground_truth(options.ground_truth, options.ground_truth_scale)
        if truth.shape != left.shape:
            raise ImageError(f"{options.ground_truth}: is {truth.shape[1]}x{truth.shape[0]} pixels, "
                             f"the images are {width}x{height}")
    if options.output.exists() and not options.output.is_dir():
        raise ImageError(f"{options.output}: is a file, the results need a folder")
    if None not in (options.disparities, options.block_size):
        check_minimum_size(width, height, chosen_settings(options, MatcherSettings()))

    with connect(options.device) as device:
        info     = device.info()
        settings = chosen_settings(options, info.default_settings())
        info.check(width, height, settings)
        for notice in left_notices + right_notices:
            print(f"litestereo: note: {notice}", file=sys.stderr)
        terminal = rich.console.Console(stderr=True)
        hidden   = not terminal.is_terminal
        with rich.progress.Progress(console=terminal, transient=True, disable=hidden) as bars:
            result = device.compute(left, right, settings, _ProgressBars(bars))
        link = device.link_counters

    speckle   = chosen_speckle_filter(options)
    disparity = result.disparity if rectifier is None else rectifier.clean(result.disparity, settings)
    result    = dataclasses.replace(result, disparity=speckle.apply(disparity, settings))
    files     = write_disparity(options.output, result.disparity, settings)
    depth_m   = None
    if rectifier is not None:
        depth_m = rectifier.depth_m(result.disparity, settings)
        files  += [options.output / "depth.npy", options.output / "cloud.ply"]
        write_depth(files[-2], depth_m)
        write_cloud(files[-1], rectifier, options.left, result.disparity, settings)
    quality = None if truth is None else rate(result.disparity, truth, settings.invalid)
    summary = (_summary(info, result, speckle, files, quality) | _link_summary(result, link)
               | {"depth_m": _depth_summary(depth_m)})
    print(json.dumps(summary, indent=2) if options.json else _text(summary))
    return 0


class _ProgressBars:
    """One bar for each phase."""

    def __init__(self, bars: rich.progress.Progress) -> None:
        self._bars = bars
        self._tasks: dict[str, rich.progress.TaskID] = {}

    def __call__(self, phase: str, done: int, total: int) -> None:
        if phase not in self._tasks:
            self._tasks[phase] = self._bars.add_task(phase, total=total)
        self._bars.update(self._tasks[phase], completed=done)


def _summary(info: DeviceInfo, result: Result, speckle: SpeckleFilter, files: list[Path],
             quality: Quality | None) -> dict[str, Any]:
    """Everything that is worth knowing of a match, as JSON has it."""
    pixels: NDArray[Any] = result.disparity
    height, width = pixels.shape
    clocks        = result.clocks
    return {
        "device":           info.name,
        "width":            width,
        "height":           height,
        **dataclasses.asdict(result.settings),
        "speckle_window":   speckle.window,
        "speckle_range":    speckle.range,
        "clocks":           clocks,
        "first_row_clocks": result.first_row_clocks,
        "clocks_per_pixel": clocks/(width*height) if clocks else None,
        "fps_at_100_mhz":   _RATE_CLOCK_HZ/clocks if clocks else None,
        "upload_s":         result.upload_s,
        "match_s":          result.match_s,
        "download_s":       result.download_s,
        "files":            [str(path) for path in files],
        "quality":          None if quality is None else {
            name: None if math.isnan(value) else value
            for name, value in dataclasses.asdict(quality).items()},
    }


def _depth_summary(depth_m: NDArray[np.float32] | None) -> dict[str, float] | None:
    """Nearest, middle and farthest depth in metres; None where there is none."""
    known = np.array([]) if depth_m is None else depth_m[np.isfinite(depth_m)]
    if not known.size:
        return None
    return {"nearest": float(known.min()), "median": float(np.median(known)), "farthest": float(known.max())}


def _link_summary(result: Result, link: LinkCounters | None) -> dict[str, Any]:
    """What the link to a device did; None where there is none."""
    carried = {"upload": 2*result.disparity.size, "download": result.disparity.nbytes}
    seconds = {"upload": result.upload_s, "download": result.download_s}
    rates   = {f"{phase}_mb_per_s": carried[phase]/seconds[phase]/1e6 if link and seconds[phase] > 0 else None
               for phase in carried}
    return {**rates, "repairs": link.repairs if link else None}


def _text(summary: dict[str, Any]) -> str:
    """The summary for people."""
    times = ", ".join(f"{phase} {summary[f'{phase}_s']:.3f} s" for phase in ("upload", "match", "download"))
    size  = f"{summary['width']}x{summary['height']} pixels"
    lines = [
        f"device      {summary['device']}",
        f"size        {size}, {summary['disparities']} disparities, block size {summary['block_size']}",
        f"time        {times}",
    ]
    if summary["repairs"] is not None:
        rates = ", ".join(f"{phase} {summary[f'{phase}_mb_per_s'] or 0:.3g} MB/s" for phase in ("upload", "download"))
        lines.append(f"link        {rates}, repairs {summary['repairs']}")
    if summary["clocks"]:
        lines.append(f"clocks      {summary['clocks']}, {summary['clocks_per_pixel']:.3f} per pixel, "
                     f"{summary['fps_at_100_mhz']:.1f} frames/s at 100 MHz")
    if summary["depth_m"] is not None:
        depth = summary["depth_m"]
        lines.append(f"depth       {depth['nearest']:.3f} to {depth['farthest']:.3f} m, median {depth['median']:.3f} m")
    if summary["quality"] is not None:
        quality = {name: math.nan if value is None else value for name, value in summary["quality"].items()}
        lines += [
            f"bad-1.0     {quality['bad_1_0']:.2f} %",
            f"bad-2.0     {quality['bad_2_0']:.2f} %",
            f"mean error  {quality['mean_error']:.3f} pixels",
            f"density     {quality['density']:.2f} %",
        ]
    return "\n".join([*lines, *(f"wrote       {path}" for path in summary["files"])])
