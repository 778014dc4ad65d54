#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Grids and maps of all kinds, and a rectifier in Verilator that gets grids and frames."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from litex.gen import LiteXModule
from migen import Signal
from numpy.typing import NDArray

from litestereo.gateware.rectification.parameters import RectifierParameters
from litestereo.gateware.rectification.rectifier import Rectifier
from litestereo.sim.cores.stream_core import RunResult, StreamCore
from litestereo.sim.models import rectification as model

from .lanes import pack

Image = NDArray[np.uint8]
Grid  = NDArray[np.int16]
Pair  = tuple[Image, Image]


def opencv_remap(image: Image, positions: model.Map) -> Image:
    """Return `cv2.remap` of a map in 32nds of a pixel, as OpenCV stores it."""
    u, v  = positions
    whole = np.dstack([u >> 5, v >> 5]).astype(np.int16)
    return np.asarray(cv2.remap(image, whole, ((v & 31)*32 + (u & 31)).astype(np.uint16), cv2.INTER_LINEAR), np.uint8)


# Grids --------------------------------------------------------------------------------------------


def places(width: int, height: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return column and row of the nodes, from the centre of the image."""
    rows, columns = model.grid_shape(width, height)
    row, column   = np.mgrid[:rows, :columns]*model.STEP
    return column - (width - 1)/2, row - (height - 1)/2


def as_grid(columns: NDArray, rows: NDArray) -> Grid:
    """Return the grid of displacements in pixels."""
    nodes = np.rint(np.stack(np.broadcast_arrays(columns, rows), axis=-1)*model.NODE_ONE)
    return np.clip(nodes, -2**15, 2**15 - 1).astype(np.int16)


def shifted(width: int, height: int, columns: float, rows: float) -> Grid:
    """Return a grid that shifts an image."""
    x, _ = places(width, height)
    return as_grid(np.full_like(x, columns), np.full_like(x, rows))


def lens(width: int, height: int, rng: np.random.Generator, degrees: float = 3.0, barrel: float = 0.06) -> Grid:
    """Return the grid of a distorting, turned, shifted camera: like those of small rigs."""
    x, y   = places(width, height)
    radius = (x*x + y*y)/(width*width/4)
    angle  = np.deg2rad(rng.uniform(-degrees, degrees))
    scale  = rng.uniform(0.9, 1.02) - rng.uniform(0, barrel)*radius
    moved  = rng.uniform(-2, 2, 2)
    return as_grid((scale*np.cos(angle) - 1)*x - np.sin(angle)*y + moved[0],
                   np.sin(angle)*x + (scale*np.cos(angle) - 1)*y + moved[1])


def noise(width: int, height: int, rng: np.random.Generator, columns: float = 3, rows: float = 3) -> Grid:
    """Return a grid of drawn nodes, up to so many pixels off."""
    x, _ = places(width, height)
    return as_grid(rng.uniform(-columns, columns, x.shape), rng.uniform(-rows, rows, x.shape))


def drawn_grids(width: int, height: int, rng: np.random.Generator) -> tuple[Grid, Grid]:
    """Return the grids of both cameras, of any kind."""
    kind = rng.integers(4)
    if kind == 0:
        return lens(width, height, rng), lens(width, height, rng)
    if kind == 1:
        return noise(width, height, rng), noise(width, height, rng)
    if kind == 2:
        return noise(width, height, rng, 200, 5), lens(width, height, rng)
    x, y = rng.uniform(-6, 6, 2)
    return shifted(width, height, x, y), shifted(width, height, y, x)


def maps_of(grids: Sequence[Grid], width: int, height: int) -> list[model.Map]:
    """Return the map of each grid."""
    return [model.expand(grid, width, height) for grid in grids]


def load_words(endpoint, number: int, grids: Sequence[Grid]) -> NDArray[np.uint32]:
    """Return the items that load the grids of both cameras as grid `number`."""
    nodes = [grid.reshape(-1, 2).astype(np.int64) & 0xffff for grid in grids]
    count = len(nodes[0])
    return pack(endpoint, {"camera": np.repeat([0, 1], count), "grid": np.full(2*count, number),
                           "node": np.tile(np.arange(count), 2), "column": np.concatenate(nodes)[:, 0],
                           "row": np.concatenate(nodes)[:, 1]})


# Rectifier ----------------------------------------------------------------------------------------


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


def check_pair(got: Pair, raw: Pair, maps: Sequence[model.Map]) -> None:
    """Assert that a rectified pair is that of the model and of OpenCV, on every pixel."""
    for side, image, raw_image, positions in zip(("left", "right"), got, raw, maps, strict=True):
        expected = model.remap(raw_image, positions)
        assert np.array_equal(expected, opencv_remap(raw_image, positions))
        wrong = np.argwhere(image != expected)
        assert len(wrong) == 0, f"{side}: {len(wrong)} pixels differ, the first at {wrong[0].tolist()}"


def drawn_pair(width: int, height: int, rng: np.random.Generator) -> Pair:
    """Return two images of noise with extreme values."""
    left, right = (rng.choice([0, 255, *range(256)], (height, width)).astype(np.uint8) for _ in range(2))
    return left, right
