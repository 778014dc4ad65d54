#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""`litestereo rectify`: rectifies pairs of images of a calibrated pair of cameras."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import rich.console
import rich.progress

from ..cameras.camera_info import ideal_cameras, write_camera_info
from ..cameras.rectify import FILES, geometry_text, read_calibration
from ..core.errors import ImageError
from ..core.images import read_picture, summed_notices, write_png
from ..data.sources.files import PairFiles, pair_files
from .arguments import Parser, add_calibration, add_json

_EPILOG = """\
examples:
  litestereo rectify left.png right.png --calibration calibration/ -o out
  litestereo rectify left/ right/ --calibration calibration/ -o out

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
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Run the command."""
    rectifier = read_calibration(options.calibration)
    folders   = options.left.is_dir()
    if folders != options.right.is_dir():
        raise ImageError("left and right must be two images, or two folders")
    files   = pair_files(options.left, options.right) if folders else [PairFiles("", options.left, options.right)]
    written = [options.output/name for name in FILES]
    for path, camera in zip(written, ideal_cameras(rectifier.geometry), strict=True):
        write_camera_info(path, camera)
    notices  = list[str]()
    terminal = rich.console.Console(stderr=True)
    with rich.progress.Progress(console=terminal, transient=True, disable=not terminal.is_terminal) as bars:
        for one in bars.track(files, description="rectify"):
            (left, left_notices), (right, right_notices) = read_picture(one.left), read_picture(one.right)
            notices += left_notices + right_notices
            pair     = rectifier.rectify(left, right)
            for side, image in zip(("left", "right"), pair, strict=True):
                path = options.output/side/f"{one.name}.png" if folders else options.output/f"{side}.png"
                write_png(path, image)
                written.append(path)
    for notice in summed_notices(notices):
        print(f"litestereo: note: {notice}", file=sys.stderr)
    if options.json:
        print(json.dumps({"files": [str(path) for path in written]}, indent=2))
    else:
        print("\n".join([f"rectified  {geometry_text(rectifier.geometry)}",
                         *(f"wrote      {path}" for path in written)]))
    return 0
