#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Measures frames that the device rectifies, from memory and streamed, in clocks of the system.

The wire has several clocks for each of the system, so that a streamed frame does not wait for it.
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from ...host_tools.cameras.camera_info import CameraInfo
from ...host_tools.cameras.record import CalibrationRecord
from ...host_tools.cameras.rectify import Rectifier
from ...host_tools.core.errors import LiteStereoError
from ...host_tools.core.grid import row_budget
from ...host_tools.core.settings import MatcherSettings
from ...host_tools.devices.base import Result
from ...host_tools.protocol.messages import REPLY, MessageType
from ..models import rectification as model
from ..models.pattern import LEFT_SEED, RIGHT_SEED, pattern
from ..models.stereo_bm import stereo_bm
from ..system.capture import Captured, read_capture
from .ethernet import WIRE_HZ, EthernetCase, paced_device

#: Settings for which the simulated SoC that rectifies is built.
SETTINGS = MatcherSettings(disparities=16, block_size=9)

#: Frames of which each is sent while the ones before are matched.
QUEUED = 6

#: Clocks of the wire for one of the system: more than a pair per clock comes in.
WIRE_CLOCKS = 4

#: Most clocks of a frame, for each pixel of it and of the rows that come in before the first one leaves.
MOST_PER_FRAME = 1.03

#: Most clocks of each of the frames that follow one another, for each pixel.
MOST_QUEUED = 1.05

#: How frames come.
MODES = ("stored", "streamed")


@dataclass(frozen=True)
class RectifiedClocks:
    """What rectified frames take.

    Parameters
    ----------
    delay
        Rows that come in before the first rectified one leaves.
    alone
        Clocks of a frame alone, from its start to the last write.
    queued
        Clocks from frame to frame, of frames that follow one another.
    """
    width:  int
    height: int
    delay:  int
    alone:  int
    queued: float

    @property
    def per_pixel_with_delay(self) -> float:
        """Clocks of a frame alone, divided by its pixels and those of the rows of `delay`."""
        return self.alone/(self.width*(self.height + self.delay))

    @property
    def queued_per_pixel(self) -> float:
        """Clocks from frame to frame, divided by the pixels of a frame."""
        return self.queued/(self.width*self.height)

    def check(self) -> None:
        """Raise LiteStereoError if the frames take more clocks than the rectifier is made for."""
        for what, value, most in (("a frame alone", self.per_pixel_with_delay, MOST_PER_FRAME),
                                  ("each of the frames that follow", self.queued_per_pixel, MOST_QUEUED)):
            if value > most:
                raise LiteStereoError(f"{what} takes {value:.3f} clocks per pixel, more than {most}: {self}")


def rig(width: int, height: int, bent: float = 1.0) -> CalibrationRecord:
    """Return the calibration of a made-up pair of cameras with lenses of 44 degrees, a third of a degree off.

    Distortion and misalignment are `bent` times as large: with less of them fewer rows come in ahead.
    """
    size     = (width, height)
    focal    = 1.25*width
    matrices = [np.array([[focal, 0, 0.5*width + bent*x], [0, focal, 0.5*height + bent*y], [0, 0, 1]])
                for x, y in ((0.5, 0.3), (-0.4, -0.5))]
    lenses   = [bent*np.array(numbers) for numbers in ((-0.12, 0.05, 0.0003, -0.0002, 0.0),
                                                  (-0.11, 0.04, -0.0002, 0.0003, 0.0))]
    rotation = cv2.Rodrigues(bent*np.deg2rad([0.1, -0.3, 0.15]))[0]
    found    = cv2.stereoRectify(matrices[0], lenses[0], matrices[1], lenses[1], size, rotation,
                                 np.array([[-0.06], [bent*0.0002], [bent*0.0003]]),
                                 flags=cv2.CALIB_ZERO_DISPARITY, alpha=0)
    left, right = (CameraInfo(name, width, height, matrix, "plumb_bob", lens, turned, projection)
                   for name, matrix, lens, turned, projection
                   in zip(("left", "right"), matrices, lenses, found[:2], found[2:4], strict=True))
    return CalibrationRecord.of(Rectifier(left, right))


def _pair(width: int, height: int, number: int) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Return a raw pair: successive ones differ, so that a wrong frame is noticed."""
    return (pattern(width, height, LEFT_SEED + 2*number), pattern(width, height, RIGHT_SEED + 2*number))


def _check(result: Result, expected: NDArray[np.int16]) -> Result:
    if not np.array_equal(result.disparity, expected):
        raise LiteStereoError("the map of a rectified pair is wrong")
    return result


def measure_rectified(width: int, height: int, mode: str, bent: float = 1.0) -> RectifiedClocks:
    """Rectify and match a frame, then frames that follow one another; check all maps.

    Parameters
    ----------
    width, height
        Size of the frames, for which the simulated SoC has room.
    mode
        One of `MODES`.
    bent
        See `rig`.

    Raises
    ------
    LiteStereoError
        The device refused or failed, or a map is wrong.
    """
    record   = rig(width, height, bent)
    grids    = record.grids
    maps     = [model.expand(grid.nodes, width, height) for grid in grids]
    pairs    = [_pair(width, height, number) for number in range(2)]
    expected = [stereo_bm(*(model.remap(*one) for one in zip(pair, maps, strict=True)), SETTINGS) for pair in pairs]
    case     = EthernetCase("rectifying", "rectifying", WIRE_HZ//WIRE_CLOCKS, mode, width=width, height=height)
    with tempfile.TemporaryDirectory() as folder:
        capture = Path(folder) / "wire.pcap"
        with paced_device(case, capture) as device:
            device.write_calibration(record.encode())
            alone   = _check(device.compute(*pairs[0], SETTINGS, grids=grids), expected[0])
            results = device.stream((pairs[number % 2] for number in range(QUEUED)), SETTINGS, grids=grids)
            for number, result in enumerate(results):
                _check(result, expected[number % 2])
        captured = list(read_capture(capture))
    if alone.clocks is None:
        raise LiteStereoError("the device has counted no clocks")
    return RectifiedClocks(width, height, row_budget(grids).delay, alone.clocks, queued_clocks(captured)/WIRE_CLOCKS)


def queued_clocks(captured: list[Captured]) -> float:
    """Return the clocks of the wire from frame to frame: from map to map, but for the first two, of which one is alone.

    The maps of frames come in order, and the wire is idle when one begins.
    """
    begins: dict[int, int] = {}
    for entry in captured:
        if not entry.to_device and entry.message.type == MessageType.READ | REPLY:
            begins.setdefault(entry.message.frame_id, entry.clock)
    clocks = sorted(begins.values())[1:]
    return (clocks[-1] - clocks[0])/(len(clocks) - 1)


def rectified_figures(width: int, height: int) -> list[dict[str, str | float]]:
    """Measure rectified frames, and check their clocks; return the figures: name, value and unit.

    Raises
    ------
    LiteStereoError
        The device refused or failed, a map is wrong, or a frame takes too long.
    """
    rows: list[dict[str, str | float]] = []
    for mode in MODES:
        found = measure_rectified(width, height, mode)
        found.check()
        name  = f"{width}x{height}/d{SETTINGS.disparities}/b{SETTINGS.block_size}/{mode}"
        rows += [
            {"name": f"rectified_delay/{name}", "value": found.delay, "unit": "rows"},
            {"name": f"rectified_clocks_per_frame/{name}", "value": found.alone, "unit": "clocks"},
            {"name": f"rectified_clocks_per_pixel_and_delay/{name}", "value": round(found.per_pixel_with_delay, 4),
             "unit": "clocks"},
            {"name": f"rectified_clocks_per_queued_frame/{name}", "value": round(found.queued), "unit": "clocks"},
            {"name": f"rectified_clocks_per_queued_pixel/{name}", "value": round(found.queued_per_pixel, 4),
             "unit": "clocks"},
        ]
    return rows
