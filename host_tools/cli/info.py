#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""`litestereo info`: shows name, limits and features of a device."""

from __future__ import annotations

import argparse
import dataclasses
import json
from typing import Any

from ..core.features import CAPABILITY_TEXTS, DESCRIPTIONS, Capability, feature_names
from ..devices.base import DeviceInfo
from ..devices.connect import connect
from .arguments import Parser, add_device, add_json

_EPILOG = """\
examples:
  litestereo info --device tcp://127.0.0.1:2000
  litestereo info --device 'cosim:?disparities=32' --json
"""


def add_parser(commands: argparse._SubParsersAction[Parser]) -> None:
    """Add the command."""
    parser = commands.add_parser("info", help="show name, limits and features of a device", epilog=_EPILOG,
                                 description="Show name, limits and features of a device.")
    add_device(parser)
    add_json(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Run the command."""
    with connect(options.device) as device:
        info = device.info()
    print(json.dumps(_as_json(info), indent=2) if options.json else _text(info))
    return 0


def _as_json(info: DeviceInfo) -> dict[str, Any]:
    lacks = info.lacks
    return {**dataclasses.asdict(info), "lacks": {**dataclasses.asdict(lacks), "stages": feature_names(lacks.stages)}}


def _lacks(info: DeviceInfo) -> list[str]:
    """Return what the device lacks of what cv2.StereoBM has, one line each."""
    lacks = info.lacks
    found = []
    if lacks.stages:
        names = [text for stage, text in DESCRIPTIONS.items() if stage & lacks.stages]
        found.append(f"of cv2.StereoBM: {', '.join(names)}")
    if lacks.disparities is not None:
        found.append(f"{lacks.disparities} disparities, the default of cv2.StereoBM")
    if lacks.block_size is not None:
        found.append(f"block size {lacks.block_size}, the default of cv2.StereoBM")
    if lacks.size is not None:
        found.append(f"images of {lacks.size[0]}x{lacks.size[1]}")
    return found


def _text(info: DeviceInfo) -> str:
    lines = [
        f"device       {info.name} at {info.url}",
        f"image        at most {info.max_width}x{info.max_height}, {info.max_pixels} pixels in all",
        f"disparities  {info.max_disparities}",
        f"block size   {info.min_block_size} to {info.max_block_size}",
        f"frame slots  {info.slots}",
    ]
    if info.sys_clk_hz:
        lines.append(f"clock        {info.sys_clk_hz/1e6:g} MHz")
    if info.gateware_version:
        lines.append(f"versions     gateware {info.gateware_version}, firmware {info.firmware_version}")
    lines.append(f"features     {', '.join(feature_names(info.features))}")
    lines += [f"lacks        {what}" for what in _lacks(info) or ["nothing that cv2.StereoBM has"]]
    for name, value in info.capabilities.items():
        lines.append(f"{name:12} {value}, {CAPABILITY_TEXTS[Capability[name.upper()]]}")
    return "\n".join(lines)
