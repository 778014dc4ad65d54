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
from .watch import percentiles

#: Bytes of a pixel on the link: left and right image there, the map back.
_BYTES_THERE = 2
_BYTES_BACK  = 2

#: Disparity of the made-up pairs in pixels, and how many of them there are, so that no two frames in line are alike.
_SHIFT_PX = 7
_PAIRS    = 4


@dataclass(frozen=True)
class Bench:
    """What was measured at one size.

    `frames_per_s` is that of a stream; the latencies are those of single frames, from the call to the map, in seconds.
    `link_mb_per_s` is what the stream moved both ways, in 10^6 bytes a second, None where there is no link.
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
    """Pairs (uint8, H x W) of noise, seen some pixels apart; the same ones each time."""
    rng    = np.random.default_rng(width*height)
    scenes = [rng.integers(0, 256, (height, width + _SHIFT_PX), np.uint8) for _ in range(_PAIRS)]
    return [(np.ascontiguousarray(scene[:, :width]), np.ascontiguousarray(scene[:, _SHIFT_PX:])) for scene in scenes]


def measure(device: Device, width: int, height: int, settings: MatcherSettings, frames: int,
            advance: Callable[[], None] = lambda: None) -> Bench:
    """Measures a device at one size: `frames` frames one by one, then as many as a stream.

    Parameters
    ----------
    frames
        At least 1.
    advance
        Called after each frame.

    Raises
    ------
    As `Device.compute`.
    """
    pairs = made_up_pairs(width, height)
    # The first frame may have to wait for what is set up once.
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
    seconds = time.perf_counter() - begin_s
    rate    = frames/seconds
    p50_s, p95_s, p99_s = (float(value or 0.0) for value in percentiles(latencies).values())
    has_link = device.link_counters is not None
    return Bench(
        width         = width,
        height        = height,
        frames        = frames,
        frames_per_s  = rate,
        latency_p50_s = p50_s,
        latency_p95_s = p95_s,
        latency_p99_s = p99_s,
        link_mb_per_s = rate*width*height*(_BYTES_THERE + _BYTES_BACK)/1e6 if has_link else None,
        clocks        = clocks,
    )
