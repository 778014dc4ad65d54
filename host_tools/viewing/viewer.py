#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Shows frames in Rerun: images, map, depth, cloud, rate and latency."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..core.images import color_image
from ..live.matching import MatchedShot
from ..live.meter import Meter
from .recording import Recording, Target


class Viewer:
    """Shows frames in a recording of Rerun; `close` it at the end.

    Parameters
    ----------
    target
        Where the recording goes.
    calibrated
        Whether the frames have cameras, and with them depth and cloud.
    max_points
        Largest number of points of a cloud: of a larger cloud every second, third, ... point is shown.

    Raises
    ------
    As `Recording`.
    """

    def __init__(self, target: Target, calibrated: bool, max_points: int) -> None:
        self._recording  = Recording(target)
        self._max_points = max_points
        self._begin_s: float | None = None
        self.page        = self._recording.page
        if calibrated:
            # x to the right, y down, z ahead, as cameras have it.
            self._recording.log("world", self._recording.rerun.ViewCoordinates.RDF, static=True)

    def show(self, number: int, matched: MatchedShot, meter: Meter) -> None:
        """Add a frame on the timelines `frame` (its number) and `taken` (seconds since the first frame was taken)."""
        rerun, log = self._recording.rerun, self._recording.log
        if self._begin_s is None:
            self._begin_s = matched.taken.taken_at_s
        self._recording.stream.set_time("frame", sequence=number)
        self._recording.stream.set_time("taken", duration=matched.taken.taken_at_s - self._begin_s)
        log("left", rerun.Image(matched.shot.left))
        log("right", rerun.Image(matched.shot.right))
        colours = color_image(matched.map.disparity, matched.map.settings)
        log("disparity", rerun.Image(colours, color_model="BGR"))
        log("rate/recent_frames_per_s", rerun.Scalars(meter.recent_frames_per_s))
        log("rate/latency_ms", rerun.Scalars(1000*matched.latency_s))
        if matched.depth_m is not None:
            # To Rerun a depth of 0 means none.
            log("depth", rerun.DepthImage(np.nan_to_num(matched.depth_m), meter=1.0))
            points, grey = cloud(matched, self._max_points)
            log("world/points", rerun.Points3D(points, colors=np.repeat(grey[:, None], 3, axis=1)))

    def close(self) -> None:
        """Wait until everything has arrived, for a bounded time; raise ViewerError if it does not arrive."""
        self._recording.close()


def cloud(matched: MatchedShot, max_points: int) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
    """Return points of a frame (float32, N x 3, metres) and their grey values (uint8, N), N at most `max_points`.

    The frame has cameras.
    """
    assert matched.map.geometry is not None, "a frame without cameras has no points"
    points = matched.map.geometry.points_m(matched.map.pixels)
    there  = np.isfinite(points).all(axis=-1)
    step   = max(1, -(-int(there.sum())//max_points))
    return points[there][::step], matched.map.picture(matched.shot.left)[there][::step]
