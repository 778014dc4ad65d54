#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The page: its header, and the order of its sections."""

from __future__ import annotations

import shutil
from collections.abc import Iterable
from pathlib import Path

from ...soc.build.commit import commit
from ...soc.build.pages import Page
from ...soc.build.paths import content_key
from . import area, clocks, maps, overflow, serial, structure, windows
from .middlebury import CREDIT
from .presets import CITATION, OURS, PUBLISHED, THESIS, Scale
from .section import Section

SECTIONS: list[Section] = [*structure.SECTIONS, *area.SECTIONS, *clocks.SECTIONS, *serial.SECTIONS, *windows.SECTIONS,
                           *overflow.SECTIONS, *maps.SECTIONS]


def key() -> str:
    """Return the content key of the page: those of all measurements."""
    return content_key(section.key(Scale()) for section in SECTIONS)


PAGE = Page("docs/thesis.md", "thesis", key, minutes=60)

HEADER = """\
# A thesis and its counterpart

{citation}, matches stereo pairs on a small FPGA by sums of absolute differences. This page has a counterpart to
each of its tables and figures of results. `make thesis` measures them with this repository and writes the page;
commit {commit}.

- The two configurations of the thesis are presets of our matcher: {presets}; grey values, whole pixels. Our own
  configurations are next to them: {ours}.
- Of the thesis' own values this page has only those of its abstract, each marked `{published}`: {rates} frames per
  second at {width} x {height}, by simulation, and the {pixels} pixels that it processes at the same time. All
  other values are measured here, or follow from a definition, where the text says so.
- Ratios of times are from one measurement on one computer. Clocks of the full system and of its CPU vary a little
  from one measurement to the next; everything else is reproducible.
"""


def header(scale: Scale) -> str:
    """Return the beginning of the page."""
    def both(values: Iterable[object]) -> str:
        return " and ".join(f"{value} {PUBLISHED}" for value in values)

    return HEADER.format(citation=CITATION, commit=commit(), published=PUBLISHED,
                         width=scale.width, height=scale.height,
                         presets=" and ".join(preset.name for preset in THESIS),
                         ours="; ".join(preset.name for preset in OURS),
                         rates=both(preset.published_fps for preset in THESIS),
                         pixels=both(preset.published_pixels for preset in THESIS))


def write(sections: Iterable[tuple[Section, Path]], scale: Scale, document: Path) -> None:
    """Write the page from measured sections, with the credit, and copy their pictures to `images/thesis` beside it.

    Parameters
    ----------
    sections
        In the order of the page, each with the folder that its `measured` has returned.
    scale
        Scale of the measurements.
    document
        File to write.
    """
    pictures = document.parent / "images" / "thesis"
    pictures.mkdir(parents=True, exist_ok=True)
    parts = [header(scale)]
    for section, folder in sections:
        parts.append(section.markdown(folder))
        for picture in sorted(folder.glob("*.png")):
            shutil.copyfile(picture, pictures / picture.name)
    document.write_text(PAGE.stamped("\n".join([*parts, f"## Images\n\n{CREDIT}\n"])))
