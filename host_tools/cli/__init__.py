#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The console command `litestereo`."""

from __future__ import annotations

import importlib.metadata
import sys
from collections.abc import Sequence

from ..core.errors import LiteStereoError, UsageError
from ..core.opencv import check_opencv
from .arguments import Parser
from .streams import standard_streams

SUCCESS     = 0
FAILURE     = 1
USAGE       = 2
INTERRUPTED = 130

_EPILOG = """\
examples:
  litestereo match left.png right.png -o out --device model:
  litestereo match left.png right.png -o out --device 'serial:/dev/ttyUSB0?baud=1000000' --block-size 15
  litestereo calibrate left/ right/ --pattern chessboard 9x6 --square 0.025 -o calibration/
  litestereo calibration show calibration/
  litestereo stream camera:0 camera:1 --device udp://192.168.1.50 --calibration calibration/
  litestereo view left.png right.png --device model: --montage out.png
  litestereo eval data/teddy --device model: --opencv bm --opencv sgbm
  litestereo measure camera:0 camera:1 --device udp://192.168.1.50 --calibration calibration/ --frames 30
  litestereo export out/disparity.npy -o out --format ply --left left.png --focal 700 --baseline 0.12
  litestereo info --device udp://192.168.1.50 --json
  litestereo console --device tcp://127.0.0.1:2000 selftest
  litestereo update firmware.bin --device udp://192.168.1.50

devices:
  udp://host:port                   a device on a network (default port: 19539)
  tcp://host:port                   a device whose serial line a TCP connection carries
  serial:/dev/ttyUSB0?baud=1000000  a device at a serial port (default baud: 1000000)
  sim:                              the full system in simulation, which this command starts
  cosim:?disparities=64&max_width=1024&max_block_size=21
                                    the gateware alone, in Verilator; trace=FILE.fst or .vcd writes a waveform
  model:                            the reference model, in NumPy

exit status: 0 success, 1 failure, 2 wrong usage, 130 interrupted (stream and view: 0, as Ctrl-C ends them)
"""


def _parser() -> Parser:
    # Imported here, because loading OpenCV takes a while, and `main` must catch an interrupt during it too.
    from . import (
        bench,
        calibrate,
        calibration,
        completion,
        console,
        evaluate,
        export,
        info,
        match,
        measure,
        play,
        rectify,
        stats,
        stream,
        update,
        view,
    )

    parser  = Parser(prog="litestereo", description="Stereo matching with a LiteStereo device.",
                     epilog=_EPILOG)
    version = importlib.metadata.version("litestereo")
    parser.add_argument("--version", action="version", version=f"litestereo {version}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for command in (match, stream, play, view, measure, calibrate, calibration, rectify, evaluate, export, bench, info,
                    stats, console, update):
        command.add_parser(commands)
    completion.add_parser(commands, lambda: parser)
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command with `arguments`, by default those of the process; return the exit status.

    Raises
    ------
    SystemExit
        By argparse: with status 2 for wrong usage, with 0 for `--help` and `--version`.
    """
    with standard_streams() as streams:
        try:
            status = _run(arguments)
            # Even after an error: what was printed before it may be missing.
            return status if streams.finish() or status else FAILURE
        except SystemExit as end:
            if streams.finish() or end.code:
                raise
            raise SystemExit(FAILURE) from None
        except KeyboardInterrupt:
            print("litestereo: interrupted", file=sys.stderr)
            return INTERRUPTED


def _run(arguments: Sequence[str] | None) -> int:
    """Run the command; return its exit status."""
    try:
        if warning := check_opencv():
            print(f"litestereo: warning: {warning}", file=sys.stderr)
        options = _parser().parse_args(arguments)
        status: int = options.run(options)
    except LiteStereoError as error:
        print(f"litestereo: error: {error}", file=sys.stderr)
        return USAGE if isinstance(error, UsageError) else FAILURE
    except OSError as error:
        # As of a name that is too long, or a folder that may not be listed.
        where = "" if error.filename is None else f"{error.filename}: "
        print(f"litestereo: error: {where}{error.strerror or error}", file=sys.stderr)
        return FAILURE
    return status
