#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The option `--filter` of all commands that filter maps."""

from __future__ import annotations

import argparse
import dataclasses
from typing import Any

from ..cameras.rectify import geometry_text
from ..core.disparity_map import DisparityMap
from ..core.errors import UsageError
from ..core.filters import FILTERS, FilterChain, parse_filter
from ..core.map_filter import MapFilter


def _lines() -> list[str]:
    """Return the filters with their parameters for the help."""
    lines = []
    for name, kind in FILTERS.items():
        lines.append(f"  {name}: {kind.text}")
        lines += [f"    {one.name}={one.default:g}  {one.least} to {one.most}: {one.text}"
                  for one in kind.parameters().values()]
    return lines


def add_filters(parser: argparse.ArgumentParser) -> None:
    """Add `--filter`."""
    group = parser.add_argument_group("filters", "\n".join([
        "Filters of the map, on this host, in the order in which they are given: after the speckle filter of",
        "--speckle-window. Each with its parameters and their defaults and ranges:", *_lines()]))
    group.add_argument("--filter", metavar="NAME[:key=value,...]", type=map_filter, action="append", default=[],
                       dest="filters", help="filter the map; may be repeated, and each is applied to the result of the "
                                            "one before (default: none)")


def map_filter(text: str) -> MapFilter:
    """Parse a filter with its parameters; an argument type."""
    try:
        return parse_filter(text)
    except UsageError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def chosen_filters(options: argparse.Namespace, missing_cameras: str = "") -> FilterChain:
    """Return the filters of a command line.

    Parameters
    ----------
    missing_cameras
        Why there are no cameras, and what to do; empty if there are.

    Raises
    ------
    UsageError
        A filter needs cameras, and there are none.
    """
    chain = FilterChain(options.filters)
    if missing_cameras and chain.needing_geometry():
        raise UsageError(f"the filter {chain.needing_geometry()[0]} needs the cameras: {missing_cameras}")
    return chain


def calibrated_filters(options: argparse.Namespace) -> FilterChain:
    """Return the filters of a command line with `--calibration`; raise UsageError as `chosen_filters`."""
    return chosen_filters(options, "give --calibration" if options.calibration is None else "")


def single_frame_notices(chain: FilterChain) -> list[str]:
    """Return a notice for each filter that changes nothing, because there is one frame of each scene."""
    return [f"the filter {name} changes nothing here: it needs several frames of one scene"
            for name in chain.needing_frames()]


def filter_values(chain: FilterChain, map_: DisparityMap | None) -> dict[str, Any]:
    """Return what JSON says of the filters, and of the pixels and cameras of a filtered map; None before the first."""
    return {
        "filters":      chain.summary(),
        "decimated_by": None if map_ is None else map_.factor,
        "geometry":     None if map_ is None or map_.geometry is None else dataclasses.asdict(map_.geometry),
    }


def decimation_text(map_: DisparityMap) -> str:
    """Return what is said to people of a map whose pixels are not those of the images; empty if they are."""
    if map_.factor == 1:
        return ""
    cameras = "" if map_.geometry is None else f": cameras {geometry_text(map_.geometry)}"
    return f"by {map_.factor}{cameras}"
