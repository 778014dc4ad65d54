#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Writes messages as a bag of ROS 2 (rosbag2) in an MCAP file."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from ..core.errors import ImageError
from ..core.extras import import_extra
from .messages import Messages, StereoMessage

#: Version of the bag's metadata: the oldest that rosbags writes, which older ROS 2 reads too.
_VERSION = 8


def check_bag(path: Path) -> None:
    """Raise ImageError if the folder exists already: a bag is never replaced."""
    if path.exists():
        raise ImageError(f"{path}: is there already, and a bag needs a new folder: remove it, or name another folder")


def write_bag(path: Path, frames: Iterable[StereoMessage], namespace: str) -> Path:
    """Write frames into a new bag, with topics in `namespace`.

    Returns
    -------
    The MCAP file, in the folder `path`.

    Raises
    ------
    ImageError
        The folder exists already, or cannot be written.
    MissingExtraError
        rosbags is not installed.
    """
    messages = Messages()
    rosbag2  = import_extra("rosbags.rosbag2", "ros", "a ROS bag needs")
    check_bag(path)
    try:
        with rosbag2.Writer(path, version=_VERSION, storage_plugin=rosbag2.StoragePlugin.MCAP) as writer:
            connections = {}
            for frame in frames:
                for name, message in messages.of(frame).items():
                    kind = message.__msgtype__
                    if name not in connections:
                        connections[name] = writer.add_connection(f"{namespace}/{name}", kind,
                                                                  typestore=messages.typestore)
                    writer.write(connections[name], frame.stamp_ns, messages.typestore.serialize_cdr(message, kind))
    except OSError as error:
        raise ImageError(f"{path}: cannot be written: {error.strerror or error}") from None
    return path / f"{path.name}.mcap"
