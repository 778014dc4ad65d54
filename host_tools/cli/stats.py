#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""`litestereo stats`: shows a device's counters."""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterable

from ..devices.connect import connect
from ..link.urls import parse_url
from .arguments import Parser, add_device, add_json

_EPILOG = """\
example:
  litestereo stats --device serial:/dev/ttyUSB0
"""

#: Counters of a device on a network, in groups; all others come last.
_GROUPS = {
    "throughput": ("datagrams_received", "datagrams_sent", "chunks_received", "chunks_while_matching",
                   "frames_opened", "frames_matched", "frames_released"),
    "loss":       ("datagrams_malformed", "datagrams_overrun", "mailbox_overrun", "uploads_foreign",
                   "uploads_unfit"),
    "repairs":    ("chunks_repeated", "requests_refused"),
}


def add_parser(commands: argparse._SubParsersAction[Parser]) -> None:
    """Add the command."""
    parser = commands.add_parser("stats", help="show a device's counters", epilog=_EPILOG,
                                 description="Show a device's counters since its reset.")
    add_device(parser)
    add_json(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Run the command."""
    with connect(options.device) as device:
        counters = device.statistics()
    if options.json:
        print(json.dumps(counters, indent=2))
    elif parse_url(options.device).scheme == "udp":
        print(_grouped(counters))
    else:
        print("\n".join(_lines(counters, counters)))
    return 0


def _grouped(counters: dict[str, int]) -> str:
    groups = dict(_GROUPS)
    groups["others"] = tuple(counters.keys() - {name for names in groups.values() for name in names})
    lines: list[str] = []
    for group, names in groups.items():
        lines += [f"{group}:", *_lines(counters, [name for name in counters if name in names], "  ")]
    return "\n".join(lines)


def _lines(counters: dict[str, int], names: Iterable[str], indent: str = "") -> list[str]:
    width = max(map(len, counters), default=0)
    return [f"{indent}{name:{width}}  {counters[name]}" for name in names]
