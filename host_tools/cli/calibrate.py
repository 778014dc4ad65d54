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
import rich.progress
import rich.table

from ..cameras.board import KINDS, make_board
from ..cameras.calibrate import MODELS, Calibration, calibrate
from ..cameras.camera_info import pair_geometry, write_camera_info
from ..cameras.find import BadPair, BoardPair, find_board
from ..cameras.rectify import FILES, geometry_text
from ..core.errors import GeometryError, ImageError
from ..core.images import read_grey, summed_notices
from ..data.sources.files import PairFiles, pair_files
from .arguments import Parser, add_json, fraction, positive

#: Width of the table in characters if stdout is not a terminal.
_TABLE_WIDTH = 110

_EPILOG = """\
examples:
  litestereo calibrate left/ right/ --pattern chessboard 9x6 --square 0.025 -o calibration/
  litestereo calibrate left/ right/ --pattern charuco 8x6 --square 0.03 --marker 0.0225 --dictionary 5X5_100 -o cal/

The files of a pair have the same name, except for left and right: left/07.png and right/07.png, or left/left07.png and
right/right07.png. Ten to thirty pairs are good, with the board near and far, tilted, and in all corners of both images.

files written:
  left.yaml, right.yaml  the cameras as ROS's camera_info; lengths in metres

Pairs without the board are listed and not used, nor are pairs whose reprojection error is above half a pixel and above
three times the median.
"""


def add_parser(commands: argparse._SubParsersAction[Parser]) -> None:
    """Add the command."""
    parser = commands.add_parser("calibrate", help="calibrate a pair of cameras", epilog=_EPILOG,
                                 description="Calibrate a pair of cameras from images of a board.")
    parser.add_argument("left", metavar="LEFT_DIR", type=Path, help="folder of the left camera's images")
    parser.add_argument("right", metavar="RIGHT_DIR", type=Path, help="folder of the right camera's images")
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
    parser.add_argument("--model", choices=list(MODELS), default="plumb_bob",
                        help="distortion of the lenses: 5 or 8 coefficients (default: %(default)s)")
    parser.add_argument("--alpha", metavar="A", type=fraction, default=0.0,
                        help="0: rectified images have no black border; 1: they keep all that the lenses see, with a "
                             "black border (default: %(default)g)")
    parser.add_argument("--keep-all", action="store_true",
                        help="keep pairs that fit much worse than the others (default: do not use them)")
    add_json(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Run the command."""
    kind, size = options.pattern
    board      = make_board(kind, size, options.square, options.marker, options.dictionary)
    files      = pair_files(options.left, options.right)
    if options.output.exists() and not options.output.is_dir():
        raise ImageError(f"{options.output}: is a file, the cameras need a folder")

    images   = {}
    terminal = rich.console.Console(stderr=True)
    found    = list[BoardPair | BadPair]()
    notices  = list[str]()
    with rich.progress.Progress(console=terminal, transient=True, disable=not terminal.is_terminal) as bars:
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
        result = calibrate(good, width, height, options.model, options.alpha, options.keep_all)

    result  = dataclasses.replace(result, bad=(*bad, *result.bad))
    written = [options.output/name for name in FILES]
    for path, camera in zip(written, (result.left, result.right), strict=True):
        write_camera_info(path, camera)
    if options.json:
        print(json.dumps(_as_json(result, written), indent=2))
    else:
        _print(result, files, written)
    return 0


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
        "pairs":           [dataclasses.asdict(pair) for pair in result.pairs],
        "bad_pairs":       [dataclasses.asdict(pair) for pair in result.bad],
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
        f"rectified     {geometry_text(pair_geometry(result.left, result.right))}",
        *(f"wrote         {path}" for path in written),
    ]))
