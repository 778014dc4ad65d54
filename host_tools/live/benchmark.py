#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Frame rate, latency and link of a device, seen from this host."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..core.settings import MatcherSettings
from ..devices.base import Device, Pair
from .meter import percentiles

#: Bytes of a pixel on the link: left and right image to the device, the map back.
_BYTES_TO_DEVICE   = 2
_BYTES_FROM_DEVICE = 2

#: Disparity of the made-up pairs in pixels, and their number: successive frames differ.
_SHIFT_PX = 7
_PAIRS    = 4


@dataclass(frozen=True)
class DeviceSpeed:
    """Speed of a device at one size of images.

    Parameters
    ----------
    width, height
        Size of the images in pixels.
    frames
        Frames matched one by one, and again as a stream.
    frames_per_s
        Rate of the stream over all its frames.
    latency_p50_s, latency_p95_s, latency_p99_s
        Time from the call to the map, in seconds, that so many percent of the single frames do not exceed.
    link_mb_per_s
        Bytes that the stream moved, to the device and back, in 10^6 bytes per second; None without a link.
    clocks
        Clocks of a frame, None if the device does not count them.
    """

    width:         int
    height:        int
    frames:        int
    frames_per_s:  float
    latency_p50_s: float
    latency_p95_s: float
    latency_p99_s: float
    link_mb_per_s: float | None
    clocks:        int | None


def made_up_pairs(width: int, height: int) -> list[Pair]:
    """Return pairs (uint8, H x W) of noise, shifted by some pixels; equal at each call."""
    rng    = np.random.default_rng(width*height)
    scenes = [rng.integers(0, 256, (height, width + _SHIFT_PX), np.uint8) for _ in range(_PAIRS)]
    return [(np.ascontiguousarray(scene[:, :width]), np.ascontiguousarray(scene[:, _SHIFT_PX:])) for scene in scenes]


def measure_device(device: Device, width: int, height: int, settings: MatcherSettings, frames: int,
                   advance: Callable[[], None] = lambda: None) -> DeviceSpeed:
    """Measure a device at one size: `frames` frames one by one, then as many as a stream.

    Parameters
    ----------
    width, height
        Size of the images in pixels.
    frames
        At least 1.
    advance
        Called after each frame.

    Raises
    ------
    As `Device.compute`.
    """
    pairs = made_up_pairs(width, height)
    # The first frame does not count: it waits for what is set up once.
    clocks    = device.compute(*pairs[0], settings).clocks
    latencies = []
    for number in range(frames):
        begin_s = time.perf_counter()
        device.compute(*pairs[number % _PAIRS], settings)
        latencies.append(time.perf_counter() - begin_s)
        advance()
    begin_s = time.perf_counter()
    for _ in device.stream((pairs[number % _PAIRS] for number in range(frames)), settings):
        advance()
    frames_per_s = frames/(time.perf_counter() - begin_s)
    p50_s, p95_s, p99_s = (float(value or 0.0) for value in percentiles(latencies).values())
    link_bytes = width*height*(_BYTES_TO_DEVICE + _BYTES_FROM_DEVICE)
    return DeviceSpeed(
        width         = width,
        height        = height,
        frames        = frames,
        frames_per_s  = frames_per_s,
        latency_p50_s = p50_s,
        latency_p95_s = p95_s,
        latency_p99_s = p99_s,
        link_mb_per_s = None if device.link_counters is None else frames_per_s*link_bytes/1e6,
        clocks        = clocks,
    )
