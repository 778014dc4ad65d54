#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Arguments and argument types that several commands share."""

from __future__ import annotations

import argparse
import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn

from ..core.errors import UsageError
from ..core.settings import MatcherSettings
from ..link.urls import DEVICE_VARIABLE, EXAMPLES, parse_url


class Parser(argparse.ArgumentParser):
    """A parser that keeps the line breaks of its examples, and reports an error in one line."""

    def __init__(self, **options: Any) -> None:
        super().__init__(formatter_class=argparse.RawDescriptionHelpFormatter, allow_abbrev=False, **options)

    def error(self, message: str) -> NoReturn:
        """End the process with status 2 and one line on stderr."""
        self.exit(2, f"litestereo: error: {message} (see {self.prog} --help)\n")


def add_device(parser: argparse.ArgumentParser, required: bool = True) -> None:
    """Add `--device`, with the environment's device as its default; a command may do without it unless `required`."""
    default = os.environ.get(DEVICE_VARIABLE)
    parser.add_argument("--device", metavar="URL", type=device_url, default=default,
                        required=required and default is None,
                        help=f"URL of the device: {', '.join(EXAMPLES.values())} (default: the environment "
                             f"variable {DEVICE_VARIABLE})")


def add_map_values(parser: argparse._ActionsContainer) -> None:
    """Add `--map-scale` and `--none-value`, which say what the values of a map in a file are."""
    parser.add_argument("--map-scale", metavar="S", type=positive,
                        help="divisor from the values of a map to pixels (default: 16 for int16, 256 for 16-bit "
                             "images, 1 for floating point)")
    parser.add_argument("--none-value", metavar="V", type=float, action="append", default=[], dest="none_values",
                        help="value of a map's pixels without a disparity, may be repeated; nan for only nan and inf "
                             "(default: found)")


def add_json(parser: argparse.ArgumentParser) -> None:
    """Add `--json`."""
    parser.add_argument("--json", action="store_true", help="print JSON instead of text (default: text)")


def add_force(parser: argparse.ArgumentParser) -> None:
    """Add `--force`."""
    parser.add_argument("--force", action="store_true",
                        help="replace files that this command reads, and files that are not of this command (default: "
                             "replace its earlier results only)")


def add_calibration(parser: argparse.ArgumentParser, required: bool = False) -> None:
    """Add `--calibration`."""
    parser.add_argument("--calibration", metavar="DIR", type=Path, required=required,
                        help="folder with left.yaml and right.yaml of the cameras, as `litestereo calibrate` writes "
                             "them" + ("" if required else "; images are rectified first (default: they are rectified "
                                                           "already)"))


def device_url(text: str) -> str:
    """Check the URL of a device; an argument type."""
    try:
        parse_url(text)
    except UsageError as error:
        raise argparse.ArgumentTypeError(str(error)) from None
    return text


def setting(name: str) -> Callable[[str], int]:
    """Return an argument type: a whole number that is valid for the field `name` of `MatcherSettings`."""
    def parse(text: str) -> int:
        number = integer(text)
        named: dict[str, Any] = {name: number}
        try:
            MatcherSettings(**named)
        except UsageError as error:
            raise argparse.ArgumentTypeError(str(error)) from None
        return number

    return parse


def natural(text: str) -> int:
    """Parse a whole number of at least 0; an argument type."""
    number = integer(text)
    if number < 0:
        raise argparse.ArgumentTypeError(f"must be a whole number of at least 0, not '{text}'")
    return number


def count(text: str) -> int:
    """Parse a whole number of at least 1; an argument type."""
    number = integer(text)
    if number < 1:
        raise argparse.ArgumentTypeError(f"must be a whole number of at least 1, not '{text}'")
    return number


def positive(text: str) -> float:
    """Parse a number above 0; an argument type."""
    try:
        number = float(text)
    except ValueError:
        number = 0.0
    if not 0 < number < float("inf"):
        raise argparse.ArgumentTypeError(f"must be a number above 0, not '{text}'")
    return number


def finite(text: str) -> float:
    """Parse a number; an argument type."""
    try:
        number = float(text)
    except ValueError:
        number = float("nan")
    if not math.isfinite(number):
        raise argparse.ArgumentTypeError(f"must be a number, not '{text}'")
    return number


def fraction(text: str) -> float:
    """Parse a number from 0 to 1; an argument type."""
    try:
        number = float(text)
    except ValueError:
        number = -1.0
    if not 0 <= number <= 1:
        raise argparse.ArgumentTypeError(f"must be a number from 0 to 1, not '{text}'")
    return number


def integer(text: str) -> int:
    """Parse a whole number; an argument type."""
    try:
        return int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"must be a whole number, not '{text}'") from None
