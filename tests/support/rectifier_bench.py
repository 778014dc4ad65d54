#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""A rectifier in Verilator that gets grids and frames."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from litex.gen import LiteXModule
from migen import Signal
from numpy.typing import NDArray

from litestereo.gateware.rectification.parameters import RectifierParameters
from litestereo.gateware.rectification.rectifier import Rectifier
from litestereo.sim.cores.stream_core import RunResult, StreamCore

from .lanes import pack
from .rectification_maps import Grid, Pair


def load_words(endpoint, number: int, grids: Sequence[Grid]) -> NDArray[np.uint32]:
    """Return the items that load the grids of both cameras as grid `number`."""
    nodes = [grid.reshape(-1, 2).astype(np.int64) & 0xffff for grid in grids]
    count = len(nodes[0])
    return pack(endpoint, {"camera": np.repeat([0, 1], count), "grid": np.full(2*count, number),
                           "node": np.tile(np.arange(count), 2), "column": np.concatenate(nodes)[:, 0],
                           "row": np.concatenate(nodes)[:, 1]})


class RectifierTop(LiteXModule):
    """The rectifier, with the fields of its loader as Signals."""

    def __init__(self, parameters: RectifierParameters) -> None:
        self.rectifier = core = Rectifier(parameters)
        self.sink      = core.sink
        self.source    = core.source
        for name in ("width", "height", "lead", "grid", "bypass", "busy", "row_gone", "folded", "refused"):
            setattr(self, name, getattr(core, name))
        self.load      = Signal()
        self.comb     += core.load.valid.eq(self.load)
        for name, bits in core.load.description.payload_layout:
            signal = Signal(bits, name=f"load_{name}")
            setattr(self, f"load_{name}", signal)
            self.comb += getattr(core.load, name).eq(signal)


SETTINGS = ["width", "height", "lead", "grid", "bypass", "load", "load_camera", "load_grid", "load_node", "load_column",
            "load_row"]


@dataclass(frozen=True)
class Flow:
    """Chance, per clock, of a pair at the sink and of room at the source."""
    valid: float = 1.0
    ready: float = 1.0


#: Neither source nor sink ever waits.
EVEN = Flow()


class RectifierBench:
    """A rectifier in Verilator."""

    def __init__(self, parameters: RectifierParameters) -> None:
        self.parameters = parameters
        self.core = StreamCore(RectifierTop(parameters), SETTINGS, status=["busy", "row_gone", "folded", "refused"])

    def idle(self, clocks: int) -> None:
        """Let clocks pass without a transfer."""
        self.core.run(np.zeros(0, np.uint32), 1, ready=0, idle_clocks=clocks)

    def load(self, number: int, grids: Sequence[Grid]) -> int:
        """Write the grids of both cameras; return how many nodes were refused."""
        refused = 0
        for camera, grid in enumerate(grids):
            for node, (column, row) in enumerate(grid.reshape(-1, 2).astype(np.int64)):
                self.core.set(load=1, load_camera=camera, load_grid=number, load_node=node,
                              load_column=int(column) & 0xffff, load_row=int(row) & 0xffff)
                refused += self.core.get("refused")
                self.idle(1)
        self.core.set(load=0)
        return refused

    def set(self, width: int, height: int, lead: int, grid: int = 0, bypass: int = 0) -> None:
        """Drive the settings."""
        self.core.set(width=width, height=height, lead=lead, grid=grid, bypass=bypass)

    def run(self, pairs: Sequence[Pair], outputs: int, flow: Flow = EVEN, seed: int = 1, reset_clock: int = 0,
            skipped: int = 0) -> RunResult:
        """Feed the pixels of pairs, but for the first `skipped` of them, and capture pixels."""
        words = np.concatenate([pixel_words(pair) for pair in pairs])[skipped:]
        return self.core.run(words, outputs, valid=flow.valid, ready=flow.ready, seed=seed, reset_clock=reset_clock,
                             idle_clocks=3000)


def pixel_words(pair: Pair) -> NDArray[np.uint32]:
    """Return the words of the pixel pairs of two images."""
    return pair[0].ravel().astype(np.uint32) | pair[1].ravel().astype(np.uint32) << 8


def images_of(words: NDArray[np.uint32], width: int, height: int) -> list[Pair]:
    """Return the pairs of images of captured words."""
    pixels = words.ravel()[:len(words)//(width*height)*width*height].reshape(-1, height, width)
    return [((frame & 255).astype(np.uint8), (frame >> 8).astype(np.uint8)) for frame in pixels]
