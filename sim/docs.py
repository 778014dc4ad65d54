#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Pages that a command writes: which of them are of this tree, and the commands that make the stale ones anew.

    python -m litestereo.sim.docs check     # name the stale ones; status 1 if there are any
    python -m litestereo.sim.docs write     # run the targets of the stale ones, quick ones first
"""

from __future__ import annotations

import subprocess
import sys

from ..soc.build.pages import Page
from ..soc.build.paths import PACKAGE_DIR, code_key
from ..soc.build.tools import ToolError
from ..soc.release.sbom.__main__ import PAGE as LICENCES
from ..soc.reports import boards, network, registers, resources
from .accuracy import PAGE as ACCURACY
from .bench.readme import PAGE as BENCH
from .filters import PAGE as FILTERS
from .thesis.page import PAGE as THESIS

#: What the tests run.
TESTED = ("firmware", "gateware", "host_tools", "sim", "soc", "tests")


def coverage_key() -> str:
    """Return the content key of docs/coverage.md: all code, with its tests."""
    return code_key(*(PACKAGE_DIR / folder for folder in TESTED))


COVERAGE = Page("docs/coverage.md", "coverage", coverage_key, minutes=60)

#: Pages whose key is there in seconds: a test fails if one is stale.
CHEAP = (*registers.PAGES, LICENCES)

#: All pages.
PAGES = (*CHEAP, BENCH, network.PAGE, resources.PAGE, ACCURACY, FILTERS, THESIS, COVERAGE, boards.PAGE)


def stale(pages: tuple[Page, ...]) -> list[tuple[Page, str]]:
    """Return the stale ones of pages, each with what is wrong in a line."""
    found = []
    for page in pages:
        try:
            if (what := page.stale()) is not None:
                found.append((page, what))
        except ToolError as error:
            found.append((page, f"{page.name}: its key is not known: {error}"))
    return found


def main(arguments: list[str]) -> int:
    """Check the pages, or write the stale ones; return the exit status."""
    if arguments not in (["check"], ["write"]):
        print("docs: error: name one of check, write", file=sys.stderr)
        return 2
    found = stale(PAGES)
    for _, what in found:
        print(f"docs: {what}", file=sys.stderr)
    if arguments == ["check"]:
        print(f"{len(PAGES) - len(found)} of {len(PAGES)} pages are of this tree")
        return 1 if found else 0
    for target in dict.fromkeys(page.target for page, _ in sorted(found, key=lambda item: item[0].minutes)):
        print(f"docs: make {target}", file=sys.stderr, flush=True)
        if subprocess.run(["make", "-C", str(PACKAGE_DIR), target], check=False).returncode:
            print(f"docs: error: make {target} failed", file=sys.stderr)
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
