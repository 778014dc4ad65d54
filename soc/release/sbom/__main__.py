#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Write docs/sbom.cdx.json and docs/licences.md: the components of bitstream, firmware and host tools."""

from __future__ import annotations

import json
import sys
import tomllib

from ...build.pages import Page
from ...build.paths import content_key
from .components import CHECKOUT, components
from .documents  import cyclonedx, table


def key() -> str:
    """Return the content key of both documents: the locked packages, and the project's requirements."""
    sources = [CHECKOUT / "pyproject.toml", *sorted((CHECKOUT / ".ci" / "lock").glob("*.txt"))]
    return content_key([path.read_bytes() for path in sources])


#: The bill is JSON, which has no comments: the other document carries the key of both.
PAGE = Page("docs/licences.md", "sbom", key)


def documents() -> dict[str, str]:
    """Return name and text of each document, from the installed packages.

    Raises
    ------
    ValueError
        A package is not installed as locked, or its licence is not known; the message says what to do.
    """
    project = tomllib.loads((CHECKOUT / "pyproject.toml").read_text())["project"]
    found   = components()
    python  = f"{sys.version_info.major}.{sys.version_info.minor}"
    bill    = cyclonedx(project["version"], project["license"], python, found)
    return {"sbom.cdx.json": json.dumps(bill, indent=2) + "\n",
            "licences.md":   PAGE.stamped(table(project["version"], project["license"], found))}


def main() -> int:
    """Write both; return the exit status."""
    if not (CHECKOUT / "pyproject.toml").is_file():
        print("sbom: error: this is not a checkout of LiteStereo: run make sbom in one", file=sys.stderr)
        return 1
    try:
        written = documents()
    except ValueError as error:
        print(f"sbom: error: {error}", file=sys.stderr)
        return 1
    for name, text in written.items():
        (CHECKOUT / "docs" / name).write_text(text)
        print(f"docs/{name}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
