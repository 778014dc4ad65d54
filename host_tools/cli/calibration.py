#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""`litestereo calibration`: shows calibrations, converts them to records, and writes these to devices."""

from __future__ import annotations

import argparse
import dataclasses
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..cameras.kinds import CALIBRATED_CAMERA
from ..cameras.pair_grids import PairGrids
from ..cameras.record import MAGIC, MOST_BYTES, CalibrationRecord
from ..cameras.rectify import FILES, Rectifier, geometry_text, read_calibration, write_calibration
from ..core.errors import GeometryError, ImageError, UsageError
from ..core.images import read_file
from ..core.outputs import Kind, Outputs, write_file
from ..devices.connect import connect
from .arguments import Parser, add_force, add_json, device_url
from .grids import grid_values, lines_of_grids
from .progress import progress_bars

_EPILOG = """\
examples:
  litestereo calibration show calibration/
  litestereo calibration write calibration/ -o calibration.bin
  litestereo calibration read calibration.bin -o cameras/
  litestereo calibration write calibration/ --device udp://192.168.1.50
  litestereo calibration show --device udp://192.168.1.50
  litestereo calibration read --device udp://192.168.1.50 -o cameras/
  litestereo calibration erase --device udp://192.168.1.50

A record is what a device keeps of a calibration: the cameras, and the grids with which the device rectifies their
images. docs/rectification.md has its bytes, and says what the grids are.
"""

_RECORD = Kind("calibration record", lambda head: head.startswith(MAGIC))


def add_parser(commands: argparse._SubParsersAction[Parser]) -> None:
    """Add the command."""
    parser = commands.add_parser("calibration", help="show a calibration, convert it to a record, write it to a device",
                                 epilog=_EPILOG,
                                 description="Show a calibration, make the record of it that a device keeps, write it "
                                             "to a device, or read such a record.")
    parser.add_argument("action", choices=("show", "write", "read", "erase"),
                        help="show: print it; write: make a record, in a file or on a device; read: make left.yaml and "
                             "right.yaml; erase: have a device keep none")
    parser.add_argument("calibration", metavar="FILE", type=Path, nargs="?",
                        help="a record, or a folder with left.yaml and right.yaml as `litestereo calibrate` writes "
                             "them (default: the calibration of the device)")
    parser.add_argument("-o", "--output", metavar="FILE", type=Path,
                        help="file for the record of write, folder for the cameras of read (default: none)")
    parser.add_argument("--device", metavar="URL", type=device_url,
                        help="URL of the device whose calibration is shown, written, read or erased (default: none)")
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
    _check(options)
    if options.action == "erase":
        return _erase(options)
    loaded  = _read(options.device) if options.calibration is None else _load(options.calibration)
    written = [] if options.output is None else _write(options, loaded)
    if options.action == "write" and options.device is not None:
        _send(options.device, loaded)
    device = {} if options.device is None else {"device": options.device}
    if options.json:
        print(json.dumps({**_summary(loaded), "files": [str(path) for path in written], **device}, indent=2))
    else:
        places = [*written, *(device.values() if options.action == "write" else ())]
        print("\n".join([*_lines(loaded), *(f"wrote         {place}" for place in places)]))
    return 0


def _check(options: argparse.Namespace) -> None:
    """Raise UsageError if the arguments do not suit the action."""
    action  = f"calibration {options.action}"
    on_host = options.calibration is not None
    if options.action == "erase":
        if options.device is None or on_host or options.output is not None:
            raise UsageError(f"{action} needs --device, and nothing else")
        return
    if options.action == "write" and not on_host:
        raise UsageError(f"{action}: FILE is required, the calibration to write")
    if options.action != "write" and on_host == (options.device is not None):
        raise UsageError(f"{action}: either FILE or --device is required")
    if options.action == "show" and options.output is not None:
        raise UsageError("calibration show writes nothing: -o is for write and read")
    if options.action == "write" and (options.output is None) == (options.device is None):
        raise UsageError(f"{action} needs -o for a file, or --device")
    if options.action == "read" and options.output is None:
        raise UsageError(f"{action} needs -o")


def _read(url: str) -> _Loaded:
    """Return the calibration of a device.

    Raises
    ------
    UnsupportedError
        The device keeps no calibration.
    GeometryError
        It has none, or one that these host tools do not know.
    DeviceError
        It does not answer.
    """
    with connect(url) as device:
        data = device.calibration()
    if data is None:
        raise GeometryError(f"{url}: the device has no calibration")
    return _parsed(url, data)


def _send(url: str, loaded: _Loaded) -> None:
    """Write a calibration to a device; raise as `Device.write_calibration`."""
    with connect(url) as device, progress_bars() as progress:
        device.write_calibration(loaded.record.encode(), progress=progress)


def _erase(options: argparse.Namespace) -> int:
    """Erase the calibration of a device."""
    with connect(options.device) as device:
        device.erase_calibration()
    print(json.dumps({"device": options.device}, indent=2) if options.json
          else f"{options.device}: the device keeps no calibration")
    return 0


def _load(path: Path) -> _Loaded:
    """Load the calibration of a folder or a record.

    Raises
    ------
    ImageError, GeometryError
        It cannot be read, or no device can rectify for its cameras; the message names the file.
    """
    if not path.is_dir():
        return _parsed(str(path), read_file(path), [path])
    rectifier = read_calibration(path)
    try:
        return _with_grids(CalibrationRecord.of(rectifier), rectifier, [path/name for name in FILES])
    except GeometryError as error:
        raise GeometryError(f"{path}: {error}") from None


def _parsed(name: str, data: bytes, files: Sequence[Path] = ()) -> _Loaded:
    """Return the calibration of a record; raise GeometryError, which names it, if it is none."""
    try:
        record = CalibrationRecord.decode(data)
        return _with_grids(record, Rectifier(*record.cameras), files)
    except GeometryError as error:
        raise GeometryError(f"{name}: {error}") from None


def _with_grids(record: CalibrationRecord, rectifier: Rectifier, files: Sequence[Path]) -> _Loaded:
    """Return a calibration; the error of its grids is known if this host finds them too."""
    grids = PairGrids(record.grids)
    own   = rectifier.pair.grids
    return _Loaded(record, own if own is not None and own.crc == grids.crc else grids, list(files))


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
