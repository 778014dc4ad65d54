#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""`litestereo rectify`: rectifies pairs of images of a calibrated pair of cameras."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from ..cameras.camera_info import ideal_cameras, write_camera_info
from ..cameras.kinds import RECTIFIED_CAMERA
from ..cameras.rectify import FILES, geometry_text, read_calibration
from ..core.errors import ImageError
from ..core.images import read_picture, summed_notices, write_png
from ..core.outputs import RECTIFIED_PNG, Outputs
from ..data.sources.pairing import PairFiles, check_distinct, pair_files
from .arguments import Parser, add_calibration, add_force, add_json
from .matching import print_notices
from .progress import terminal_bars

_EPILOG = """\
examples:
  litestereo rectify left.png right.png --calibration calibration/ -o out
  litestereo rectify left/ right/ --calibration calibration/ -o out

The files of a pair in two folders have the same name, except for left and right, see `litestereo calibrate --help`.

files written:
  left.png, right.png    the rectified pair; of folders: left/NAME.png and right/NAME.png
  left.yaml, right.yaml  cameras of the rectified images, as ROS's camera_info, for `litestereo match --calibration`
"""


def add_parser(commands: argparse._SubParsersAction[Parser]) -> None:
    """Add the command."""
    parser = commands.add_parser("rectify", help="rectify pairs of images", epilog=_EPILOG,
                                 description="Rectify pairs of images of a calibrated pair of cameras. Bits per pixel "
                                             "and colours are kept.")
    parser.add_argument("left", metavar="LEFT", type=Path, help="left image, or a folder of them")
    parser.add_argument("right", metavar="RIGHT", type=Path, help="right image, or a folder of them")
    parser.add_argument("-o", "--output", metavar="DIR", type=Path, required=True,
                        help="folder for the results, created if needed")
    add_calibration(parser, required=True)
    add_json(parser)
    add_force(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Run the command."""
    rectifier = read_calibration(options.calibration)
    folders   = options.left.is_dir()
    if folders != options.right.is_dir():
        raise ImageError("left and right must be two images, or two folders")
    files   = pair_files(options.left, options.right) if folders else [PairFiles("", options.left, options.right)]
    inputs  = [path for one in files for path in (one.left, one.right)]
    outputs = Outputs([*inputs, *(options.calibration/name for name in FILES)], options.force)
    written = [outputs.add(options.output/name, RECTIFIED_CAMERA) for name in FILES]
    images  = [[outputs.add(options.output/side/f"{one.name}.png" if folders else options.output/f"{side}.png",
                            RECTIFIED_PNG) for side in ("left", "right")] for one in files]
    notices = list[str]()
    with terminal_bars() as bars:
        for one, paths in bars.track(list(zip(files, images, strict=True)), description="rectify"):
            (left, left_notices), (right, right_notices) = read_picture(one.left), read_picture(one.right)
            notices += left_notices + right_notices
            pair     = rectifier.rectify(left, right)
            check_distinct(one.left, one.right)
            for path, image in zip(paths, pair, strict=True):
                write_png(path, image, RECTIFIED_PNG)
                written.append(path)
    # The last ones: with them the folder counts as complete.
    for path, camera in zip(written, ideal_cameras(rectifier.geometry), strict=False):
        write_camera_info(path, camera)
    print_notices(summed_notices(notices))
    if options.json:
        print(json.dumps({"files": [str(path) for path in written]}, indent=2))
    else:
        print("\n".join([f"rectified  {geometry_text(rectifier.geometry)}",
                         *(f"wrote      {path}" for path in written)]))
    return 0
