#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""`litestereo export`: converts a disparity map to depth, a cloud or a ROS bag."""

from __future__ import annotations

import argparse
import json
import re
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..cameras.rectify import FILES
from ..core.errors import ImageError, UsageError
from ..core.geometry import StereoGeometry
from ..core.images import pfm_of, read_colour
from ..core.outputs import CLOUD_PLY, DEPTH_NPY, DEPTH_PNG, DISPARITY_PFM, DISPARITY_PNG, Outputs, write_file
from ..data.map_files import read_map
from ..export import files
from ..export.bag import check_bag, write_bag
from ..export.maps import SearchRange
from ..export.messages import StereoMessage
from .arguments import Parser, add_force, add_json, add_map_values, count, natural, positive
from .cameras import Cameras, add_cameras, chosen_cameras

#: Formats by their names in the command: the file, and its contents.
FORMATS = {
    "pfm":       ("disparity.pfm", "disparity in pixels, float32, inf where there is none (Middlebury)"),
    "png":       ("disparity.png", "256 times the disparity, 16 bits, 0 where there is none (KITTI)"),
    "depth-npy": ("depth.npy",     "depth in metres, float32, nan where there is none"),
    "depth-png": ("depth.png",     "depth in millimetres, 16 bits, 0 where there is none"),
    "ply":       ("cloud.ply",     "points in metres, binary, with the colours of --left"),
    "mcap":      ("rosbag2",       "folder of a ROS 2 bag: disparity, depth, left and right camera_info, points2"),
}

#: Kinds of the files; a bag is a folder.
_KINDS = {"pfm": DISPARITY_PFM, "png": DISPARITY_PNG, "depth-npy": DEPTH_NPY, "depth-png": DEPTH_PNG, "ply": CLOUD_PLY}

#: Formats that need no cameras.
_WITHOUT_CAMERAS = ("pfm", "png")

#: ROS stores seconds in a signed 32-bit integer.
_STAMP_LIMIT_NS = (1 << 31)*1_000_000_000

_EPILOG = f"""\
examples:
  litestereo export out/disparity.npy -o out --format ply --left left.png --calib calib.txt
  litestereo export out/disparity.npy -o out --format mcap --calibration calibration --disparities 32
  litestereo export out/disparity.pfm -o out --format depth-png --focal 700 --baseline 0.12
  litestereo export out/disparity.npy -o out --format pfm --format png --min-disparity 16

formats, and the files written:
{chr(10).join(f"  {name:9}  {file:13}  {text}" for name, (file, text) in FORMATS.items())}

MAP is what `litestereo match` writes: disparity.npy, .pfm or .png; or a map of another program: floating point in
pixels, int16 in sixteenths, a 16-bit image of 256ths. In floating point nan and inf mean none, and so does one value
below the smallest disparity, such as the -1 of cv2.StereoBM divided by 16. What is read otherwise than `match` writes
it is said on stderr; what is not certain is refused, with the option that decides it. The cameras are one of
--calibration, --calib, and --focal with --baseline and --doffs. A map does not store its settings: give
--min-disparity, if it was not 0, for every format, and --disparities and --block-size for mcap. Play the bag with `ros2
bag play out/rosbag2`.
"""


def add_parser(commands: argparse._SubParsersAction[Parser]) -> None:
    """Add the command."""
    parser  = commands.add_parser("export", help="convert a map to depth, a cloud or a ROS bag", epilog=_EPILOG,
                                  description="Convert a disparity map to files that other programs read.")
    default = SearchRange()
    parser.add_argument("map", metavar="MAP", type=Path, help="disparity map: .npy, .pfm or 16-bit .png")
    parser.add_argument("-o", "--output", metavar="DIR", type=Path, required=True,
                        help="folder for the results, created if needed")
    parser.add_argument("--format", choices=FORMATS, action="append", required=True, dest="formats",
                        help="format to write, may be repeated")
    add_map_values(parser)
    parser.add_argument("--left", metavar="IMAGE", type=Path, help="left image, for colours (default: none)")
    add_json(parser)
    add_force(parser)
    add_cameras(parser)
    matched = parser.add_argument_group("settings that the map was matched with")
    matched.add_argument("--disparities", metavar="N", type=count, default=default.disparities,
                         help="number of disparities (default: %(default)s)")
    matched.add_argument("--min-disparity", metavar="N", type=natural, default=default.min_disparity,
                         help="smallest disparity (default: %(default)s)")
    matched.add_argument("--block-size", metavar="N", type=count, default=default.block_size,
                         help="side of the block in pixels (default: %(default)s)")
    clouds  = parser.add_argument_group("clouds and bags")
    clouds.add_argument("--max-depth", metavar="METRES", type=positive,
                        help="omit points of the cloud that are farther (default: none)")
    clouds.add_argument("--namespace", metavar="NAME", type=_namespace, default="/stereo",
                        help="namespace of the bag's topics (default: %(default)s)")
    clouds.add_argument("--frame-id", metavar="NAME", default="left_camera_optical",
                        help="optical frame of the left camera (default: %(default)s)")
    clouds.add_argument("--stamp-ns", metavar="N", type=_stamp,
                        help="time of the images in nanoseconds since 1970 (default: now)")
    parser.set_defaults(run=run)


def _namespace(text: str) -> str:
    name = "/" + text.strip("/")
    if not re.fullmatch(r"(/[A-Za-z_][A-Za-z0-9_]*)+", name):
        raise argparse.ArgumentTypeError(f"must be letters, digits and _, with / between, as /stereo, not '{text}'")
    return name


def _stamp(text: str) -> int:
    stamp_ns = natural(text)
    if stamp_ns >= _STAMP_LIMIT_NS:
        raise argparse.ArgumentTypeError(f"must be less than {_STAMP_LIMIT_NS}, not '{text}'")
    return stamp_ns


def run(options: argparse.Namespace) -> int:
    """Run the command; all files are read and checked before the first one is written."""
    search    = SearchRange(options.disparities, options.min_disparity, options.block_size)
    formats   = list(dict.fromkeys(options.formats))
    read      = read_map(options.map, search.min_disparity, options.map_scale, options.none_values)
    disparity = read.pixels
    cameras   = chosen_cameras(options, disparity.shape[1], disparity.shape[0])
    image     = None if options.left is None else _colours(options.left, disparity)
    for format_ in formats:
        if cameras is None and format_ not in _WITHOUT_CAMERAS:
            raise UsageError(f"--format {format_} needs the cameras: give --calibration, --calib, or --focal with "
                             "--baseline")
    if "mcap" in formats:
        search.check(disparity)
    notices = read.notices
    if cameras is not None and options.calibration is None and options.calib is None and options.doffs is None and (
            set(formats) - set(_WITHOUT_CAMERAS)):
        notices.append("--doffs is not given: the principal points of both cameras are assumed to be equal (doffs 0), "
                       "else the depth is wrong")

    outputs = Outputs(_inputs(options), options.force)
    for format_ in formats:
        # A bag is a new folder: `write_bag` sees to that.
        if format_ in _KINDS:
            outputs.add(options.output/FORMATS[format_][0], _KINDS[format_])
    if "mcap" in formats:
        check_bag(options.output/FORMATS["mcap"][0])

    paths = [_write(options, format_, disparity, cameras, image, search) for format_ in formats]
    for notice in notices:
        print(f"litestereo: note: {notice}", file=sys.stderr)
    if options.json:
        print(json.dumps({"width": disparity.shape[1], "height": disparity.shape[0],
                          "valid_pixels": int(np.isfinite(disparity).sum()), "files": [str(path) for path in paths]},
                         indent=2))
    else:
        print("\n".join(f"wrote       {path}" for path in paths))
    return 0


def _inputs(options: argparse.Namespace) -> list[Path]:
    """Return the files that the command reads."""
    inputs = [options.map, *(path for path in (options.left, options.calib) if path is not None)]
    if options.calibration is not None:
        inputs += [options.calibration/name for name in FILES]
    return inputs


def _colours(path: Path, disparity: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Read the left image: uint8, H x W x 3, BGR; raise ImageError if it has not the map's size."""
    image = read_colour(path)
    if image.shape[:2] != disparity.shape:
        raise ImageError(f"{path}: is {image.shape[1]}x{image.shape[0]} pixels, the map "
                         f"{disparity.shape[1]}x{disparity.shape[0]}")
    return image


def _write(options: argparse.Namespace, format_: str, disparity: NDArray[np.float32], cameras: Cameras | None,
           image: NDArray[np.uint8] | None, search: SearchRange) -> Path:
    """Write one format; return the file."""
    path: Path = options.output / FORMATS[format_][0]
    contents: dict[str, Callable[[], bytes]] = {
        "pfm": lambda: pfm_of(disparity),
        "png": lambda: files.kitti_png(disparity),
    }
    if cameras is not None:
        geometry  = cameras[0]
        contents |= {
            "depth-npy": lambda: files.depth_npy(geometry.depth_m(disparity)),
            "depth-png": lambda: files.depth_png(geometry.depth_m(disparity)),
            "ply":       lambda: files.ply(_points(options, geometry, disparity), image),
        }
        if format_ == "mcap":
            stamp_ns = time.time_ns() if options.stamp_ns is None else options.stamp_ns
            message  = StereoMessage(disparity, _points(options, geometry, disparity), image, *cameras, search,
                                     stamp_ns, options.frame_id)
            return write_bag(path, [message], options.namespace)
    write_file(path, contents[format_]())
    return path


def _points(options: argparse.Namespace, geometry: StereoGeometry, disparity: NDArray[np.float32]) -> NDArray[Any]:
    points = geometry.points_m(disparity)
    if options.max_depth is not None:
        points[points[:, :, 2] > options.max_depth] = np.nan
    return points
