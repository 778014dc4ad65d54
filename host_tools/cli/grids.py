#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What commands say of the grids of a calibration: their error, the rows they need, the boards with room for them."""

from __future__ import annotations

from typing import Any

from ..cameras.builds import boards_with_room
from ..cameras.pair_grids import FittedGrids, PairGrids
from ..cameras.rectify import PairMaps


def grid_summary(pair: PairMaps) -> dict[str, Any]:
    """Return what JSON says of the grids of a calibration."""
    return {"grid": None if pair.grids is None else grid_values(pair.grids), "no_grid": pair.no_grids or None}


def grid_values(grids: PairGrids) -> dict[str, Any]:
    """Return what JSON says of grids; of those of a device the error is not known."""
    error = grids.error if isinstance(grids, FittedGrids) else None
    return {
        "crc":        f"{grids.crc:08x}",
        "max_px":     None if error is None else error.max_px,
        "rms_px":     None if error is None else error.rms_px,
        "rows":       grids.rows,
        "delay_rows": grids.delay_rows,
        "boards":     boards_with_room(grids),
    }


def grid_lines(pair: PairMaps) -> list[str]:
    """Return what is said to people of the grids of a calibration, a line each."""
    if pair.grids is None:
        return [f"grid          none, devices cannot rectify: {pair.no_grids}"]
    return lines_of_grids(pair.grids)


def lines_of_grids(grids: PairGrids) -> list[str]:
    """Return what is said to people of grids, a line each."""
    values = grid_values(grids)
    error  = ("" if values["max_px"] is None else
              f", error {values['max_px']:.3f} pixels at most, {values['rms_px']:.3f} rms")
    return [
        f"grid          {values['crc']}{error}",
        f"rows          {values['rows']} at once, delay {values['delay_rows']} rows",
        f"boards        none has a rectifier yet; block RAM to spare for it: {', '.join(values['boards']) or 'none'}",
    ]
