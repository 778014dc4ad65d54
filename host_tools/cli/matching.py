#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Arguments of all commands that match, and the settings that they give."""

from __future__ import annotations

import argparse
import dataclasses

from ..core.settings import DEFAULT_BLOCK_SIZE, DEFAULT_DISPARITIES, DISPARITY_STEP, PREFILTERS, RANGES, MatcherSettings
from ..core.speckle import SpeckleFilter
from .arguments import natural, setting

_HELP = {
    "min_disparity":     "smallest disparity in pixels",
    "prefilter_cap":     "largest slope that the prefilter keeps",
    "texture_threshold": "least sum of the prefilter's slopes in a block",
    "uniqueness_ratio":  "percent by which the cost of any other disparity must be larger, 0 for no test",
    "disp12_max_diff":   "largest difference in the left-right check in pixels, -1 for no check",
}

#: Names of the settings that an argument may change.
_SETTINGS = [field.name for field in dataclasses.fields(MatcherSettings)]


def add_settings(parser: argparse.ArgumentParser, speckle: bool = True) -> None:
    """Add an argument for each setting, named as in cv2.StereoBM; the value of one that is not given is None.

    With `speckle` those of the speckle filter, which runs on this host, are added too.
    """
    group   = parser.add_argument_group("matching", "Defaults are cv2.StereoBM's, except the block size: "
                                                    f"{DEFAULT_BLOCK_SIZE}, OpenCV's is 21.\nA stage that the device "
                                                    "was built without is off.")
    default = MatcherSettings()
    group.add_argument("--disparities", metavar="N", type=setting("disparities"),
                       help=f"number of disparities searched, a multiple of {DISPARITY_STEP} (default: "
                            f"{DEFAULT_DISPARITIES}, or the device's number if that is less)")
    group.add_argument("--block-size", metavar="N", type=setting("block_size"),
                       help=f"side of the block in pixels, odd (default: {DEFAULT_BLOCK_SIZE}, or the device's largest "
                            "if that is less)")
    group.add_argument("--prefilter", choices=PREFILTERS,
                       help=f"prefilter; without one there is no texture test (default: {default.prefilter})")
    for name, text in _HELP.items():
        least, most = RANGES[name]
        group.add_argument(f"--{name.replace('_', '-')}", metavar="N", type=setting(name),
                           help=f"{text}, {least} to {most} (default: {getattr(default, name)})")
    group.add_argument("--subpixel", action=argparse.BooleanOptionalAction,
                       help="sixteenths of a pixel, or whole pixels (default: sixteenths)")
    group.add_argument("--median", action=argparse.BooleanOptionalAction,
                       help="3x3 median of the map (default: none)")
    if not speckle:
        return
    group.add_argument("--speckle-window", metavar="N", type=natural, default=0,
                       help="size in pixels of the largest island that is removed, 0 for no filter; runs on this host "
                            "(default: 0)")
    group.add_argument("--speckle-range", metavar="N", type=natural, default=0,
                       help="largest difference between neighbours in an island, in sixteenths of a pixel (default: 0)")


def chosen_settings(options: argparse.Namespace, default: MatcherSettings) -> MatcherSettings:
    """Return the settings of a command line; those that it does not name are of `default`."""
    given = {name: getattr(options, name) for name in _SETTINGS if getattr(options, name) is not None}
    return dataclasses.replace(default, **given)


def chosen_speckle_filter(options: argparse.Namespace) -> SpeckleFilter:
    """Return the speckle filter of a command line."""
    return SpeckleFilter(options.speckle_window, options.speckle_range)
