#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""A matcher with the rectification before it, as a core to run in Verilator, and the words that load its grids."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from litex.gen import LiteXModule
from litex.soc.interconnect import stream
from migen import Cat, If, Signal
from numpy.typing import NDArray

from ...gateware.common.layouts import disparity_layout
from ...gateware.common.parameters import MatcherParameters
from ...gateware.matcher.matcher import Matcher, matcher_settings
from ...gateware.peripherals.rectification import LEAD, rectifier_parameters
from ...gateware.rectification.rectifier import Rectifier
from ..models import rectification as model

#: Signals that load the grids: a node per clock while `load` is set.
LOAD = ["load", "load_camera", "load_node", "load_column", "load_row"]


class RectifiedMatcher(LiteXModule):
    """Raw pairs in, the map of the rectified ones out; with `bypass` the map of the raw ones.

    With `images` the rectified pairs come out in place of the map, the left pixel in the low bits.
    """

    def __init__(self, parameters: MatcherParameters) -> None:
        self.rectifier = rectifier = Rectifier(rectifier_parameters(parameters))
        self.matcher   = matcher = Matcher(parameters)
        self.sink      = rectifier.sink
        self.source    = stream.Endpoint(disparity_layout())
        self.images    = Signal()
        self.row_gone  = rectifier.row_gone
        self.bypass    = rectifier.bypass
        self.reset     = Signal()
        self.comb     += [
            rectifier.reset.eq(self.reset),
            matcher.reset.eq(self.reset),
            If(self.images,
                rectifier.source.connect(self.source, omit={"left", "right"}),
                self.source.disparity.eq(Cat(rectifier.source.left, rectifier.source.right))
            ).Else(
                rectifier.source.connect(matcher.sink),
                matcher.source.connect(self.source)
            ),
            rectifier.lead.eq(LEAD),
            rectifier.width.eq(matcher.width),
            rectifier.height.eq(matcher.height),
        ]
        for name, *_ in matcher_settings(parameters):
            setattr(self, name, getattr(matcher, name))
        self.load  = Signal()
        self.comb += rectifier.load.valid.eq(self.load)
        for name, bits in rectifier.load.description.payload_layout:
            if f"load_{name}" in LOAD:
                signal = Signal(bits, name=f"load_{name}")
                setattr(self, f"load_{name}", signal)
                self.comb += getattr(rectifier.load, name).eq(signal)


def check_grids(parameters: MatcherParameters, grids: Sequence[NDArray[np.int16]], width: int, height: int) -> None:
    """Raise ValueError if a build cannot rectify frames of a size by the grids of the left and the right camera."""
    if "rectification" not in parameters.features:
        raise ValueError("this build has no rectification")
    shape = (*model.grid_shape(width, height), 2)
    if any(grid.shape != shape for grid in grids):
        raise ValueError(f"the grids are not those of frames of {width}x{height} pixels")
    if height > parameters.rectification_height:
        raise ValueError(f"this build rectifies frames of up to {parameters.rectification_height} rows, not {height}")
    if any(model.folded(grid, width, height).any() for grid in grids):
        raise ValueError("the map folds over")
    rows = model.rows_needed([model.expand(grid, width, height) for grid in grids], LEAD)
    if rows > parameters.rectification_rows:
        raise ValueError(f"the map needs {rows} rows of the images at once, this build keeps "
                         f"{parameters.rectification_rows}")
