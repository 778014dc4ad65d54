#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""`litestereo completion`: prints a script with which a shell completes the command's words."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any

import shtab

from .arguments import Parser

_EPILOG = """\
examples:
  litestereo completion bash >~/.local/share/bash-completion/completions/litestereo
  litestereo completion zsh  >~/.zfunc/_litestereo      # with fpath+=~/.zfunc before compinit
  litestereo completion fish >~/.config/fish/completions/litestereo.fish
  litestereo completion tcsh >~/.litestereo.completion  # and `source` it in ~/.cshrc
"""


def add_parser(commands: argparse._SubParsersAction[Parser], whole: Callable[[], Parser]) -> None:
    """Add the command; `whole` returns the parser of all commands."""
    parser = commands.add_parser("completion", help="print a completion script for a shell", epilog=_EPILOG,
                                 description="Print a script with which a shell completes commands, options and their "
                                             "values.")
    parser.add_argument("shell", choices=shtab.SUPPORTED_SHELLS, help="the shell")
    parser.set_defaults(run=lambda options: _run(options, whole()))


def _run(options: argparse.Namespace, parser: Parser) -> int:
    _name_files(parser)
    print(shtab.complete(parser, options.shell))
    return 0


def _name_files(parser: argparse.ArgumentParser) -> None:
    """Tell shtab which arguments of all commands are files and folders."""
    for action in parser._actions:
        known: Any = action
        if isinstance(action, argparse._SubParsersAction):
            for command in action.choices.values():
                _name_files(command)
        elif action.type is Path or action.dest == "source":
            known.complete = shtab.DIRECTORY if "DIR" in str(action.metavar) else shtab.FILE
