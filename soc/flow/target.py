#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The command for every board: `python -m litestereo.soc.flow.target colorlight_i5 --build --load --flash`."""

from __future__ import annotations

import argparse
import sys
from dataclasses import fields

from ...gateware.common.features   import FEATURES, PERIPHERAL_FEATURES
from ..boards                      import BOARDS, soc_class
from ..build.tools                 import ToolError
from .bitstream                    import build
from .loader                       import flash, load

def parser(board: str) -> argparse.ArgumentParser:
    """Return the parser for the options of a board's target."""
    preset  = soc_class(board).preset
    result  = argparse.ArgumentParser(prog=board, description=f"LiteStereo on {board}.",
        formatter_class=argparse.ArgumentDefaultsHelpFormatter)
    actions = result.add_argument_group("what to do")
    actions.add_argument("--build", action="store_true", help="Build the bitstream and the image of the firmware.")
    actions.add_argument("--load",  action="store_true", help="Load the bitstream; it is gone when the power is.")
    actions.add_argument("--flash", action="store_true", help="Write bitstream and firmware to the flash.")
    options = result.add_argument_group("preset")
    for one in fields(preset):
        default = getattr(preset, one.name)
        how     = {"type": type(default)}
        if one.name == "features":
            how = {"nargs": "+", "choices": (*FEATURES, *PERIPHERAL_FEATURES), "metavar": "FEATURE"}
        elif isinstance(default, bool):
            how = {"action": argparse.BooleanOptionalAction}
        options.add_argument(f"--{one.name.replace('_', '-')}", default=default, help=one.metadata["help"], **how)
    return result

def main(board: str, arguments: list[str] | None = None) -> int:
    """Execute the command line; return the exit status."""
    chosen = parser(board)
    args   = chosen.parse_args(arguments)
    if not (args.build or args.load or args.flash):
        chosen.print_help()
        return 0
    changes = {one.name: getattr(args, one.name) for one in fields(soc_class(board).preset)}
    changes = {name: value for name, value in changes.items() if value != getattr(soc_class(board).preset, name)}
    try:
        if args.build:
            build(board, changes)
        if args.load:
            load(board)
        if args.flash:
            flash(board)
    except (ToolError, ValueError) as error:
        print(f"{board}: error: {error}", file=sys.stderr)
        return 1
    return 0

def command(arguments: list[str]) -> int:
    """Execute the command line: a board, and actions for it. Return the exit status."""
    board, *options = arguments or [""]
    if board not in BOARDS:
        print(f"target: error: there is no board {board!r}: name one of {', '.join(BOARDS)}", file=sys.stderr)
        return 2
    return main(board, options)

if __name__ == "__main__":
    sys.exit(command(sys.argv[1:]))
