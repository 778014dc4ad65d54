#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Recordings of streams: what is in an MCAP file that `litestereo stream --record` has written.

The topics of a recording, all in one namespace:

| topic                                | is                                                                |
|--------------------------------------|-------------------------------------------------------------------|
| `left/image_raw`, `right/image_raw`  | the images as they were taken, sensor_msgs/Image, mono8           |
| ... with `/compressed`               | instead: the same as PNG, sensor_msgs/CompressedImage             |
| `left/camera_info`, `right/...`      | the cameras, with a calibration: sensor_msgs/CameraInfo           |
| `disparity`                          | the map after all filters, stereo_msgs/DisparityImage             |
| `/tf_static`                         | with a calibration: where the right camera is, tf2_msgs/TFMessage |

Without a calibration focal length and baseline of a DisparityImage are 1. A record of metadata, `litestereo`, has what
a map needs and messages do not have: the settings of the matcher and of the map, and its decimation.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from ..cameras.camera_info import CameraInfo, pair_geometry
from ..core.disparity_map import DisparityMap, decimated_geometry
from ..core.errors import GeometryError, ImageError, SettingsError
from ..core.extras import ros_types
from ..core.geometry import StereoGeometry
from ..core.images import decode_image
from ..core.mcap import McapMessage, McapReader
from ..core.settings import DISPARITY_SCALE, MatcherSettings

#: Name of the record of metadata, and the version of its contents.
METADATA, VERSION = "litestereo", "1"

#: Last parts of the topics.
DISPARITY   = "disparity"
IMAGES      = {"left": "left/image_raw", "right": "right/image_raw"}
CAMERAS     = {"left": "left/camera_info", "right": "right/camera_info"}
COMPRESSED  = "/compressed"

#: Kinds of the messages on these topics.
_IMAGE, _PNG = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
_KINDS       = {DISPARITY: "stereo_msgs/msg/DisparityImage",
                **dict.fromkeys(IMAGES.values(), _IMAGE),
                **{name + COMPRESSED: _PNG for name in IMAGES.values()},
                **dict.fromkeys(CAMERAS.values(), "sensor_msgs/msg/CameraInfo")}


@dataclass(frozen=True)
class RecordedMap:
    """What the metadata say of the maps of a recording.

    Parameters
    ----------
    matched, settings
        The settings that the pairs were matched with, and those of the maps.
    factor
        Rows and columns of the images in each of a map.
    namespace
        Namespace of the topics.
    """

    matched:   MatcherSettings
    settings:  MatcherSettings
    factor:    int
    namespace: str

    def values(self) -> dict[str, str]:
        """Return the texts of the record of metadata."""
        return {"version": VERSION, "matched": json.dumps(dataclasses.asdict(self.matched)),
                "settings": json.dumps(dataclasses.asdict(self.settings)), "factor": str(self.factor),
                "namespace": self.namespace}

    @classmethod
    def parse(cls, values: Mapping[str, str]) -> RecordedMap:
        """Return what texts say; raise ValueError if they are not those of a recording."""
        if values.get("version") != VERSION:
            raise ValueError("another version")
        try:
            matched, settings = (MatcherSettings(**json.loads(values[name])) for name in ("matched", "settings"))
            factor, namespace = int(values["factor"]), values["namespace"]
        except (KeyError, TypeError, RecursionError, SettingsError) as error:  # RecursionError: of many brackets.
            raise ValueError(str(error)) from None
        if factor < 1:
            raise ValueError("a factor below 1")
        return cls(matched, settings, factor, namespace)


@dataclass(frozen=True, eq=False)
class RecordedFrame:
    """A frame of a recording: its number, its time in nanoseconds since 1970, the images as taken, and the map."""

    number:   int
    stamp_ns: int
    left:     NDArray[np.uint8]
    right:    NDArray[np.uint8]
    map:      DisparityMap


@dataclass(frozen=True, eq=False)
class _Disparities:
    """What is needed of a stereo_msgs/DisparityImage: its values, float32, H x W, and the smallest disparity."""

    values: NDArray[np.float32]
    least:  float


class RecordingReader:
    """Reads a recording, a frame at a time.

    `recorded` and `cameras` are known once the first frame is read; `cameras` is None without a calibration. `cut`
    says, after the last frame, whether the end of the file is missing: the frames of all finished chunks are there.

    Raises
    ------
    MissingExtraError
        rosbags, which has the messages, is not installed.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._typestore = ros_types("a recording needs")
        self._reader    = McapReader(path)
        self.recorded: RecordedMap | None = None
        self.cameras:  tuple[CameraInfo, CameraInfo] | None = None
        self._geometry: StereoGeometry | None = None

    @property
    def cut(self) -> bool:
        """Whether the end of the file is missing, once all of it is read."""
        return self._reader.cut

    def frames(self) -> Iterator[RecordedFrame]:
        """Yield the frames.

        Raises
        ------
        ImageError
            The file cannot be read, is damaged, or is no recording of a stream.
        """
        parts  = dict[str, Any]()
        number = 0
        for message in self._reader.messages():
            if self.recorded is None:
                self.recorded = self._recorded()
            prefix = f"{self.recorded.namespace}/"
            if not message.topic.startswith(prefix):
                continue
            name = message.topic.removeprefix(prefix)
            if name not in _KINDS:
                continue
            try:
                if message.kind != _KINDS[name]:
                    raise ValueError("another kind of message")
                parts[name.removesuffix(COMPRESSED)] = self._decoded(message)
            except Exception:  # rosbags documents no list of what it raises for damaged bytes.
                raise ImageError(f"{self.path}: is damaged: a message of {message.topic} cannot be read") from None
            if name == DISPARITY:
                yield self._frame(number, message.stamp_ns, parts)
                parts   = {}
                number += 1
        if self.recorded is None:
            self._recorded()

    def _recorded(self) -> RecordedMap:
        """Return what the metadata say; raise ImageError if they are not those of a recording."""
        try:
            return RecordedMap.parse(self._reader.metadata.get(METADATA, {}))
        except ValueError:
            raise ImageError(f"{self.path}: is no recording of `litestereo stream --record`") from None

    def _decoded(self, message: McapMessage) -> Any:
        """Return a message: an image as uint8, H x W, a map as `_Disparities`, and others as rosbags has them."""
        found = self._typestore.deserialize_cdr(message.data, message.kind)
        if message.kind == _IMAGE:
            return _pixels(found, "u1")
        if message.kind == _PNG:
            image = decode_image(found.data.tobytes(), cv2.IMREAD_GRAYSCALE)
            if image is None:
                raise ValueError("no PNG")
            return image
        if message.kind == _KINDS[DISPARITY]:
            return _Disparities(_pixels(found.image, "<f4"), float(found.min_disparity))
        return found

    def _frame(self, number: int, stamp_ns: int, parts: Mapping[str, Any]) -> RecordedFrame:
        """Return the frame of the messages of one time, by the last parts of their topics."""
        missing = [name for name in IMAGES.values() if name not in parts]
        if missing:
            raise ImageError(f"{self.path}: is damaged: frame {number} has no {missing[0]}")
        if self.cameras is None and all(name in parts for name in CAMERAS.values()):
            try:
                left, right    = (_camera(side, parts[name]) for side, name in CAMERAS.items())
                self._geometry = pair_geometry(left, right)
                self.cameras   = left, right
            except GeometryError as error:
                raise ImageError(f"{self.path}: is damaged: {error}") from None
        left, right = (parts[name] for name in IMAGES.values())
        factor      = self._known.factor
        if left.shape != right.shape or parts[DISPARITY].values.shape != tuple(size//factor for size in left.shape):
            raise ImageError(f"{self.path}: is damaged: images and map of frame {number} do not fit each other")
        return RecordedFrame(number, stamp_ns, left, right, self._map(number, parts[DISPARITY]))

    @property
    def _known(self) -> RecordedMap:
        assert self.recorded is not None, "it is read before the first frame"
        return self.recorded

    def _map(self, number: int, message: _Disparities) -> DisparityMap:
        """Return the map of a message: the numbers that were recorded."""
        settings, factor = self._known.settings, self._known.factor
        values   = message.values
        geometry = None
        zero_px  = 0.0
        if self._geometry is not None:
            geometry = decimated_geometry(self._geometry, factor, values.shape)
            zero_px  = geometry.zero_px
        # Relative to the disparity of infinity, in float32: far closer to its sixteenth than to the next one.
        sixteenths = (values.astype(np.float64) + zero_px)*DISPARITY_SCALE
        # A pixel without a disparity is a whole pixel below the smallest one.
        valid      = values > message.least - 0.5
        if not (np.abs(sixteenths[valid]) <= np.iinfo(np.int16).max).all():
            raise ImageError(f"{self.path}: is damaged: frame {number} has disparities that no map holds")
        blank      = DisparityMap(np.zeros(values.shape, np.int16), settings, geometry, factor)
        return blank.with_values(sixteenths, valid)


def _pixels(image: Any, dtype: str) -> NDArray[Any]:
    """Return the pixels of a sensor_msgs/Image, H x W; raise ValueError if there are none, or not as many."""
    values = np.frombuffer(image.data.tobytes(), dtype).reshape(image.height, image.width)
    if not values.size:
        raise ValueError("no pixels")
    return values


def _camera(side: str, message: Any) -> CameraInfo:
    """Return the camera of a sensor_msgs/CameraInfo; raise GeometryError as `CameraInfo`."""
    return CameraInfo(side, int(message.width), int(message.height), message.k.reshape(3, 3).astype(np.float64),
                      str(message.distortion_model), message.d.astype(np.float64),
                      message.r.reshape(3, 3).astype(np.float64), message.p.reshape(3, 4).astype(np.float64))
