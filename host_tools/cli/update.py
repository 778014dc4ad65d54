#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""`litestereo update`: replaces a device's firmware over its link."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from ..devices.base import RESTART_LIMIT_S
from ..devices.connect import connect
from ..devices.firmware_image import read_firmware
from ..protocol.payloads import Trial
from .arguments import Parser, add_device, add_json, positive
from .progress import progress_bars

_EPILOG = """\
examples:
  litestereo update build/colorlight_i5/firmware.bin --device udp://192.168.1.50
  litestereo update firmware.bin --device 'serial:/dev/ttyUSB0?baud=1000000' --no-restart

The device tries the new firmware first, and keeps the old one: it returns to that if the new one is reset three times
before a session begins with it.
If the power fails during the update, the device starts the old firmware or the new one. Then repeat the update.
"""


#: What the device does with the new firmware, by its trial: if it has not been restarted, and if it has been.
_AT_THE_NEXT_RESTART = {
    Trial.UNKNOWN:   ", which starts at its next restart",
    Trial.RUNNING:   ", which is tried at its next restart",
    Trial.CONFIRMED: ", which starts at its next restart",
    Trial.FELL_BACK: ", which starts at its next restart",
}
_NOW = {
    Trial.UNKNOWN:   "",
    Trial.RUNNING:   ", on trial",
    Trial.CONFIRMED: ", confirmed",
    Trial.FELL_BACK: ", which failed",
}


def add_parser(commands: argparse._SubParsersAction[Parser]) -> None:
    """Add the command."""
    parser = commands.add_parser("update", help="replace a device's firmware", epilog=_EPILOG,
                                 description="Write a firmware to a device's flash over its link, and start it.")
    parser.add_argument("firmware", metavar="FILE", type=Path, help="firmware.bin, as `make bitstream` writes it")
    add_device(parser)
    parser.add_argument("--no-restart", action="store_true",
                        help="let the old firmware run until the device is restarted (default: restart it)")
    parser.add_argument("--restart-limit", metavar="SECONDS", type=positive, default=RESTART_LIMIT_S,
                        help="longest wait for the device to come back (default: %(default)g)")
    add_json(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Run the command; the file is checked before connecting."""
    image = read_firmware(options.firmware)
    with connect(options.device) as device:
        before = device.info()
        with progress_bars() as progress:
            device.update_firmware(options.firmware, restart=not options.no_restart, progress=progress,
                                   restart_limit_s=options.restart_limit)
        trial = device.trial()
    summary = {"device": before.name, "url": before.url, "before": before.firmware_version, "after": image.version,
               "bytes": len(image.program), "restarted": not options.no_restart,
               "trial": trial.name.lower()}
    if options.json:
        print(json.dumps(summary, indent=2))
    else:
        print(f"{before.name}: firmware {before.firmware_version} -> {image.version}"
              + (_AT_THE_NEXT_RESTART if options.no_restart else _NOW)[trial])
    return 0
