#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""A source file with one small fault, as a slip of its author could make it."""

from __future__ import annotations

import difflib
import random
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path

from support.paths import CHECKOUT


@dataclass(frozen=True)
class Mutant:
    """A source file with one fault."""
    file:   str  #: from the checkout on
    line:   int  #: line of the fault
    kind:   str  #: kind of the fault
    before: str
    after:  str
    code:   str  #: first source line of the fault, unchanged
    source: str  #: the whole file, with the fault
    place:  tuple[int, int] #: of the fault in the unchanged file: first character, and the one after the last

    @property
    def name(self) -> str:
        """Return place and kind of the fault, in a line."""
        return f"{self.file}:{self.line} {self.kind}: {self.before} -> {self.after}"

    def replaced(self, text: str) -> str:
        """Return the unchanged file with a text in the place of the fault."""
        sound = (CHECKOUT / self.file).read_text()
        return sound[:self.place[0]] + text + sound[self.place[1]:]

    @property
    def diff(self) -> str:
        """Return the lines that differ from those of the checkout, without context."""
        old   = (CHECKOUT / self.file).read_text().splitlines()
        lines = difflib.unified_diff(old, self.source.splitlines(), self.file, self.file, n=0, lineterm="")
        return "\n".join(f"    {line}" for line in list(lines)[2:])


#: Returns all mutants of a file of the checkout, in the order of its source.
Faults = Callable[[str], "list[Mutant]"]


class Splicer:
    """Make mutants of one file.

    Parameters
    ----------
    file
        Name of the file, from the checkout on.
    """

    def __init__(self, file: str) -> None:
        self.file   = file
        self.source = (CHECKOUT / file).read_text()
        self.lines  = self.source.splitlines(keepends=True)

    def mutant(self, kind: str, begin: int, end: int, after: str, grouped: bool = False) -> Mutant:
        """Return the file with the characters from `begin` to `end` replaced by `after`.

        `grouped` puts parentheses around it, which keep the precedence of what is before and after.
        """
        line   = self.source.count("\n", 0, begin) + 1
        before = " ".join(self.source[begin:end].split())
        return Mutant(self.file, line, kind, before, " ".join(after.split()), self.lines[line - 1].strip(),
                      self.source[:begin] + (f"({after})" if grouped else after) + self.source[end:],
                      (begin, end))

    def offset(self, line: int, column: int) -> int:
        """Return the place of a syntax tree's position: line from 1, column in bytes."""
        above = sum(map(len, self.lines[:line - 1]))
        return above + len(self.lines[line - 1].encode()[:column].decode())


def shuffled(faults: Faults, files: Sequence[str], seed: int) -> Iterator[Mutant]:
    """Yield the mutants of these files in random order, of each file one per round; the seed decides."""
    # A seed per file: a change of one file does not change what is drawn of the others.
    pools = []
    for file in sorted(files):
        pool = faults(file)
        random.Random(f"{seed} {file}").shuffle(pool)
        pools.append(pool)
    random.Random(seed).shuffle(pools)
    for mutants in zip_longest(*pools):
        yield from filter(None, mutants)


def files_below(folder: str, *suffixes: str) -> list[str]:
    """Return the names, from the checkout on, of the files with these suffixes in a folder."""
    found = [path for suffix in suffixes for path in (CHECKOUT / Path(folder)).rglob(f"*{suffix}")]
    return sorted(path.relative_to(CHECKOUT).as_posix() for path in found)
