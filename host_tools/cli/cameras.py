#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Arguments that describe the cameras, and the geometry that they give."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..cameras.calib_txt import read_calib
from ..cameras.camera_info import CameraInfo, ideal_cameras, read_camera_info
from ..cameras.rectify import FILES, Rectifier
from ..core.errors import GeometryError, UsageError
from ..core.geometry import StereoGeometry
from .arguments import finite, positive

#: Geometry, left and right camera.
Cameras = tuple[StereoGeometry, tuple[CameraInfo, CameraInfo]]


def add_cameras(parser: argparse.ArgumentParser) -> None:
    """Add `--calibration`, `--calib`, and `--focal` with `--baseline`, `--principal-point` and `--doffs`."""
    group = parser.add_argument_group("cameras")
    group.add_argument("--calibration", metavar="DIR", type=Path,
                       help="folder with left.yaml and right.yaml of the cameras, camera_info of ROS (default: none)")
    group.add_argument("--calib", metavar="FILE", type=Path, help="calib.txt of Middlebury (default: none)")
    group.add_argument("--focal", metavar="PIXELS", type=positive, help="focal length (default: none)")
    group.add_argument("--baseline", metavar="METRES", type=positive, help="distance of the cameras (default: none)")
    group.add_argument("--principal-point", metavar=("X", "Y"), type=float, nargs=2,
                       help="principal point of the left camera in pixels, with --focal (default: centre of the map)")
    group.add_argument("--doffs", metavar="PIXELS", type=finite,
                       help="column of the right camera's principal point minus that of the left one, with --focal: "
                            "depth is focal*baseline/(disparity + doffs) (default: 0, which is said)")


def chosen_cameras(options: argparse.Namespace, width: int, height: int) -> Cameras | None:
    """Return geometry and cameras of a command line, None if it describes none.

    Raises
    ------
    UsageError
        It describes several, or one of them incompletely.
    ImageError, GeometryError
        A file has another format, or its cameras have another size than `width` x `height` pixels.
    """
    ideal = options.focal is not None or options.baseline is not None
    given = [options.calibration is not None, options.calib is not None, ideal]
    if sum(given) > 1:
        raise UsageError("give only one of --calibration, --calib, and --focal with --baseline")
    if options.principal_point is not None and not ideal:
        raise UsageError("--principal-point goes with --focal: --calibration and --calib have one already")
    if options.doffs is not None and not ideal:
        raise UsageError("--doffs goes with --focal: --calibration and --calib have it already")
    if options.calibration is not None:
        left, right = (read_camera_info(options.calibration / name) for name in FILES)
        # The map is rectified already. Cameras that cannot rectify images are not those that it was made with.
        geometry    = Rectifier(left, right).geometry
        cameras     = left, right
    elif any(given):
        geometry    = _ideal(options, width, height) if ideal else read_calib(options.calib).geometry
        cameras     = ideal_cameras(geometry)
    else:
        return None
    if (geometry.width, geometry.height) != (width, height):
        raise GeometryError(f"the map has {width}x{height} pixels, the cameras {geometry.width}x{geometry.height}: "
                            "give cameras that are calibrated for this size")
    return geometry, cameras


def _ideal(options: argparse.Namespace, width: int, height: int) -> StereoGeometry:
    if options.focal is None or options.baseline is None:
        raise UsageError("--focal and --baseline need each other")
    x, y = options.principal_point or ((width - 1)/2, (height - 1)/2)
    return StereoGeometry(width, height, options.focal, options.baseline, x, y, x + (options.doffs or 0.0))
