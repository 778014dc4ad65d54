#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The emitted Verilog of the matcher, run on whole images."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...gateware.common.parameters import MatcherParameters
from ...gateware.matcher.matcher import Matcher, matcher_settings
from ..models.settings import Settings
from .rectified_matcher import LOAD, RectifiedMatcher, check_grids
from .stream_core import RunResult, StreamCore

__all__ = ["CosimMatcher", "MatcherParameters", "check_grids", "pixel_words", "signals"]


def pixel_words(left: NDArray[np.uint8], right: NDArray[np.uint8]) -> NDArray[np.uint32]:
    """Pack a pair of images (uint8, H x W) into words of the matcher's sink: uint32, H*W, right in bits 8 to 15."""
    return left.astype(np.uint32).ravel() | right.astype(np.uint32).ravel() << 8


def signals(width: int, height: int, settings: Settings) -> dict[str, int]:
    """Return the values of the matcher's Signals for the settings of a frame."""
    return {
        "width":             width,
        "height":            height,
        "disparities":       settings.disparities,
        "block_size":        settings.block_size,
        "min_disparity":     settings.min_disparity,
        "xsobel":            int(settings.prefilter == "xsobel"),
        "prefilter_cap":     settings.prefilter_cap,
        "texture_threshold": settings.texture_threshold,
        "uniqueness_ratio":  settings.uniqueness_ratio,
        "subpixel":          int(settings.subpixel),
        "left_right":        int(settings.disp12_max_diff >= 0),
        "disp12_max_diff":   max(settings.disp12_max_diff, 0),
        "median":            int(settings.median),
    }


class CosimMatcher:
    """`Matcher` in Verilator, in this process; with the feature "rectification" a `Rectifier` before it.

    Parameters
    ----------
    parameters
        What is built.
    trace
        File for a waveform, .vcd or .fst: see `VerilatedCore`.
    """
    def __init__(self, parameters: MatcherParameters, trace: Path | None = None) -> None:
        self.parameters = parameters
        self.rectifies  = "rectification" in parameters.features
        settings        = [name for name, *_ in matcher_settings(parameters)] + ["reset"]
        self._loaded: tuple[NDArray[np.int16], ...] = ()
        if self.rectifies:
            self.core = StreamCore(RectifiedMatcher(parameters), [*settings, "bypass", "images", *LOAD],
                                   status=["row_gone"], trace=trace)
        else:
            self.core = StreamCore(Matcher(parameters), settings, trace=trace)

    def load_grids(self, grids: Sequence[NDArray[np.int16]]) -> None:
        """Load the grids of the left and the right camera: int16, rows x columns x 2, in 128ths of a pixel."""
        idle = np.zeros((0, self.core.sink_words), np.uint32)
        for camera, grid in enumerate(grids):
            for node, (column, row) in enumerate(grid.reshape(-1, 2).astype(int).tolist()):
                self.core.set(load=1, load_camera=camera, load_node=node, load_column=column & 0xffff,
                              load_row=row & 0xffff)
                self.core.run(idle, 1, ready=0, idle_clocks=1)
        self.core.set(load=0)
        self._loaded = tuple(grids)

    def match_settings(self, left: NDArray[np.uint8], right: NDArray[np.uint8], settings: Settings, *,
                       valid: float = 1.0, ready: float = 1.0, seed: int = 0,
                       grids: Sequence[NDArray[np.int16]] | None = None) -> tuple[NDArray[np.int16], int, int]:
        """Match one pair.

        Parameters
        ----------
        left, right
            Rectified 8-bit grey images, H x W.
        settings
            Settings of the frame; those of stages that the matcher lacks are ignored.
        valid, ready
            Chance, per clock, that a pixel pair is offered and that the map's next pixel is taken.
        seed
            Seeds these chances.
        grids
            Grids of the left and the right camera, by which the pair is rectified first: see `load_grids`.

        Returns
        -------
        The map (int16, H x W, sixteenths of a pixel), the clocks from the first pixel in to the last one out, and
        the clocks to the end of the first row that has disparities.

        Raises
        ------
        RuntimeError
            The core stopped short of a whole map, or a row was gone.
        ValueError
            What is built cannot rectify by the grids, for example because they need more rows than it keeps.
        """
        height, width = left.shape
        if self.rectifies:
            self.core.set(bypass=int(grids is None), images=0)
        if grids is not None:
            self._choose_grids(grids, width, height)
        self.core.set(**signals(width, height, settings))
        result    = self._run(pixel_words(left, right), grids is not None, valid=valid, ready=ready, seed=seed,
                              probe=(settings.block_size//2 + 1)*width - 1)
        disparity = result.words.astype(np.uint16).view(np.int16).reshape(height, width)
        return disparity, result.clocks, result.probe_clock

    def rectify(self, left: NDArray[np.uint8], right: NDArray[np.uint8],
                grids: Sequence[NDArray[np.int16]]) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
        """Return a pair (uint8, H x W each) as the matcher gets it; see `match_settings`, and for what it raises."""
        height, width = left.shape
        self._choose_grids(grids, width, height)
        self.core.set(bypass=0, images=1, width=width, height=height)
        words = self._run(pixel_words(left, right), True).words.reshape(height, width)
        return (words & 0xff).astype(np.uint8), (words >> 8).astype(np.uint8)

    def _choose_grids(self, grids: Sequence[NDArray[np.int16]], width: int, height: int) -> None:
        """Load grids, unless they are loaded; raise ValueError if the build cannot rectify by them."""
        check_grids(self.parameters, grids, width, height)
        if len(self._loaded) != len(grids) or any(one is not other
                                                  for one, other in zip(self._loaded, grids, strict=True)):
            self.load_grids(grids)

    def _run(self, words: NDArray[np.uint32], rectified: bool, **flow: Any) -> RunResult:
        """Run a frame; raise RuntimeError if not all of it comes out, or a row was gone."""
        pixels = len(words)
        result = self.core.run(words, pixels, **flow)
        taken  = result.accepted
        if rectified and taken < pixels:
            # Raw rows below the last one that a pixel needed.
            taken += self.core.run(words[taken:], 1, idle_clocks=100).accepted
        if len(result.words) != pixels or taken != pixels:
            self.core.reset()
            raise RuntimeError(f"the matcher took {taken} and gave {len(result.words)} of {pixels} pixels")
        if rectified and self.core.get("row_gone"):
            raise RuntimeError("a row of the raw images was gone when a pixel needed it")
        expected = np.zeros(pixels, bool)
        expected[-1] = True
        if not np.array_equal(result.last, expected) or not np.array_equal(result.first, expected[::-1]):
            raise RuntimeError("the marks of the map's first and last pixel are wrong")
        return result

    def give_up(self) -> None:
        """Discard the frame, by the matcher's own reset, as the peripheral does between frames."""
        self.core.set(reset=1)
        self.core.run(np.zeros((0, self.core.sink_words), np.uint32), 1, idle_clocks=1)
        self.core.set(reset=0)

    def close(self) -> None:
        """Free the model."""
        self.core.close()
