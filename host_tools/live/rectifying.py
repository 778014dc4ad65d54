#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Where the pairs of a calibration are rectified: on the device if it can, else on this host with the same bits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..cameras.rectify import Rectifier
from ..core.grid import GridPair
from ..core.settings import MatcherSettings
from ..devices.base import Device, Progress, Result


@dataclass(frozen=True, eq=False)
class Rectifying:
    """A rectifier, and why the device does not do what it does; an empty `gap` if the device does."""

    rectifier: Rectifier
    gap:       str

    @property
    def device_grids(self) -> GridPair | None:
        """The grids for `Device.stream`; None if this host rectifies."""
        grids = self.rectifier.pair.grids
        return None if self.gap or grids is None else grids.grids

    @property
    def where(self) -> str:
        """Either "device" or "host"."""
        return "host" if self.gap else "device"

    def compute(self, device: Device, left: NDArray[np.uint8], right: NDArray[np.uint8], settings: MatcherSettings,
                progress: Progress | None = None) -> Result:
        """Rectify and match one pair of images, uint8, H x W; raise as `Rectifier.rectify` and `Device.compute`."""
        if self.device_grids is None:
            return device.compute(*self.rectifier.rectify(left, right), settings, progress)
        return device.compute(left, right, settings, progress, self.device_grids)

    def summary(self) -> dict[str, Any]:
        """Return what JSON says of it."""
        grids = self.rectifier.pair.grids
        return {
            "where":  self.where,
            "crc":    None if grids is None else f"{grids.crc:08x}",
            "max_px": None if grids is None else grids.error.max_px,
            "rms_px": None if grids is None else grids.error.rms_px,
            "reason": self.gap or None,
        }

    @property
    def text(self) -> str:
        """The place, the grid and the reason, for people."""
        return rectification_text(self.summary())


def rectification_text(values: Mapping[str, Any]) -> str:
    """Return what a summary of `Rectifying` says, in a line."""
    place  = "this host" if values["where"] == "host" else "the device"
    how    = ("a position for each pixel" if values["crc"] is None else
              f"grid {values['crc']}, off by at most {values['max_px']:.2f} pixels")
    reason = f": {values['reason']}" if values["reason"] else ""
    return f"on {place} with {how}{reason}"


def choose_rectifying(device: Device, rectifier: Rectifier) -> Rectifying:
    """Return where to rectify for a device: on it if it can."""
    pair = rectifier.pair
    return Rectifying(rectifier, pair.no_grids if pair.grids is None else device.rectification_gap(pair.grids.grids))
