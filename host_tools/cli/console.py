#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""`litestereo console`: sends a line to the device's console."""

from __future__ import annotations

import argparse

from ..devices.connect import connect
from .arguments import Parser, add_device, positive

#: Longest wait for text from the console, in seconds; simulated self tests take a while.
_TIMEOUT_S = 60.0

#: Texts with which the firmware reports that a command has failed or is unknown.
_FAILURES = ("FAILED", ": refused: ", "usage: ", "unknown command")

_EPILOG = """\
examples:
  litestereo console --device tcp://127.0.0.1:2000 help
  litestereo console --device serial:/dev/ttyUSB0 selftest

The exit status is 1 if the device says that the command failed, was refused, or is unknown.
"""


def add_parser(commands: argparse._SubParsersAction[Parser]) -> None:
    """Add the command."""
    parser = commands.add_parser("console", help="send a line to the device's console", epilog=_EPILOG,
                                 description="Send a line to the device's console and print its reply.")
    add_device(parser)
    parser.add_argument("--timeout", metavar="SECONDS", type=positive, default=_TIMEOUT_S,
                        help="longest wait for text (default: %(default)g)")
    parser.add_argument("line", metavar="COMMAND", nargs="+", help="words of the line")
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Run the command."""
    with connect(options.device) as device:
        text = device.console(" ".join(options.line), options.timeout)
    print(text.rstrip("\n"))
    return 1 if any(failure in text for failure in _FAILURES) else 0
