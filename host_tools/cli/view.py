#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""`litestereo view`: shows pairs, maps, depth and points."""

from __future__ import annotations

import argparse
import contextlib
import json
import sys
import time
from pathlib import Path

from ..core.errors import UsageError
from ..core.extras import install_command
from ..core.images import write_png
from ..core.outputs import MONTAGE_PNG, RECORDING, Outputs
from ..data.sources import open_source
from ..devices.connect import connect
from ..live.matching import match_source
from ..live.meter import RECENT_FRAMES, Meter
from ..viewing.montage import montage
from ..viewing.recording import DEFAULT_URL, Target
from ..viewing.viewer import Viewer
from .arguments import Parser, add_calibration, add_device, add_force, add_json, count
from .filters import add_filters, filter_values
from .matching import add_settings, device_settings, print_notices, stages_off
from .stopping import stopped_by_ctrl_c
from .stream import (
    SOURCES,
    add_source,
    checked_rectifier,
    chosen_matching,
    print_picture_notices,
    print_shortfalls,
    rectification,
    source_inputs,
    stream_text,
    unmatched,
)

#: Default port for the data of browsers; the page is at the next port.
_PORT = 9876

#: Interval at which the server of a recording polls for Ctrl-C, in seconds.
_POLL_S = 0.2

_EPILOG = f"""\
examples:
  litestereo view left.png right.png --device model: --montage out.png
  litestereo view camera:0 camera:1 --device udp://192.168.1.50 --calibration calibration/
  litestereo view both.avi --device model: --save out.rrd --frames 100
  litestereo view left/ right/ --device model: --serve

sources:
{SOURCES}

rates:
  rate/recent_frames_per_s  in Rerun: over the last {RECENT_FRAMES} frames
  frames_per_s              in the summary: over all frames

Shown are left, right and disparity, and with --calibration depth and points in metres. A file is opened with
`rerun out.rrd`. Ctrl-C ends the stream, with status 0. Rerun is needed for all but --montage:
  {install_command("view")}
"""


def add_parser(commands: argparse._SubParsersAction[Parser]) -> None:
    """Add the command."""
    parser = commands.add_parser("view", help="show pairs, maps, depth and points", epilog=_EPILOG,
                                 description="Match pair after pair and show them in Rerun, live or later, or as a "
                                             "still image.")
    add_source(parser)
    add_device(parser)
    add_calibration(parser)
    target = parser.add_mutually_exclusive_group()
    target.add_argument("--save", metavar="FILE", type=Path,
                        help="write a recording (.rrd) to open later (default: none)")
    target.add_argument("--connect", metavar="URL", nargs="?", const=DEFAULT_URL,
                        help="show it in a viewer that is running (default: a viewer is started; without URL "
                             f"{DEFAULT_URL})")
    target.add_argument("--serve", metavar="PORT", type=count, nargs="?", const=_PORT,
                        help="show it in browsers until Ctrl-C, to everyone who can reach this host; data at PORT, "
                             f"page at the next port (default: no; without PORT {_PORT})")
    parser.add_argument("--montage", metavar="FILE", type=Path,
                        help="write the last frame as a PNG, and start no viewer (default: none)")
    parser.add_argument("--max-points", metavar="N", type=count, default=100000,
                        help="largest number of points of a cloud (default: %(default)s)")
    add_json(parser)
    add_force(parser)
    add_settings(parser)
    add_filters(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Run the command. All that can be checked without the device is checked before connecting to it."""
    rectifier = checked_rectifier(options)
    if options.serve is not None and options.serve > 65534:
        raise UsageError(f"--serve needs a port and the next one, at most 65534, not {options.serve}")
    target    = Target(options.save, options.connect, options.serve)
    # A montage alone needs no viewer.
    viewed    = target != Target() or options.montage is None
    last      = None
    with contextlib.ExitStack() as closing:
        source   = closing.enter_context(open_source(options.source))
        outputs  = Outputs(source_inputs(options, source), options.force)
        for path, kind in ((options.save, RECORDING), (options.montage, MONTAGE_PNG)):
            if path is not None:
                outputs.add(path, kind)
        device   = closing.enter_context(connect(options.device))
        stop     = closing.enter_context(stopped_by_ctrl_c())
        choice   = device_settings(options, [device.info()])
        matching = chosen_matching(options, choice.settings, device, rectifier)
        print_notices([*source.notices, *choice.notices])
        viewer   = Viewer(target, rectifier is not None, options.max_points) if viewed else None
        meter    = Meter()
        if viewer is not None:
            # Close the recording after an error too: it holds the frames before.
            closing.callback(viewer.close)
        if viewer is not None and viewer.page:
            print(f"litestereo: note: open {viewer.page} in a browser, Ctrl-C ends it", file=sys.stderr)
        for last in match_source(device, source, matching, options.frames, stop):
            meter.count(last.latency_s)
            if viewer is not None:
                viewer.show(meter.frames - 1, last, meter)
        while viewer is not None and viewer.page and not stop.requested:
            time.sleep(_POLL_S)
        map_    = None if last is None else last.map
        summary = {"device": device.info().name, **meter.summary(), **stages_off(choice), **rectification(matching),
                   **unmatched(source), **filter_values(matching.filters, map_)}
    print_picture_notices(source)
    if options.montage is not None and last is not None:
        write_png(options.montage, montage(last), MONTAGE_PNG)
    files = [path for path in (options.save, options.montage) if path is not None]
    if options.json:
        print(json.dumps(summary | {"files": [str(path) for path in files]}, indent=2))
    else:
        print("\n".join([stream_text(summary, map_), *(f"wrote    {path}" for path in files)]))
    return print_shortfalls(source)
