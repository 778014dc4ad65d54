#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""`litestereo calibrate`: calibrates a pair of cameras from images of a board."""

from __future__ import annotations

import argparse
import dataclasses
import json
import sys
from collections import Counter
from pathlib import Path
from typing import Any

import rich.console
import rich.table

from ..cameras.board import KINDS, make_board
from ..cameras.calibrate import MAX_ERROR_PX, MODELS, Calibration, calibrate
from ..cameras.camera_info import pair_geometry
from ..cameras.find import BadPair, BoardPair, find_board
from ..cameras.kinds import CALIBRATED_CAMERA
from ..cameras.rectify import FILES, geometry_text, write_calibration
from ..core.errors import GeometryError, ImageError
from ..core.images import read_grey, summed_notices
from ..core.outputs import Outputs
from ..data.sources.pairing import PairFiles, pair_files, pair_files_of_one
from .arguments import Parser, add_force, add_json, fraction, positive
from .grids import grid_lines, grid_summary
from .progress import terminal_bars

#: Width of the table in characters if stdout is not a terminal.
_TABLE_WIDTH = 110

_EPILOG = """\
examples:
  litestereo calibrate left/ right/ --pattern chessboard 9x6 --square 0.025 -o calibration/
  litestereo calibrate calibrationdata/ --pattern chessboard 9x6 --square 0.025 -o calibration/
  litestereo calibrate left/ right/ --pattern charuco 8x6 --square 0.03 --marker 0.0225 --dictionary 5X5_100 -o cal/

The files of a pair have the same name, except for left and right: left/07.png and right/07.png, or left/left07.png and
right/right07.png. left and right are whole words of a name, as are l and r, cam0 and cam1, image_0 and image_1; hidden
files are not read. Both sides may be in one folder, with left and right in their names: then give this folder only.

Ten to thirty pairs are good, with the board near and far, tilted, and in all corners of both images.

files written:
  left.yaml, right.yaml  the cameras as ROS's camera_info; lengths in metres

The grid is the map of rectification as a device holds it: its largest and its root mean square error are in pixels. A
device must hold so many rows of both images at once, and the first rectified row leaves after the delay.

Pairs without the board are listed and not used, nor are pairs whose reprojection error is above half a pixel and above
three times the median. Nothing is written if the pairs do not determine the cameras, or if the error of all of them
together is above --max-error.
"""


def add_parser(commands: argparse._SubParsersAction[Parser]) -> None:
    """Add the command."""
    parser = commands.add_parser("calibrate", help="calibrate a pair of cameras", epilog=_EPILOG,
                                 description="Calibrate a pair of cameras from images of a board.")
    parser.add_argument("left", metavar="LEFT_DIR", type=Path,
                        help="folder of the left camera's images, or of both cameras'")
    parser.add_argument("right", metavar="RIGHT_DIR", type=Path, nargs="?",
                        help="folder of the right camera's images (default: the same folder)")
    parser.add_argument("-o", "--output", metavar="DIR", type=Path, required=True,
                        help="folder for left.yaml and right.yaml, created if needed")
    parser.add_argument("--pattern", metavar=("KIND", "NxM"), nargs=2, required=True,
                        help=f"the board: {' or '.join(KINDS)}, and its size: inner corners of a chessboard, squares "
                             "of a ChArUco board")
    parser.add_argument("--square", metavar="M", type=positive, required=True, help="side of a square in metres")
    parser.add_argument("--marker", metavar="M", type=positive,
                        help="side of a ChArUco board's markers in metres (default: 0.75 of a square)")
    parser.add_argument("--dictionary", metavar="NAME", default="4X4_50",
                        help="markers of a ChArUco board, as OpenCV names them (default: %(default)s)")
    parser.add_argument("--legacy", action="store_true",
                        help="the ChArUco board is of calib.io or of OpenCV before 4.6: its first square has a marker, "
                             "also if the number of rows is even")
    parser.add_argument("--model", choices=list(MODELS), default="plumb_bob",
                        help="distortion of the lenses: 5 or 8 coefficients (default: %(default)s)")
    parser.add_argument("--alpha", metavar="A", type=fraction, default=0.0,
                        help="0: rectified images have no black border; 1: they keep all that the lenses see, with a "
                             "black border (default: %(default)g)")
    parser.add_argument("--keep-all", action="store_true",
                        help="keep pairs that fit much worse than the others (default: do not use them)")
    parser.add_argument("--max-error", metavar="PIXELS", type=positive, default=MAX_ERROR_PX,
                        help="largest reprojection error of all pairs together (default: %(default)g)")
    add_json(parser)
    add_force(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Run the command."""
    kind, size = options.pattern
    board      = make_board(kind, size, options.square, options.marker, options.dictionary,
                            options.legacy)
    files      = _pairs(options.left, options.right)
    if options.output.exists() and not options.output.is_dir():
        raise ImageError(f"{options.output}: is a file, the cameras need a folder")
    outputs = Outputs([path for one in files for path in (one.left, one.right)], options.force)
    written = [outputs.add(options.output/name, CALIBRATED_CAMERA) for name in FILES]

    images  = {}
    found   = list[BoardPair | BadPair]()
    notices = list[str]()
    with terminal_bars() as bars:
        for one in bars.track(files, description="find the board"):
            (left, left_notices), (right, right_notices) = read_grey(one.left), read_grey(one.right)
            # Photos of a board are in colour; that says nothing about the cameras.
            notices         += [notice for notice in left_notices + right_notices if "converted" not in notice]
            images[one.name] = left.shape
            found.append(find_board(one.name, left, right, board))
        for notice in summed_notices(notices):
            print(f"litestereo: note: {notice}", file=sys.stderr)
        good, bad     = _sorted(found, images)
        height, width = images[good[0].name] if good else (0, 0)
        if not good:
            raise GeometryError(f"the pattern is in none of the {len(files)} pairs ({bad[0].name}: {bad[0].reason}): "
                                f"{board.hint}")
        bars.add_task(f"calibrate with {len(good)} pairs", total=None)
        result = calibrate(good, width, height, options.model, options.alpha, options.keep_all,
                           options.max_error)

    result  = dataclasses.replace(result, bad=(*bad, *result.bad))
    write_calibration(options.output, (result.left, result.right))
    if options.json:
        print(json.dumps(_as_json(result, written), indent=2))
    else:
        _print(result, files, written)
    return 0


def _pairs(left: Path, right: Path | None) -> list[PairFiles]:
    """Return the pairs of two folders, or of one with both sides; raise ImageError if there are none."""
    files = pair_files_of_one(left)[0] if right is None else pair_files(left, right)
    for pair in files:
        if pair.left.samefile(pair.right):
            raise ImageError(f"{pair.left}: is the left and the right image of a pair: give two folders, or one whose "
                             "files have left and right in their names")
    return files


def _sorted(found: list[BoardPair | BadPair], shapes: dict[str, tuple[int, ...]]
            ) -> tuple[list[BoardPair], list[BadPair]]:
    """Return the pairs with the board, all of one size, and the others; `shapes` are those of the images, by name."""
    bad  = [pair for pair in found if isinstance(pair, BadPair)]
    good = [pair for pair in found if isinstance(pair, BoardPair)]
    if not good:
        return good, bad
    usual = Counter(shapes[pair.name] for pair in good).most_common(1)[0][0]
    bad  += [BadPair(pair.name, f"is {shapes[pair.name][1]}x{shapes[pair.name][0]} pixels, others are "
                                f"{usual[1]}x{usual[0]}") for pair in good if shapes[pair.name] != usual]
    return [pair for pair in good if shapes[pair.name] == usual], bad


def _as_json(result: Calibration, written: list[Path]) -> dict[str, Any]:
    return {
        **dataclasses.asdict(pair_geometry(result.left, result.right)),
        "reprojection_px": result.reprojection_px,
        "epipolar_px":     result.epipolar_px,
        "spread":          dataclasses.asdict(result.spread),
        "pairs":           [dataclasses.asdict(pair) for pair in result.pairs],
        "bad_pairs":       [dataclasses.asdict(pair) for pair in result.bad],
        **grid_summary(result.rectifier.pair),
        "files":           [str(path) for path in written],
    }


def _print(result: Calibration, files: list[PairFiles], written: list[Path]) -> None:
    """Print the result as text."""
    table = rich.table.Table(title="Errors in pixels")
    for name in ("pair", "corners", "left", "right", "epipolar"):
        table.add_column(name, justify="left" if name == "pair" else "right")
    for pair in result.pairs:
        table.add_row(pair.name, str(pair.corners), f"{pair.left_px:.3f}", f"{pair.right_px:.3f}",
                      f"{pair.epipolar_px:.3f}")
    rich.console.Console(width=None if sys.stdout.isatty() else _TABLE_WIDTH, highlight=False).print(table)
    print("\n".join([
        *(f"bad pair      {pair.name}: {pair.reason}" for pair in result.bad),
        f"pairs         {len(result.pairs)} used, {len(files)} in all",
        f"reprojection  {result.reprojection_px:.3f} pixels",
        f"epipolar      {result.epipolar_px:.3f} pixels",
        f"places        {result.spread}",
        f"focal length  within {result.spread.focal_error:.1%}",
        f"rectified     {geometry_text(pair_geometry(result.left, result.right))}",
        *grid_lines(result.rectifier.pair),
        *(f"wrote         {path}" for path in written),
    ]))
