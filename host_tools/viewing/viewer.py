#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What Rerun is shown of each frame: images, map, depth, cloud, and how fast it goes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..core.geometry import StereoGeometry
from ..core.images import color_image, disparity_pixels
from ..live.watch import Meter, Seen
from .recording import Recording, Target


class Viewer:
    """Shows frames; `close` it.

    Parameters
    ----------
    target
        Where the recording goes.
    geometry
        For depth and cloud; None for neither.
    max_points
        Of each cloud so many points are shown at most, evenly left out.

    Raises
    ------
    As `Recording`.
    """

    def __init__(self, target: Target, geometry: StereoGeometry | None, max_points: int) -> None:
        self._recording  = Recording(target)
        self._geometry   = geometry
        self._max_points = max_points
        self._begin_s: float | None = None
        self.page        = self._recording.page
        if geometry is not None:
            # x to the right, y down, z ahead, as cameras have it.
            self._recording.log("world", self._recording.rerun.ViewCoordinates.RDF, static=True)

    def show(self, number: int, seen: Seen, meter: Meter) -> None:
        """Adds a frame, on the timelines `frame` and `taken`, which begins with the first frame."""
        rerun, log = self._recording.rerun, self._recording.log
        if self._begin_s is None:
            self._begin_s = seen.shot.taken_at_s
        self._recording.stream.set_time("frame", sequence=number)
        self._recording.stream.set_time("taken", duration=seen.shot.taken_at_s - self._begin_s)
        log("left", rerun.Image(seen.shot.left))
        log("right", rerun.Image(seen.shot.right))
        log("disparity", rerun.Image(color_image(seen.result.disparity, seen.result.settings), color_model="BGR"))
        log("rate/frames_per_s", rerun.Scalars(meter.frames_per_s))
        log("rate/latency_ms", rerun.Scalars(1000*seen.latency_s))
        if self._geometry is not None and seen.depth_m is not None:
            # Rerun takes 0 for no depth.
            log("depth", rerun.DepthImage(np.nan_to_num(seen.depth_m), meter=1.0))
            points, grey = cloud(self._geometry, seen, self._max_points)
            log("world/points", rerun.Points3D(points, colors=np.repeat(grey[:, None], 3, axis=1)))

    def close(self) -> None:
        """Waits until everything has arrived; raises ViewerError if it does not."""
        self._recording.close()


def cloud(geometry: StereoGeometry, seen: Seen, max_points: int) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
    """Points of a frame (float32, N x 3, metres) and their grey values (uint8, N), `max_points` of them at most."""
    pixels = disparity_pixels(seen.result.disparity, seen.result.settings.invalid)
    points = geometry.points_m(pixels)
    there  = np.isfinite(points).all(axis=-1)
    step   = max(1, -(-int(there.sum())//max_points))
    return points[there][::step], seen.shot.left[there][::step]
