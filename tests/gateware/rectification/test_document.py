#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The numbers of docs/rectification.md."""

from __future__ import annotations

import re

from litestereo.gateware.rectification.parameters import GRIDS, NODE_BITS, RectifierParameters
from support.paths import CHECKOUT

#: Words of an ECP5's block RAM, with 8 and with up to 36 bits.
PIXELS, NODES = 2048, 512


def blocks(words, depth):
    """Return the block RAMs of a memory."""
    return -(-words//depth)


def test_block_rams():
    """The table of the page, and its sum, follow from the sizes of the memories."""
    page  = (CHECKOUT / "docs" / "rectification.md").read_text()
    rows  = [int(number) for number in re.findall(r"(\d+) rows \|", page)]
    table = {int(width): [int(cell) for cell in cells.split("|")]
             for width, cells in re.findall(r"(?m)^\| (\d+) \| ([\d |]+) \|$", page)}
    assert rows == [24, 32, 48, 64, 96] and [*table] == [320, 640, 752]
    for width, cells in table.items():
        assert cells == [4*blocks(RectifierParameters(width, 480, count).bank_words, PIXELS) for count in rows]
    built = RectifierParameters()
    grids = blocks(GRIDS*built.nodes, NODES)
    assert 2*NODE_BITS <= 36 and f"{grids} block RAMs (512 x 36) per camera" in page
    ring  = table[built.max_width][rows.index(built.rows)]
    assert f"2 x ({ring} + {grids}) = {2*(ring + grids)} block RAMs" in page
