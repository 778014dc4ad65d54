#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""`litestereo calibration`: shows calibrations, and converts them to and from the records that devices keep."""

from __future__ import annotations

import argparse
import dataclasses
import json
from pathlib import Path
from typing import Any

from ..cameras.kinds import CALIBRATED_CAMERA
from ..cameras.pair_grids import PairGrids
from ..cameras.record import MAGIC, MOST_BYTES, CalibrationRecord
from ..cameras.rectify import FILES, Rectifier, geometry_text, read_calibration, write_calibration
from ..core.errors import GeometryError, ImageError, UsageError
from ..core.images import read_file
from ..core.outputs import Kind, Outputs, write_file
from .arguments import Parser, add_force, add_json
from .grids import grid_values, lines_of_grids

_EPILOG = """\
examples:
  litestereo calibration show calibration/
  litestereo calibration write calibration/ -o calibration.bin
  litestereo calibration read calibration.bin -o cameras/

A record is what a device keeps of a calibration: the cameras, and the grids with which the device rectifies their
images. docs/rectification.md has its bytes, and says what the grids are.
"""

_RECORD = Kind("calibration record", lambda head: head.startswith(MAGIC))


def add_parser(commands: argparse._SubParsersAction[Parser]) -> None:
    """Add the command."""
    parser = commands.add_parser("calibration", help="show a calibration, or convert it to a device's record",
                                 epilog=_EPILOG,
                                 description="Show a calibration, write it as the record that a device keeps, or read "
                                             "such a record.")
    parser.add_argument("action", choices=("show", "write", "read"),
                        help="show: print it; write: make a record; read: make left.yaml and right.yaml")
    parser.add_argument("calibration", metavar="FILE", type=Path,
                        help="a record, or a folder with left.yaml and right.yaml as `litestereo calibrate` writes "
                             "them")
    parser.add_argument("-o", "--output", metavar="FILE", type=Path,
                        help="file for the record of write, folder for the cameras of read (default: none)")
    add_json(parser)
    add_force(parser)
    parser.set_defaults(run=run)


@dataclasses.dataclass(frozen=True)
class _Loaded:
    """A calibration, its grids, and the files that it is from."""

    record: CalibrationRecord
    grids:  PairGrids
    files:  list[Path]


def run(options: argparse.Namespace) -> int:
    """Run the command."""
    if (options.output is None) != (options.action == "show"):
        raise UsageError(f"calibration {options.action} needs -o" if options.output is None else
                         "calibration show writes nothing: -o is for write and read")
    loaded  = _load(options.calibration)
    written = [] if options.output is None else _write(options, loaded)
    if options.json:
        print(json.dumps({**_summary(loaded), "files": [str(path) for path in written]}, indent=2))
    else:
        print("\n".join([*_lines(loaded), *(f"wrote         {path}" for path in written)]))
    return 0


def _load(path: Path) -> _Loaded:
    """Load the calibration of a folder or a record.

    Raises
    ------
    ImageError, GeometryError
        It cannot be read, or no device can rectify for its cameras; the message names the file.
    """
    rectifier = read_calibration(path) if path.is_dir() else None
    files     = [path] if rectifier is None else [path/name for name in FILES]
    data      = read_file(path) if rectifier is None else b""
    try:
        record = CalibrationRecord.decode(data) if rectifier is None else CalibrationRecord.of(rectifier)
        grids  = PairGrids(record.grids)
        # The error is known of grids that this host finds too.
        own    = (rectifier or Rectifier(*record.cameras)).pair.grids
    except GeometryError as error:
        raise GeometryError(f"{path}: {error}") from None
    return _Loaded(record, own if own is not None and own.crc == grids.crc else grids, files)


def _write(options: argparse.Namespace, loaded: _Loaded) -> list[Path]:
    """Write what the action writes, and return the files."""
    outputs = Outputs(loaded.files, options.force)
    if options.action == "write":
        data = loaded.record.encode()
        outputs.add(options.output, _RECORD)
        write_file(options.output, data)
        return [options.output]
    if options.output.exists() and not options.output.is_dir():
        raise ImageError(f"{options.output}: is a file, the cameras need a folder")
    written = [outputs.add(options.output/name, CALIBRATED_CAMERA) for name in FILES]
    write_calibration(options.output, loaded.record.cameras)
    return written


def _summary(loaded: _Loaded) -> dict[str, Any]:
    """Return what JSON says of a calibration."""
    return {
        **dataclasses.asdict(loaded.record.geometry),
        "cameras": [camera.name for camera in loaded.record.cameras],
        "bytes":   loaded.record.length,
        "grid":    grid_values(loaded.grids),
    }


def _lines(loaded: _Loaded) -> list[str]:
    """Return what is said to people of a calibration, a line each."""
    return [
        f"cameras       {', '.join(camera.name for camera in loaded.record.cameras)}",
        f"rectified     {geometry_text(loaded.record.geometry)}",
        *lines_of_grids(loaded.grids),
        f"record        {loaded.record.length} bytes, a device has room for {MOST_BYTES}",
    ]
