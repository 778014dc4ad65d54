#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The rows that the firmware counts for a calibration, and the folds that it finds, against NumPy."""

from __future__ import annotations

import struct
import subprocess
import zlib

import numpy as np

from litestereo.gateware.peripherals.rectification import LEAD
from litestereo.sim.models import rectification as model
from support.pairs import generator
from support.rectification_maps import as_grid, drawn_grids, lens, maps_of, noise

HEADER = 848


def record_of(grids, width, height):
    """Return the record of a calibration: what a device does not read is 0."""
    nodes  = b"".join(grid.astype("<i2").tobytes() for grid in grids)
    length = HEADER + len(nodes) + 4
    header = struct.pack("<4sHHIHHHHHHI", b"LSCA", 1, HEADER, length, width, height, model.STEP, 0, 0, 0,
                         zlib.crc32(nodes)).ljust(HEADER, b"\0")
    return header + nodes + struct.pack("<I", zlib.crc32(header + nodes))


def folds(grid):
    """Return whether a node is not to the right of its left neighbour, or not below its upper one."""
    nodes = grid.astype(int)
    least = min(np.diff(nodes[..., 0], axis=1).min(), np.diff(nodes[..., 1], axis=0).min())
    return least <= -model.STEP*model.NODE_ONE


def test_rows_and_folds(programs):
    """Drawn maps of all kinds and sizes, and extreme nodes."""
    rng   = generator(95)
    cases = []
    for number in range(60):
        width, height = int(rng.integers(2, 150)), int(rng.integers(2, 90))
        kind  = number % 4
        grids = (drawn_grids(width, height, rng) if kind < 2 else
                 (lens(width, height, rng, 8, 0.2), lens(width, height, rng, 8, 0.2)) if kind == 2 else
                 (noise(width, height, rng, 250, 250), noise(width, height, rng, 9, 40)))
        cases.append((width, height, grids))
    ends = as_grid(np.full((3, 5), 256.0), np.full((3, 5), -256.0))
    cases.append((50, 30, (ends, -1 - ends)))
    text = b"".join(b"%d\n" % len(record) + record for record in (record_of(grids, width, height)
                                                                  for width, height, grids in cases))
    done = subprocess.run([programs / "count_rows"], input=text, capture_output=True, check=True)
    found = [tuple(map(int, line.split())) for line in done.stdout.splitlines()]
    assert found == [(model.rows_needed(maps_of(grids, width, height), LEAD), int(any(map(folds, grids))))
                     for width, height, grids in cases]
    assert {fold for _, fold in found} == {0, 1} and len({rows for rows, _ in found}) > 10
