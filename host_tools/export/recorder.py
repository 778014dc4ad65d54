#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Records streams as MCAP files of ROS 2 messages; `data.recordings` has the topics, and reads them."""

from __future__ import annotations

import contextlib
import importlib.metadata
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from ..cameras.camera_info import CameraInfo
from ..core.disparity_map import DisparityMap
from ..core.errors import ImageError
from ..core.geometry import StereoGeometry
from ..core.mcap import MAGIC, McapWriter
from ..core.outputs import Kind
from ..core.settings import MatcherSettings
from ..data.recordings import CAMERAS, COMPRESSED, DISPARITY, IMAGES, METADATA, RecordedMap
from ..data.sources import Shot
from .maps import SearchRange
from .messages import Messages, StereoMessage

_LIBRARY = "litestereo"

#: A recording is a file of ours.
RECORDED_MCAP = Kind("recording of a stream", lambda head: head.startswith(MAGIC) and _LIBRARY.encode() in head[:64])

#: Coordinate frames of the cameras, and the namespace of the topics.
FRAME_IDS = {"left": "left_camera_optical", "right": "right_camera_optical"}
NAMESPACE = "/stereo"

#: A static transform is for listeners that come later, too (transient local). Longest times mean no limit.
_NO_LIMIT = "\n    sec: 9223372036\n    nsec: 854775807\n"
_LATCHED  = {"offered_qos_profiles": "- history: 3\n  depth: 0\n  reliability: 1\n  durability: 1\n"
                                     f"  deadline:{_NO_LIMIT}  lifespan:{_NO_LIMIT}  liveliness: 1\n"
                                     f"  liveliness_lease_duration:{_NO_LIMIT}  avoid_ros_namespace_conventions: false"}

#: Geometry and cameras of a calibration.
Calibrated = tuple[StereoGeometry, tuple[CameraInfo, CameraInfo]]


class Recorder:
    """Writes frames into a recording; use `recording` to make one.

    Parameters
    ----------
    writer, path
        The MCAP file, and its path for errors.
    matched
        Settings that the pairs are matched with.
    cameras
        Left and right camera of the images as they are taken, and the geometry after rectification; None without a
        calibration.
    compressed
        Whether images are PNGs.

    Raises
    ------
    MissingExtraError
        rosbags, which has the messages, is not installed.
    """

    def __init__(self, writer: McapWriter, path: Path, matched: MatcherSettings, cameras: Calibrated | None,
                 compressed: bool) -> None:
        self.frames      = 0
        self._messages   = Messages()
        self._writer     = writer
        self._path       = path
        self._matched    = matched
        self._cameras    = cameras
        self._compressed = compressed
        self._channels   = dict[str, int]()

    def add(self, shot: Shot, map_: DisparityMap) -> None:
        """Add a frame: the images as they were taken, and the map after all filters.

        Raises
        ------
        ImageError
            The file cannot be written.
        """
        with _written(self._path):
            self._add(shot, map_)

    def _add(self, shot: Shot, map_: DisparityMap) -> None:
        stamp_ns = time.time_ns() - round((time.monotonic() - shot.taken_at_s)*1e9)
        if not self.frames:
            self._begin(map_, stamp_ns)
        for side, image in (("left", shot.left), ("right", shot.right)):
            if self._compressed:
                png = cv2.imencode(".png", image)[1].tobytes()
                self._write(IMAGES[side] + COMPRESSED, stamp_ns,
                            self._messages.compressed_image(png, stamp_ns, FRAME_IDS[side]))
            else:
                self._write(IMAGES[side], stamp_ns, self._messages.grey_image(image, stamp_ns, FRAME_IDS[side]))
        message = self._stereo_message(map_, stamp_ns)
        if self._cameras is not None:
            for topic, camera in zip(CAMERAS.values(), self._cameras[1], strict=True):
                self._write(topic, stamp_ns, self._messages.camera_info(message, camera))
        # The map is the last one of a frame.
        self._write(DISPARITY, stamp_ns, self._messages.disparity(message))
        self._writer.end_frame()
        self.frames += 1

    def _begin(self, map_: DisparityMap, stamp_ns: int) -> None:
        """Write what is there once: the settings, and where the right camera is."""
        self._writer.add_metadata(METADATA, RecordedMap(self._matched, map_.settings, map_.factor, NAMESPACE).values())
        if self._cameras is not None:
            baseline_m = self._cameras[0].baseline_m
            self._write("/tf_static", stamp_ns, self._messages.translation(FRAME_IDS["left"], FRAME_IDS["right"],
                                                                           (baseline_m, 0.0, 0.0), stamp_ns))

    def _stereo_message(self, map_: DisparityMap, stamp_ns: int) -> StereoMessage:
        settings = map_.settings
        geometry = map_.geometry
        if geometry is None:
            # Without cameras there is no depth: focal length and baseline are 1, and infinity is at 0.
            height, width = map_.disparity.shape
            geometry      = StereoGeometry(width, height, 1.0, 1.0, 0.0, 0.0, 0.0)
        search  = SearchRange(settings.disparities, settings.min_disparity, settings.block_size)
        cameras = None if self._cameras is None else self._cameras[1]
        points  = np.empty((0, 0, 3), np.float32)  # A recording has none.
        return StereoMessage(map_.pixels, points, None, geometry, cameras, search, stamp_ns, FRAME_IDS["left"])

    def _write(self, name: str, stamp_ns: int, message: Any) -> None:
        topic = name if name.startswith("/") else f"{NAMESPACE}/{name}"
        if topic not in self._channels:
            kind = message.__msgtype__
            self._channels[topic] = self._writer.add_channel(topic, kind, self._messages.definition(kind),
                                                             _LATCHED if name == "/tf_static" else {})
        self._writer.write(self._channels[topic], stamp_ns, self._messages.encode(message))


@contextlib.contextmanager
def _written(path: Path) -> Iterator[None]:
    """Raise ImageError, which names the file, for an error of the operating system in this context."""
    try:
        yield
    except OSError as error:
        raise ImageError(f"{path}: cannot be written: {error.strerror or error}") from None


@contextlib.contextmanager
def recording(path: Path, matched: MatcherSettings, cameras: Calibrated | None, compressed: bool) -> Iterator[Recorder]:
    """Yield a recorder into a file, and finish the file at the end, also after an error.

    The file has its name from the begin: what was recorded is there if the process is killed. A file without a frame is
    removed.

    Raises
    ------
    ImageError
        The file cannot be written; also by `Recorder.add`.
    MissingExtraError
        rosbags, which has the messages, is not installed.
    """
    Messages()  # Raises before there is a file.
    with _written(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        stream = path.open("wb")
    # Its head stays in the buffer until the first chunk.
    writer   = McapWriter(stream, f"{_LIBRARY} {importlib.metadata.version('litestereo')}")
    recorder = Recorder(writer, path, matched, cameras, compressed)
    try:
        yield recorder
    finally:
        # Errors of these two alone: those of the context are not of this file.
        with _written(path):
            try:
                writer.close()
            finally:
                stream.close()
            if not recorder.frames and path.is_file():
                path.unlink()
