#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""`litestereo match`: the disparity map of one pair of images."""

from __future__ import annotations

import argparse
import dataclasses
import json
from pathlib import Path

from ..cameras.rectify import FILES, read_calibration
from ..core.disparity_map import DisparityMap
from ..core.errors import ImageError
from ..core.images import plan_disparity, read_grey, write_disparity
from ..core.outputs import CLOUD_PLY, DEPTH_NPY, Outputs
from ..core.settings import MatcherSettings
from ..data.map_files import read_truth
from ..data.sources.pairing import check_distinct
from ..devices.base import check_minimum_size, check_pair
from ..devices.connect import connect
from ..evaluation.metrics import beyond_range, measure_map
from ..export.depth import write_cloud, write_depth
from ..live.rectifying import choose_rectifying
from .arguments import Parser, add_calibration, add_device, add_force, add_json, positive
from .filters import add_filters, calibrated_filters, filter_values, single_frame_notices
from .match_summary import depth_summary, link_summary, pair_summary, summary_text
from .matching import (
    add_settings,
    chosen_settings,
    chosen_speckle_filter,
    device_settings,
    print_notices,
    stages_off,
)
from .progress import progress_bars

_EPILOG = """\
examples:
  litestereo match left.png right.png -o out --device model:
  litestereo match left.png right.png -o out --device tcp://127.0.0.1:2000 --disparities 32 --block-size 15
  litestereo match left.png right.png -o out --device cosim: --ground-truth truth.png --ground-truth-scale 4
  litestereo match left.png right.png -o out --device model: --disp12-max-diff 1 --speckle-window 100 --speckle-range 2
  litestereo match left.png right.png -o out --device model: --calibration calibration/
  litestereo match left.png right.png -o out --device model: --filter spatial --filter hole_filling:holes_fill=0

files written:
  disparity.npy        int16, sixteenths of a pixel, (min_disparity - 1)*16 where there is no disparity
  disparity.pfm        float32, pixels, inf where there is none (Middlebury)
  disparity.png        16 bits, 256 times the disparity in pixels, 0 where there is none (KITTI)
  disparity_color.png  for viewing, black where there is none
and with --calibration, both of the rectified left image:
  depth.npy            float32, metres, nan where there is none
  cloud.ply            points in metres, with the image's colours

--filter decimation makes all of these smaller, and counts in larger pixels: --json has its `geometry`, and with
--ground-truth each pixel of the map is compared with all pixels of the images that it is made of.

--ground-truth prints Middlebury's metrics as `litestereo eval` has them, with the pixels that each is a share of: known
pixels have a true disparity (0, nan and inf are unknown), valid pixels are known ones with a disparity in the map. With
--json `quality` has all metrics that `litestereo eval --help` lists, by the same names. Only `eval` knows the ndisp of
a data set, and clips the maps to it.

The map is that of cv2.StereoBM pixel for pixel in the valid region, where whole blocks lie in both images. Outside of
it ours is invalid, while OpenCV 5.0 with a smallest disparity above 0 writes that many values past the end of each row.
"""


def add_parser(commands: argparse._SubParsersAction[Parser]) -> None:
    """Add the command."""
    parser = commands.add_parser("match", help="match a pair of images", epilog=_EPILOG,
                                 description="Match a rectified pair of images and write the disparity map.")
    parser.add_argument("left", metavar="LEFT", type=Path, help="left image, in any format that OpenCV reads")
    parser.add_argument("right", metavar="RIGHT", type=Path, help="right image, of the same size")
    parser.add_argument("-o", "--output", metavar="DIR", type=Path, required=True,
                        help="folder for the results, created if needed")
    add_device(parser)
    add_calibration(parser)
    parser.add_argument("--ground-truth", metavar="FILE", type=Path,
                        help="true disparities to compare the map with: PNG, PFM, .npy or .npz (default: none)")
    parser.add_argument("--ground-truth-scale", metavar="S", type=positive,
                        help="divisor from the file's values to pixels (default: 256 for 16-bit images, 16 for "
                             "int16, else 1)")
    add_json(parser)
    add_force(parser)
    add_settings(parser)
    add_filters(parser)
    parser.set_defaults(run=run)


def _plan(options: argparse.Namespace) -> None:
    """Check the results against the inputs and what is there; raise ImageError as `Outputs.add`."""
    inputs = [options.left, options.right, *([] if options.ground_truth is None else [options.ground_truth])]
    if options.calibration is not None:
        inputs += [options.calibration/name for name in FILES]
    outputs = Outputs(inputs, options.force)
    plan_disparity(options.output, outputs)
    if options.calibration is not None:
        outputs.add(options.output/"depth.npy", DEPTH_NPY)
        outputs.add(options.output/"cloud.ply", CLOUD_PLY)


def run(options: argparse.Namespace) -> int:
    """Run the command. All that can be checked without the device is checked before connecting to it."""
    filters = calibrated_filters(options)
    left, left_notices   = read_grey(options.left)
    right, right_notices = read_grey(options.right)
    check_pair(left, right)
    rectifier = None if options.calibration is None else read_calibration(options.calibration)
    if rectifier is not None:
        rectifier.check_size(left, right)
    height, width = left.shape
    truth         = None
    notices       = left_notices + right_notices + single_frame_notices(filters)
    if options.ground_truth is not None:
        read  = read_truth(options.ground_truth, options.ground_truth_scale)
        if read.pixels.shape != left.shape:
            raise ImageError(f"{options.ground_truth}: is {read.pixels.shape[1]}x{read.pixels.shape[0]} pixels, "
                             f"the images are {width}x{height}")
        if options.ground_truth_scale is None:
            seen = (left, right) if rectifier is None else rectifier.rectify(left, right)
            read = read.agreeing(seen[0], seen[1], "--ground-truth-scale")
        truth    = read.pixels
        notices += read.notices
    if options.output.exists() and not options.output.is_dir():
        raise ImageError(f"{options.output}: is a file, the results need a folder")
    _plan(options)
    if None not in (options.disparities, options.block_size):
        check_minimum_size(width, height, chosen_settings(options, MatcherSettings()))

    with connect(options.device) as device:
        info     = device.info()
        choice   = device_settings(options, [info])
        settings = choice.settings
        info.check(width, height, settings)
        check_distinct(options.left, options.right)
        if truth is not None and (beyond := beyond_range(truth, settings.min_disparity, settings.disparities)):
            notices.append(f"{options.ground_truth}: {beyond}")
        print_notices([*notices, *choice.notices])
        rectifying = None if rectifier is None else choose_rectifying(device, rectifier)
        with progress_bars() as progress:
            result = (device.compute(left, right, settings, progress) if rectifying is None
                      else rectifying.compute(device, left, right, settings, progress))
        link = device.link_counters

    speckle   = chosen_speckle_filter(options)
    disparity = result.disparity if rectifier is None else rectifier.clean(result.disparity, settings)
    result    = dataclasses.replace(result, disparity=speckle.apply(disparity, settings))
    geometry  = None if rectifier is None else rectifier.geometry
    map_      = filters.process(DisparityMap(result.disparity, settings, geometry))
    files     = write_disparity(options.output, map_.disparity, map_.settings)
    depth_m   = map_.depth_m()
    if rectifier is not None and depth_m is not None:
        files += [options.output / "depth.npy", options.output / "cloud.ply"]
        write_depth(files[-2], depth_m)
        write_cloud(files[-1], rectifier, options.left, map_)
    quality = None if truth is None else measure_map(map_.in_images(truth.shape), truth)
    summary = (pair_summary(info, result, map_, speckle, files, quality) | link_summary(result, link)
               | filter_values(filters, map_) | {"depth_m": depth_summary(depth_m)} | stages_off(choice)
               | {"rectification": None if rectifying is None else rectifying.summary()})
    print_notices([] if rectifying is None else [f"rectified {rectifying.text}"])
    print(json.dumps(summary, indent=2) if options.json else summary_text(summary, map_))
    return 0
