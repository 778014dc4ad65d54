#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Pages that a command writes: each carries the content key of its sources."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from .paths import PACKAGE_DIR, build_directory, built_once, code_key, content_key

#: Releases of synthesis, place and route.
FPGA_LOCK = PACKAGE_DIR / ".ci" / "lock" / "fpga.txt"

MARK = re.compile(r"^<!-- made from ([0-9a-f]{16}) by make ([\w-]+) -->\n", re.MULTILINE)


def computed_key(name: str, sources: list[Path], parts: Callable[[], list[str]]) -> str:
    """Return the content key of parts that take a while to make; they are made once for each state of their sources.

    Parameters
    ----------
    name
        Name of the page, for the folder.
    sources
        Files and folders from which the parts are made.
    parts
        Function that returns the parts.
    """
    def make(folder: Path) -> None:
        (folder / "key").write_text(content_key(parts()))

    return (built_once(build_directory() / "keys" / f"{name}-{code_key(*sources)}", make) / "key").read_text()


@dataclass(frozen=True)
class Page:
    """A page that a command writes, or a part of one.

    Parameters
    ----------
    name
        Path, relative to the checkout.
    target
        Target of the Makefile that writes it.
    key
        Returns the content key of the page's current sources.
    minutes
        Approximate minutes that the target takes on two cores; 0 for less than one.
    """

    name:    str
    target:  str
    key:     Callable[[], str]
    minutes: int = 0

    @property
    def path(self) -> Path:
        """Return the path of the file."""
        return PACKAGE_DIR / self.name

    def stamped(self, text: str) -> str:
        """Return the page's text with the mark as its last line, or in place of its previous mark.

        Raises
        ------
        ValueError
            The text has several marks of this target.
        """
        mark  = f"<!-- made from {self.key()} by make {self.target} -->\n"
        found = [one for one in MARK.finditer(text) if one[2] == self.target]
        if len(found) > 1:
            raise ValueError(f"{self.name} has {len(found)} marks of make {self.target}: leave one")
        if found:
            return text[:found[0].start()] + mark + text[found[0].end():]
        return text.rstrip("\n") + "\n\n" + mark

    def made_from(self) -> str | None:
        """Return the key that the page carries; None if there is no page, or no mark in it."""
        if not self.path.is_file():
            return None
        return next((one[1] for one in MARK.finditer(self.path.read_text()) if one[2] == self.target), None)

    def write(self, text: str) -> None:
        """Write the page with its mark."""
        self.path.write_text(self.stamped(text))

    def stale(self) -> str | None:
        """Return a line that says what is wrong, or None if the page is current."""
        now, made_from = self.key(), self.made_from()
        if made_from == now:
            return None
        took = f", about {self.minutes} minutes" if self.minutes else ""
        state = (f"is made from {made_from}, the tree has {now}" if made_from
            else "says nothing of what it was made from")
        return f"{self.name} {state}: run make {self.target}{took}"
