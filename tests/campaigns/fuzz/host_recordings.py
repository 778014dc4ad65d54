#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Fuzz target of recordings: MCAP files, and the messages in them."""

from __future__ import annotations

import struct
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from litestereo.host_tools.cameras.camera_info import ideal_cameras
from litestereo.host_tools.core.disparity_map import DisparityMap
from litestereo.host_tools.core.geometry import StereoGeometry
from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.host_tools.data.recordings import RecordingReader
from litestereo.host_tools.data.sources import Shot
from litestereo.host_tools.export.recorder import recording

_FOLDER = tempfile.TemporaryDirectory(prefix="litestereo-fuzz-")

_WIDTH, _HEIGHT = 12, 6


def _seed(calibrated: bool, compressed: bool) -> bytes:
    """Return a recording of two frames whose chunk has no sum, so that damage comes to the messages."""
    path     = Path(_FOLDER.name) / "seed.mcap"
    rng      = np.random.default_rng(4)
    settings = MatcherSettings(16, 5)
    geometry = StereoGeometry(_WIDTH, _HEIGHT, 100.0, 0.06, 6.25, 3.0, 6.0) if calibrated else None
    cameras  = (geometry, ideal_cameras(geometry)) if geometry is not None else None
    with recording(path, settings, cameras, compressed) as recorder:
        for number in range(2):
            left, right = rng.integers(0, 256, (2, _HEIGHT, _WIDTH), np.uint8)
            values      = rng.integers(settings.invalid, 256, left.shape).astype(np.int16)
            recorder.add(Shot(str(number), left, right), DisparityMap(values, settings, geometry))
    data  = bytearray(path.read_bytes())
    place = _chunk(data)
    # Its head has kind and length, two times and the size before the sum.
    struct.pack_into("<I", data, place + 9 + 24, 0)
    return bytes(data)


def _chunk(data: bytes) -> int:
    """Return the place of the first chunk."""
    place = 8
    while data[place] != 6:
        place += 9 + struct.unpack_from("<Q", data, place + 1)[0]
    return place


def recorded(data: bytes) -> None:
    """Read a recording, and check each frame."""
    path = Path(_FOLDER.name) / "a.mcap"
    path.write_bytes(data)
    reader = RecordingReader(path)
    for number, frame in enumerate(reader.frames()):
        assert frame.number == number
        assert frame.left.dtype == frame.right.dtype == np.uint8 and frame.left.ndim == frame.right.ndim == 2
        assert frame.map.disparity.dtype == np.int16 and frame.map.disparity.ndim == 2
        assert (frame.map.disparity >= frame.map.settings.invalid).all()


TARGETS: dict[str, Callable[[bytes], None]] = {"recording": recorded}

SEEDS: dict[str, list[bytes]] = {
    "recording": [_seed(calibrated, compressed) for calibrated in (False, True) for compressed in (False, True)],
}
