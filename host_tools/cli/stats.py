#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""`litestereo stats`: a device's counters."""

from __future__ import annotations

import argparse
import json

from ..device import connect
from .arguments import Parser, add_device, add_json

_EPILOG = """\
example:
  litestereo stats --device serial:/dev/ttyUSB0
"""


def add_parser(commands: argparse._SubParsersAction[Parser]) -> None:
    """Adds the command."""
    parser = commands.add_parser("stats", help="show a device's counters", epilog=_EPILOG,
                                 description="Show what a device has counted since it was reset.")
    add_device(parser)
    add_json(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Runs the command."""
    with connect(options.device) as device:
        counters = device.statistics()
    if options.json:
        print(json.dumps(counters, indent=2))
    else:
        width = max(map(len, counters), default=0)
        print("\n".join(f"{name:{width}}  {value}" for name, value in counters.items()))
    return 0
