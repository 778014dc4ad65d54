#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What the commands that match share: arguments that become settings."""

from __future__ import annotations

import argparse
import dataclasses

from ..core.settings import DEFAULT_BLOCK_SIZE, DEFAULT_DISPARITIES, DISPARITY_STEP, PREFILTERS, RANGES, MatcherSettings
from ..core.speckle import SpeckleFilter
from .arguments import natural, setting

_HELP = {
    "min_disparity":     "smallest disparity in pixels",
    "prefilter_cap":     "largest slope that the prefilter keeps",
    "texture_threshold": "least sum of slopes in a block",
    "uniqueness_ratio":  "by how many percent more any other disparity must cost, 0 for no test",
    "disp12_max_diff":   "largest difference in the left-right check in pixels, -1 for no check",
}

#: Names of the settings that an argument may change.
_SETTINGS = [field.name for field in dataclasses.fields(MatcherSettings)]


def add_settings(parser: argparse.ArgumentParser, speckle: bool = True) -> None:
    """Adds an argument for each setting, named as in cv2.StereoBM; one that is not given stays None.

    `speckle` says whether those of the speckle filter, which runs on this host, are among them.
    """
    group   = parser.add_argument_group("matching", "Defaults are cv2.StereoBM's, as far as the device has the stage.")
    default = MatcherSettings()
    group.add_argument("--disparities", metavar="N", type=setting("disparities"),
                       help=f"disparities searched, a multiple of {DISPARITY_STEP} (default: {DEFAULT_DISPARITIES}, or "
                            "the device's number if that is less)")
    group.add_argument("--block-size", metavar="N", type=setting("block_size"),
                       help=f"side of the block in pixels, odd (default: {DEFAULT_BLOCK_SIZE}, or the device's largest "
                            "if that is less)")
    group.add_argument("--prefilter", choices=PREFILTERS, help=f"(default: {default.prefilter})")
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
                       help="largest number of pixels of an island that is removed, 0 for no filter; done on this host "
                            "(default: 0)")
    group.add_argument("--speckle-range", metavar="N", type=natural, default=0,
                       help="largest difference within an island in sixteenths of a pixel (default: 0)")


def chosen_settings(options: argparse.Namespace, default: MatcherSettings) -> MatcherSettings:
    """The settings of a command line, for what it does not say those of `default`."""
    given = {name: getattr(options, name) for name in _SETTINGS if getattr(options, name) is not None}
    return dataclasses.replace(default, **given)


def chosen_speckle_filter(options: argparse.Namespace) -> SpeckleFilter:
    """The speckle filter of a command line."""
    return SpeckleFilter(options.speckle_window, options.speckle_range)
