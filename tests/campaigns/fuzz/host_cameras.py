#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Fuzz targets of the files of cameras."""

from __future__ import annotations

import contextlib
from collections.abc import Callable

from litestereo.host_tools.cameras.calib_txt import parse_calib
from litestereo.host_tools.cameras.camera_info import parse_camera_info
from litestereo.host_tools.core.errors import GeometryError

CALIB_TXT = b"""\
cam0=[140.5 0 79.5; 0 140.5 59.5; 0 0 1]
cam1=[140.5 0 81.25; 0 140.5 59.5; 0 0 1]
doffs=1.75
baseline=60.25
width=160
height=120
ndisp=32
"""

#: As camera_calibration writes it, with numbers that YAML 1.1 takes for texts.
CAMERA_INFO = b"""\
image_width: 640
image_height: 480
camera_name: rig/right
camera_matrix:
  rows: 3
  cols: 3
  data: [501., 0, 320.5, 0, 502., 240.5, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.25, 0.125, 1e-5, -2e-4, 0]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]
projection_matrix:
  rows: 3
  cols: 4
  data: [500, 0, 310, -60, 0, 500, 240, 0, 0, 0, 1, 0]
"""

#: As `ros2 topic echo` prints it: a document for each message.
ROS2_ECHO = b"""\
header:
  stamp:
    sec: 0
    nanosec: 0
  frame_id: cam
height: 480
width: 640
distortion_model: plumb_bob
d:
- -0.25
- 0.125
- 1.0e-05
- -0.0002
- 0.0
k: [501.0, 0.0, 320.5, 0.0, 502.0, 240.5, 0.0, 0.0, 1.0]
r: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
p: [500.0, 0.0, 310.0, -60.0, 0.0, 500.0, 240.0, 0.0, 0.0, 0.0, 1.0, 0.0]
binning_x: 0
binning_y: 0
roi:
  x_offset: 0
  y_offset: 0
  height: 0
  width: 0
  do_rectify: false
---
header:
  stamp:
"""


def camera_info(data: bytes) -> None:
    """Read the YAML file of a camera."""
    with contextlib.suppress(GeometryError):
        parse_camera_info(data, "left")


def calib_txt(data: bytes) -> None:
    """Read a calib.txt of Middlebury."""
    with contextlib.suppress(GeometryError):
        parse_calib(data)


TARGETS: dict[str, Callable[[bytes], None]] = {
    "camera_info": camera_info,
    "calib_txt":   calib_txt,
}

#: Valid files, from which a campaign makes its inputs.
SEEDS: dict[str, list[bytes]] = {
    "camera_info": [CAMERA_INFO, ROS2_ECHO],
    "calib_txt":   [CALIB_TXT],
}
