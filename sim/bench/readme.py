#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The figures of `make bench` in README.md: two tables between marks."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from ...soc.build.pages import Page
from ...soc.build.paths import PACKAGE_DIR, code_key

#: What is measured, and what measures it.
MEASURED = ("firmware", "gateware", "host_tools", "soc/build", "soc/boards", "soc/parts", "sim/bench", "sim/cores",
            "sim/models", "sim/socs", "sim/system")


def key() -> str:
    """Return the content key of the figures."""
    return code_key(*(PACKAGE_DIR / folder for folder in MEASURED))


PAGE = Page("README.md", "bench", key, minutes=15)

BEGIN, END = "<!-- figures of make bench: begin -->", "<!-- figures of make bench: end -->"

#: Frames of the tables, as the figures' names have them.
FRAME = "640x480/d64/b9"

#: Main memory, stages, and the end of the figures' names, a row each.
MEMORY_ROWS = (
    ("integrated RAM, DMA port of 128 bits", "all, with left-right check and median", "all/integrated-ram"),
    ("", "only the sum of absolute differences", "sad/integrated-ram"),
    ("SDRAM, 32 bits at the system clock", "all", "all/sdram"),
)

#: Main memory, clocks of system and wire, frames, and the case of the figures, a row each.
ETHERNET_ROWS = (
    ("integrated RAM", "1 : 1", "stored", "integrated-ram"),
    ("SDRAM, 32 bits", "60 : 125 MHz", "stored", "sdram-at-60-mhz"),
    ("SDRAM, 32 bits", "60 : 125 MHz", "streamed", "sdram-at-60-mhz-streamed"),
)


def tables(rows: Sequence[Mapping[str, str | float]]) -> str:
    """Return both tables in Markdown, of the figures of a run: name, value and unit each.

    Raises
    ------
    KeyError
        A figure is missing.
    """
    values = {str(row["name"]): row["value"] for row in rows}

    def row(*cells: object) -> str:
        return f"| {' | '.join(map(str, cells))} |"

    lines = [row("main memory", "stages", "clocks per pixel", "clocks per frame"), "|---|---|---|---|"]
    for memory, stages, case in MEMORY_ROWS:
        lines.append(row(memory, stages, values[f"clocks_per_pixel/{FRAME}/{case}"],
                         values[f"clocks_per_frame/{FRAME}/{case}"]))
    lines += ["", "Over Ethernet, in clocks of the wire, while other frames are matched and downloaded:", "",
              row("main memory", "system clock : wire clock", "frames", "upload, bytes per clock",
                  "share of the wire's capacity", "frames per second at 125 MHz"), "|---|---|---|---|---|---|"]
    for memory, clocks, frames, case in ETHERNET_ROWS:
        lines.append(row(memory, clocks, frames, values[f"ethernet_upload_bytes_per_clock/640x480/{case}"],
                         f"{values[f'ethernet_upload_of_what_the_wire_carries/640x480/{case}']} %",
                         values[f"ethernet_frames_per_second_at_125_mhz/640x480/{case}"]))
    return "\n".join(lines)


def replaced(text: str, rows: Sequence[Mapping[str, str | float]]) -> str:
    """Return README's text with the figures of a run; raise ValueError if it has no marks."""
    pattern = re.compile(f"({re.escape(BEGIN)}\n).*({re.escape(END)})", re.DOTALL)
    if not pattern.search(text):
        raise ValueError(f"README.md has no lines {BEGIN} and {END}")
    return pattern.sub(lambda found: f"{found[1]}{tables(rows)}\n{found[2]}", text)


def write(rows: Sequence[Mapping[str, str | float]]) -> None:
    """Write the figures of a run into README.md, if this is a checkout."""
    if PAGE.path.is_file():
        PAGE.write(replaced(PAGE.path.read_text(), rows))
