#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Encodes disparity, depth, cameras and cloud as messages of ROS 2."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..cameras.camera_info import CameraInfo
from ..core.extras import ros_types
from ..core.geometry import StereoGeometry
from ..core.settings import DISPARITY_SCALE
from .maps import SearchRange

_SECOND_NS = 1_000_000_000

#: PointField's number for float32, and its size in bytes.
_FLOAT32       = 7
_FLOAT32_BYTES = 4


@dataclass(frozen=True)
class StereoMessage:
    """A map with its points, image and cameras: the contents of the messages of one frame.

    Parameters
    ----------
    disparity_px
        float32, H x W, in pixels, nan where there is no disparity.
    points_m
        float32, H x W x 3, in metres, nan where there is none.
    image
        The left image: uint8, H x W x 3, BGR; None for a cloud without colours.
    geometry, cameras
        Geometry of the pair; left and right camera, None if no message needs them.
    search
        Range that was searched for the map.
    stamp_ns
        Time of the images in nanoseconds since 1970.
    frame_id
        Name of ROS's coordinate frame of the left camera, which all data refers to.
    """

    disparity_px: NDArray[np.float32]
    points_m:     NDArray[np.float32]
    image:        NDArray[np.uint8] | None
    geometry:     StereoGeometry
    cameras:      tuple[CameraInfo, CameraInfo] | None
    search:       SearchRange
    stamp_ns:     int
    frame_id:     str


class Messages:
    """Encodes frames as messages, by the definitions of ROS 2.

    Raises
    ------
    MissingExtraError
        rosbags, which has the definitions, is not installed.
    """

    def __init__(self) -> None:
        #: The definitions of messages.
        self.typestore = ros_types("a ROS bag needs")

    def of(self, frame: StereoMessage) -> Mapping[str, Any]:
        """Return all messages of a frame, by the last parts of their topics."""
        assert frame.cameras is not None, "two of the messages are of the cameras"
        left, right = frame.cameras
        return {
            "disparity":         self.disparity(frame),
            "depth":             self.image(frame, frame.geometry.depth_m(frame.disparity_px)),
            "left/camera_info":  self.camera_info(frame, left),
            "right/camera_info": self.camera_info(frame, right),
            "points2":           self.points(frame),
        }

    def _make(self, kind: str, /, **values: Any) -> Any:
        return self.typestore.types[kind](**values)

    def header(self, stamp_ns: int, frame_id: str) -> Any:
        """Return a std_msgs/Header: a time in nanoseconds since 1970, and a coordinate frame."""
        stamp = self._make("builtin_interfaces/msg/Time", sec=stamp_ns//_SECOND_NS, nanosec=stamp_ns % _SECOND_NS)
        return self._make("std_msgs/msg/Header", stamp=stamp, frame_id=frame_id)

    def _header(self, frame: StereoMessage) -> Any:
        return self.header(frame.stamp_ns, frame.frame_id)

    def encode(self, message: Any) -> bytes:
        """Return the bytes of a message (CDR)."""
        return bytes(self.typestore.serialize_cdr(message, message.__msgtype__))

    def definition(self, kind: str) -> str:
        """Return the definition of a kind of messages."""
        return str(self.typestore.generate_msgdef(kind, ros_version=2)[0])

    def _window(self, x: int, y: int, width: int, height: int) -> Any:
        return self._make("sensor_msgs/msg/RegionOfInterest", x_offset=x, y_offset=y, width=width, height=height,
                          do_rectify=False)

    def grey_image(self, image: NDArray[np.uint8], stamp_ns: int, frame_id: str) -> Any:
        """Return a sensor_msgs/Image (mono8) of an image, uint8, H x W."""
        height, width = image.shape
        return self._make("sensor_msgs/msg/Image", header=self.header(stamp_ns, frame_id), height=height, width=width,
                          encoding="mono8", is_bigendian=0, step=width, data=np.ascontiguousarray(image).ravel())

    def compressed_image(self, png: bytes, stamp_ns: int, frame_id: str) -> Any:
        """Return a sensor_msgs/CompressedImage of the bytes of a PNG."""
        return self._make("sensor_msgs/msg/CompressedImage", header=self.header(stamp_ns, frame_id), format="png",
                          data=np.frombuffer(png, np.uint8))

    def translation(self, parent: str, child: str, metres: tuple[float, float, float], stamp_ns: int) -> Any:
        """Return a tf2_msgs/TFMessage: the coordinate frame `child` is at `metres` of `parent`, and not rotated."""
        x, y, z   = metres
        transform = self._make("geometry_msgs/msg/Transform",
                               translation=self._make("geometry_msgs/msg/Vector3", x=x, y=y, z=z),
                               rotation=self._make("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0))
        return self._make("tf2_msgs/msg/TFMessage", transforms=[self._make(
            "geometry_msgs/msg/TransformStamped", header=self.header(stamp_ns, parent), child_frame_id=child,
            transform=transform)])

    def image(self, frame: StereoMessage, values: NDArray[np.float32]) -> Any:
        """Return a sensor_msgs/Image (32FC1) of values, float32, H x W."""
        height, width = values.shape
        return self._make("sensor_msgs/msg/Image", header=self._header(frame), height=height, width=width,
                          encoding="32FC1", is_bigendian=0, step=width*_FLOAT32_BYTES, data=_bytes(values))

    def disparity(self, frame: StereoMessage) -> Any:
        """Return a stereo_msgs/DisparityImage.

        Its disparities and limits are relative to the disparity of infinity, so that the depth is f*T/d for any
        principal points. A value below min_disparity means that there is no disparity.
        """
        height, width = frame.disparity_px.shape
        zero_px       = frame.geometry.zero_px
        least         = frame.search.min_disparity - zero_px
        values        = np.where(np.isnan(frame.disparity_px), least - 1, frame.disparity_px - zero_px)
        return self._make(
            "stereo_msgs/msg/DisparityImage",
            header        = self._header(frame),
            image         = self.image(frame, values.astype(np.float32)),
            f             = frame.geometry.focal_px,
            t             = frame.geometry.baseline_m,
            valid_window  = self._window(*frame.search.window(width, height)),
            min_disparity = least,
            max_disparity = frame.search.max_disparity - zero_px,
            delta_d       = 1/DISPARITY_SCALE,
        )

    def camera_info(self, frame: StereoMessage, camera: CameraInfo) -> Any:
        """Return a sensor_msgs/CameraInfo."""
        return self._make(
            "sensor_msgs/msg/CameraInfo",
            header           = self._header(frame),
            height           = camera.height,
            width            = camera.width,
            distortion_model = camera.distortion_model,
            d                = camera.distortion.ravel(),
            k                = camera.camera_matrix.ravel(),
            r                = camera.rectification.ravel(),
            p                = camera.projection.ravel(),
            binning_x        = 0,
            binning_y        = 0,
            roi              = self._window(0, 0, 0, 0),  # All of the image.
        )

    def points(self, frame: StereoMessage) -> Any:
        """Return a sensor_msgs/PointCloud2 with the image's rows and columns, nan where there is no point."""
        height, width = frame.disparity_px.shape
        parts         = {name: frame.points_m[:, :, axis] for axis, name in enumerate("xyz")}
        if frame.image is not None:
            # By PCL's convention the four bytes of a float are blue, green, red and 0.
            padded       = np.dstack([frame.image, np.zeros((height, width), np.uint8)])
            parts["rgb"] = np.ascontiguousarray(padded).view("<f4")[:, :, 0]
        fields = [self._make("sensor_msgs/msg/PointField", name=name, offset=number*_FLOAT32_BYTES, datatype=_FLOAT32,
                             count=1) for number, name in enumerate(parts)]
        return self._make(
            "sensor_msgs/msg/PointCloud2",
            header       = self._header(frame),
            height       = height,
            width        = width,
            fields       = fields,
            is_bigendian = False,
            point_step   = len(fields)*_FLOAT32_BYTES,
            row_step     = len(fields)*_FLOAT32_BYTES*width,
            data         = _bytes(np.stack(list(parts.values()), axis=-1)),
            is_dense     = not np.isnan(frame.points_m).any(),
        )


def _bytes(values: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return the little-endian bytes of an array, row by row."""
    return np.frombuffer(values.astype("<f4").tobytes(), np.uint8)
