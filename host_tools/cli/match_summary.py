#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The summary of `litestereo match`, as JSON and as text."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.disparity_map import DisparityMap
from ..core.speckle import SpeckleFilter
from ..devices.base import DeviceInfo, Result
from ..evaluation.metrics import json_values, summary_texts
from ..link.settings import LinkCounters
from .filters import decimation_text

#: Clock that frame rates are given for, to compare simulations and boards.
_RATE_CLOCK_HZ = 100_000_000


def pair_summary(info: DeviceInfo, result: Result, map_: DisparityMap, speckle: SpeckleFilter, files: list[Path],
                 quality: dict[str, float] | None) -> dict[str, Any]:
    """Return what JSON says of a matched pair.

    Parameters
    ----------
    result, map_
        The map as it was matched, and after all filters.
    files
        Files that were written.
    quality
        What `measure_map` returned, None without a ground truth.
    """
    height, width = map_.disparity.shape
    clocks        = result.clocks
    return {
        "device":           info.name,
        "width":            width,
        "height":           height,
        **dataclasses.asdict(result.settings),
        "speckle_window":   speckle.window,
        "speckle_range":    speckle.range,
        "clocks":           clocks,
        "first_row_clocks": result.first_row_clocks,
        "clocks_per_pixel": clocks/result.disparity.size if clocks else None,
        "fps_at_100_mhz":   _RATE_CLOCK_HZ/clocks if clocks else None,
        "upload_s":         result.upload_s,
        "match_s":          result.match_s,
        "download_s":       result.download_s,
        "files":            [str(path) for path in files],
        "quality":          None if quality is None else json_values(quality),
    }


def depth_summary(depth_m: NDArray[np.float32] | None) -> dict[str, float] | None:
    """Return the nearest, median and farthest depth in metres; None if no pixel has a depth."""
    known = np.array([]) if depth_m is None else depth_m[np.isfinite(depth_m)]
    if not known.size:
        return None
    return {"nearest": float(known.min()), "median": float(np.median(known)), "farthest": float(known.max())}


def link_summary(result: Result, link: LinkCounters | None) -> dict[str, Any]:
    """Return rates of the link in 10^6 bytes per second, and its repairs; None where there is no link.

    Rates count the payload: the two images, and the map.
    """
    carried = {"upload": 2*result.disparity.size, "download": result.disparity.nbytes}
    seconds = {"upload": result.upload_s, "download": result.download_s}
    rates   = {f"{phase}_mb_per_s": carried[phase]/seconds[phase]/1e6 if link and seconds[phase] > 0 else None
               for phase in carried}
    return {**rates, "repairs": link.repairs if link else None}


def summary_text(summary: dict[str, Any], map_: DisparityMap) -> str:
    """Return the summary of a pair, whose map is `map_`, as text."""
    times = ", ".join(f"{phase} {summary[f'{phase}_s']:.3f} s" for phase in ("upload", "match", "download"))
    size  = f"{summary['width']}x{summary['height']} pixels"
    lines = [
        f"device      {summary['device']}",
        f"size        {size}, {summary['disparities']} disparities, block size {summary['block_size']}",
        f"time        {times}",
    ]
    if summary["repairs"] is not None:
        rates = ", ".join(f"{phase} {summary[f'{phase}_mb_per_s'] or 0:.3g} MB/s" for phase in ("upload", "download"))
        lines.append(f"link        {rates}, repairs {summary['repairs']}")
    if summary["clocks"]:
        lines.append(f"clocks      {summary['clocks']}, {summary['clocks_per_pixel']:.3f} per pixel, "
                     f"{summary['fps_at_100_mhz']:.1f} frames/s at 100 MHz")
    if decimated := decimation_text(map_):
        lines.append(f"decimated   {decimated}")
    if summary["depth_m"] is not None:
        depth = summary["depth_m"]
        lines.append(f"depth       {depth['nearest']:.3f} to {depth['farthest']:.3f} m, median {depth['median']:.3f} m")
    if summary["quality"] is not None:
        quality = {name: math.nan if value is None else value for name, value in summary["quality"].items()}
        lines  += [f"{label:11} {text}" for label, text in summary_texts(quality).items()]
    return "\n".join([*lines, *(f"wrote       {path}" for path in summary["files"])])
