#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What each master of the main memory has of its time, from the counts of `sim/socs/memory_monitor.py`."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from ..system.build import build_soc
from ..system.simulation import SYS_CLK_HZ

#: Words of a row of memory2file: the time in ps, and a count per event.
_ROW_WORDS = 33

#: Shares of the clocks by name, 0 to 1.
Shares = dict[str, float]


def read_shares(path: Path, ram: str, begin_s: float, end_s: float) -> Shares:
    """Return the share of each event in the clocks of the system between two times of the simulation.

    Parameters
    ----------
    path
        File of memory2file.
    ram
        Main memory or board, as of `build_soc`.
    begin_s, end_s
        Seconds of simulated time.
    """
    names  = json.loads((build_soc(ram) / "memory.json").read_text())
    data   = np.fromfile(path, np.uint64)
    rows   = data[:len(data)//_ROW_WORDS*_ROW_WORDS].reshape(-1, _ROW_WORDS)
    times  = rows[:, 0].astype(np.float64)*1e-12
    first, last = np.searchsorted(times, [begin_s, end_s])
    last   = min(last, len(rows) - 1)
    clocks = (times[last] - times[first])*SYS_CLK_HZ
    counts = (rows[last, 1:] - rows[first, 1:]).astype(np.float64)
    return {name: float(count/clocks) for name, count in zip(names, counts, strict=False)}
