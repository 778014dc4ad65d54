#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Presets of the matcher (the configurations of the thesis, and ours), and the scale of the measurements."""

from __future__ import annotations

from dataclasses import dataclass

from ...gateware.common.parameters import OPENCV_FEATURES, MatcherParameters
from ...host_tools.core.settings import MatcherSettings
from ..bench.clocks import NO_STAGE
from ..cores.cosim import CosimMatcher

#: The thesis.
CITATION = ("D. Citron: Stereo Vision System Module for Low-Cost FPGAs for Autonomous Mobile Robots. Master's thesis, "
            "California Polytechnic State University, San Luis Obispo, 2014")

#: Mark of a value that is from the thesis and not measured here.
PUBLISHED = "(published)"

#: Stages that are built for the sum of absolute differences of grey values alone.
BARE = ("raw",)


@dataclass(frozen=True)
class Preset:
    """A matcher to build.

    Parameters
    ----------
    disparities
        Lanes: a multiple of 16.
    block_size
        Side of the block in pixels, also the largest that is built.
    features
        Stages that are built: `BARE` or `OPENCV_FEATURES`.
    published_pixels, published_fps
        For a configuration of the thesis: pixels that it processes at once, and frames per second at 640 x 480 by its
        author's simulation; else None.
    """
    disparities:      int
    block_size:       int
    features:         tuple[str, ...] = BARE
    published_pixels: int | None      = None
    published_fps:    float | None    = None

    @property
    def name(self) -> str:
        """Name of the preset in the tables."""
        stages = "SAD" if self.features == BARE else "all stages"
        return f"{self.block_size}x{self.block_size}, {self.disparities} disparities, {stages}"

    def parameters(self, max_width: int) -> MatcherParameters:
        """Return the build-time parameters of the matcher, for frames of up to that many pixels a row."""
        return MatcherParameters(max_width, disparities=self.disparities, max_block_size=self.block_size,
                                 features=self.features)

    def settings(self) -> MatcherSettings:
        """Return settings of a frame that use all stages that are built."""
        if self.features == BARE:
            return MatcherSettings(self.disparities, self.block_size, prefilter=NO_STAGE.prefilter,
                                  texture_threshold=NO_STAGE.texture_threshold,
                                  uniqueness_ratio=NO_STAGE.uniqueness_ratio, subpixel=NO_STAGE.subpixel)
        return MatcherSettings(self.disparities, self.block_size, disp12_max_diff=1)

    def cosim(self, max_width: int) -> CosimMatcher:
        """Build the matcher in Verilator; the caller closes it."""
        return CosimMatcher(self.parameters(max_width))


#: The configurations of the thesis: numbers from its abstract.
THESIS = (Preset(16, 9, published_pixels=4, published_fps=15.73),
          Preset(16, 7, published_pixels=2, published_fps=29.32))

#: Ours.
OURS = (Preset(64, 9), Preset(64, 15, OPENCV_FEATURES), Preset(128, 9))


@dataclass(frozen=True)
class Scale:
    """Extent of the measurements: the default for the page, a small one for a test.

    Parameters
    ----------
    presets
        Matchers that are compared.
    width, height
        Size of the frames of the tables, pixels.
    sizes
        Widths and heights of the frames of the plot of frame rates.
    block_sizes
        Block sizes of the tables and curves over them; the model matches those below the gateware's smallest.
    disparities
        Numbers of disparities of the table over them.
    clock_mhz
        Clock with which a number of clocks is converted to a time.
    strip_rows
        Rows that the CPU of the SoC matches.
    """
    presets:     tuple[Preset, ...]          = THESIS + OURS
    width:       int                         = 640
    height:      int                         = 480
    sizes:       tuple[tuple[int, int], ...] = ((160, 120), (320, 240), (384, 288), (434, 383), (450, 375), (640, 480),
                                                (800, 600), (1024, 768), (1280, 720), (1920, 1080))
    block_sizes: tuple[int, ...]             = tuple(range(3, 22, 2))
    disparities: tuple[int, ...]             = (16, 32, 64, 128)
    clock_mhz:   int                         = 100
    strip_rows:  int                         = 20

    def narrow(self) -> list[MatcherParameters]:
        """Return the matchers of the presets for frames of `width`, which are synthesized and counted."""
        return [preset.parameters(self.width) for preset in self.presets]

    def wide(self) -> list[MatcherParameters]:
        """Return the matchers of the presets for the widest frame, which are simulated."""
        return [preset.parameters(self.max_width) for preset in self.presets]

    @property
    def max_width(self) -> int:
        """Width of the widest frame for the simulated matchers, in pixels."""
        return max(self.width, *(width for width, _ in self.sizes))
