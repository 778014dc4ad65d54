#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Arguments of all commands that match, and the settings that they give."""

from __future__ import annotations

import argparse
import dataclasses

from ..core.settings import RULES, MatcherSettings
from ..core.speckle import SpeckleFilter
from .arguments import natural, setting

#: Limits of a device that replace the default where they are less.
_LIMITS = {"disparities": "the device's number", "block_size": "the device's largest"}


def _help(name: str) -> str:
    """Return the help of a setting: what it is, its range and its default."""
    rule, default = RULES[name], getattr(MatcherSettings(), name)
    text = rule.text
    if rule.values:
        return f"{text} (default: {rule.values[rule.default]})"
    if rule.most is None:
        kind = f"a multiple of {rule.step}" if rule.step > 2 else "odd"
        return f"{text}, {kind} (default: {default}, or {_LIMITS[name]} if that is less)"
    least = 0 if rule.off is not None and rule.off < 0 else rule.least
    unit  = f" {rule.unit}" if rule.unit else ""
    off   = f", {rule.off} for {rule.off_text}" if rule.off_text else ""
    return f"{text}, {least} to {rule.most}{unit}{off} (default: {default})".replace("%", "%%")


def add_settings(parser: argparse.ArgumentParser, speckle: bool = True) -> None:
    """Add an argument for each setting, named as in cv2.StereoBM; the value of one that is not given is None.

    With `speckle` those of the speckle filter, which runs on this host, are added too.
    """
    block = RULES["block_size"]
    group = parser.add_argument_group("matching", "Defaults are cv2.StereoBM's, except the block size: "
                                                  f"{block.default}, OpenCV's is {block.opencv_default}.\nA stage that "
                                                  "the device was built without is off.")
    for name, rule in RULES.items():
        option = f"--{name.replace('_', '-')}"
        if rule.choice:
            group.add_argument(option, choices=rule.values, help=_help(name))
        elif rule.values:
            group.add_argument(option, action=argparse.BooleanOptionalAction, help=_help(name))
        else:
            group.add_argument(option, metavar="N", type=setting(name), help=_help(name))
    if not speckle:
        return
    group.add_argument("--speckle-window", metavar="N", type=natural, default=0,
                       help="size in pixels of the largest island that is removed, 0 for no filter; runs on this host "
                            "(default: 0)")
    group.add_argument("--speckle-range", metavar="N", type=natural, default=0,
                       help="largest difference between neighbours in an island, in sixteenths of a pixel (default: 0)")


def chosen_settings(options: argparse.Namespace, default: MatcherSettings) -> MatcherSettings:
    """Return the settings of a command line; those that it does not name are of `default`."""
    given = {name: getattr(options, name) for name in RULES if getattr(options, name) is not None}
    return dataclasses.replace(default, **given)


def chosen_speckle_filter(options: argparse.Namespace) -> SpeckleFilter:
    """Return the speckle filter of a command line."""
    return SpeckleFilter(options.speckle_window, options.speckle_range)
