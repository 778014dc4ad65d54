#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Arguments of all commands that match, and the settings that they give."""

from __future__ import annotations

import argparse
import dataclasses
import sys
from collections.abc import Iterable, Sequence
from typing import Any

from ..core.features import feature_names
from ..core.settings import RULES, MatcherSettings
from ..core.speckle import SpeckleFilter
from ..devices.base import Choice, DeviceInfo, choose_settings
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
                                                  "the device was built without is off, unless an option asks for\nit; "
                                                  "a note says so.")
    group.add_argument("--strict", action="store_true",
                       help="refuse a device that was built without a stage that is on by default (default: match "
                            "without it)")
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


def _given(options: argparse.Namespace) -> dict[str, Any]:
    """Return the settings that a command line names."""
    return {name: getattr(options, name) for name in RULES if getattr(options, name) is not None}


def chosen_settings(options: argparse.Namespace, default: MatcherSettings) -> MatcherSettings:
    """Return the settings of a command line; those that it does not name are of `default`."""
    return dataclasses.replace(default, **_given(options))


def device_settings(options: argparse.Namespace, infos: Sequence[DeviceInfo],
                    default: MatcherSettings | None = None) -> Choice:
    """Return the settings of a command line for devices; raise UnsupportedError as `choose_settings`."""
    return choose_settings(infos, _given(options), default, options.strict)


def print_notices(notices: Iterable[str]) -> None:
    """Print notes on stderr, each once."""
    for notice in dict.fromkeys(notices):
        print(f"litestereo: note: {notice}", file=sys.stderr)


def stages_off(choice: Choice) -> dict[str, list[str]]:
    """Return what JSON says of the stages that a device lacks."""
    return {"stages_off": feature_names(choice.missing)}


def chosen_speckle_filter(options: argparse.Namespace) -> SpeckleFilter:
    """Return the speckle filter of a command line."""
    return SpeckleFilter(options.speckle_window, options.speckle_range)
