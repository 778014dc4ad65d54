#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Matchers in this process: the reference model, and the gateware's Verilog in Verilator."""

from __future__ import annotations

import subprocess
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ..core.errors import DeviceError, ImageError, UrlError
from ..core.features import ALL_STAGES, Feature
from ..core.grid import GridPair
from ..core.settings import DEFAULT_DISPARITIES, DISPARITY_STEP, MIN_BLOCK_SIZE, MatcherSettings
from ..core.settings_table import MAX_HEIGHT
from ..link.urls import DeviceUrl, parse_url
from .base import Device, DeviceInfo, Pair, Progress, Result, check_pair
from .registry import load, load_rectification

#: Sizes of the model unless the URL says otherwise: only memory limits them.
_MODEL_MAX_SIZE        = 8192
_MODEL_MAX_DISPARITIES = 256
_MODEL_MAX_BLOCK_SIZE  = 51

#: What the simulated gateware is built for unless the URL says otherwise.
_COSIM_MAX_WIDTH      = 1024
_COSIM_MAX_HEIGHT     = MAX_HEIGHT
_COSIM_MAX_BLOCK_SIZE = 21

#: Endings of the waveforms that the simulated gateware writes.
_WAVEFORMS = (".fst", ".vcd")

#: Disparity map (int16, H x W, sixteenths of a pixel), clocks, and clocks up to the first row; None if not counted.
MatchedPair = tuple[NDArray[np.int16], int | None, int | None]


class LocalMatcher(Protocol):
    """A matcher in this process."""

    def match(self, left: NDArray[np.uint8], right: NDArray[np.uint8], settings: MatcherSettings) -> MatchedPair:
        """Match a pair (uint8, H x W)."""

    def close(self) -> None:
        """Free what the matcher holds."""


class ModelMatcher:
    """The reference model in NumPy, which counts no clocks."""

    def __init__(self) -> None:
        self._model = load("model")

    def match(self, left: NDArray[np.uint8], right: NDArray[np.uint8], settings: MatcherSettings) -> MatchedPair:
        """Match a pair (uint8, H x W), without clocks."""
        return self._model.stereo_bm(left, right, settings), None, None

    def close(self) -> None:
        """Do nothing: the model holds nothing."""


class GatewareMatcher:
    """The gateware's Verilog in Verilator; raises what `sim.cores.cosim.CosimMatcher` raises."""

    def __init__(self, max_width: int, disparities: int, max_block_size: int, trace: Path | None) -> None:
        cosim         = load("cosim")
        parameters    = cosim.MatcherParameters(max_width=max_width, disparities=disparities,
                                                max_block_size=max_block_size)
        self._matcher = cosim.CosimMatcher(parameters, trace)
        self.features = int(parameters.feature_bits)

    def match(self, left: NDArray[np.uint8], right: NDArray[np.uint8], settings: MatcherSettings) -> MatchedPair:
        """Match a pair (uint8, H x W), with exact clocks."""
        matched: MatchedPair = self._matcher.match_settings(left, right, settings)
        return matched

    def close(self) -> None:
        """Free the simulation."""
        self._matcher.close()


class ModelRectifier:
    """The reference model of the gateware's rectification, in NumPy."""

    def __init__(self) -> None:
        self._model = load_rectification()
        self._grids: GridPair | None = None
        self._maps:  list[Any] = []

    def __call__(self, pair: Pair, grids: GridPair) -> Pair:
        """Rectify a pair (uint8, H x W each)."""
        if grids is not self._grids:
            self._maps  = [self._model.expand(grid.nodes, grid.width, grid.height) for grid in grids]
            self._grids = grids
        left, right = (self._model.remap(image, maps) for image, maps in zip(pair, self._maps, strict=True))
        return left, right


class LocalDevice(Device):
    """A device around a matcher in this process, and around what rectifies its pairs; None if nothing does."""

    def __init__(self, info: DeviceInfo, matcher: LocalMatcher,
                 rectify: Callable[[Pair, GridPair], Pair] | None = None) -> None:
        super().__init__()
        self._info    = info
        self._matcher = matcher
        self._rectify = rectify
        self._matched = 0

    def info(self) -> DeviceInfo:
        """Return what the matcher was built for."""
        return self._info

    def rectification_gap(self, grids: GridPair) -> str:
        """Return why the matcher cannot rectify; see `Device.rectification_gap`."""
        return super().rectification_gap(grids) if self._rectify is None else ""

    def stream(self, pairs: Iterable[Pair], settings: MatcherSettings | None = None,
               progress: Progress | None = None, grids: GridPair | None = None) -> Iterator[Result]:
        """Match pair after pair; see `Device.stream`."""
        self._check_grids(grids)
        settings = self._settings(settings)
        with self._lock.held():
            for left, right in pairs:
                yield self._match(left, right, settings, progress, grids)

    def _match(self, left: NDArray[np.uint8], right: NDArray[np.uint8], settings: MatcherSettings,
               progress: Progress | None, grids: GridPair | None) -> Result:
        check_pair(left, right)
        self._info.check(left.shape[1], left.shape[0], settings)
        if grids is not None and left.shape != (grids[0].height, grids[0].width):
            raise ImageError(f"the images are {left.shape[1]}x{left.shape[0]} pixels, the grids are for "
                             f"{grids[0].width}x{grids[0].height}")
        if progress is not None:
            progress("match", 0, 1)
        begin = time.monotonic()
        try:
            if self._rectify is not None and grids is not None:
                left, right = self._rectify((left, right), grids)
            disparity, clocks, first_row_clocks = self._matcher.match(left, right, settings)
        except (OSError, RuntimeError) as error:
            raise DeviceError(f"{self._info.url} failed: {exception_line(error)}") from error
        seconds = time.monotonic() - begin
        self._matched += 1
        if progress is not None:
            progress("match", 1, 1)
        return Result(disparity, settings, clocks, first_row_clocks, 0.0, seconds, 0.0)

    def statistics(self) -> dict[str, int]:
        """Return the number of frames that this object has matched."""
        return {"frames_matched": self._matched}

    def console(self, line: str, timeout_s: float = 10.0) -> str:
        """Raise DeviceError: there is no firmware."""
        raise DeviceError(f"{self._info.url} has no console: it is a matcher without firmware")

    def close(self) -> None:
        """Free the matcher."""
        self._matcher.close()


def exception_line(error: BaseException) -> str:
    """Return the text of an exception as one line."""
    return " ".join(str(error).split()) or type(error).__name__


def is_shareable(text: str) -> bool:
    """Return whether several processes may open the device of a URL at once.

    They may open the model, and the gateware alone unless it writes a waveform, which is one file.
    """
    url = parse_url(text)
    return url.scheme in ("model", "cosim") and "trace" not in url.options


def _disparities(url: DeviceUrl, default: int) -> int:
    """Return the URL's number of disparities; raise UrlError if it is not a multiple of 16."""
    number = url.integer("disparities", default, DISPARITY_STEP)
    if number % DISPARITY_STEP:
        raise UrlError(f"{url.text}: disparities must be a multiple of {DISPARITY_STEP}, not {number}")
    return number


def _block_size(url: DeviceUrl, default: int) -> int:
    """Return the URL's largest block size; raise UrlError if it is not odd."""
    number = url.integer("max_block_size", default, MIN_BLOCK_SIZE)
    if number % 2 == 0:
        raise UrlError(f"{url.text}: max_block_size must be odd, not {number}")
    return number


def _trace(url: DeviceUrl) -> Path | None:
    """Return the URL's file for a waveform, None without one; raise UrlError if it has another ending."""
    text = url.options.get("trace")
    if text is None:
        return None
    if Path(text).suffix not in _WAVEFORMS:
        raise UrlError(f"{url.text}: trace is a file that ends in {' or '.join(_WAVEFORMS)}, not '{text}'")
    return Path(text)


def open_model(url: DeviceUrl) -> LocalDevice:
    """Return the device `model:`; raise UrlError if an option is wrong."""
    url.check_options("disparities", "max_width", "max_block_size")
    width = url.integer("max_width", _MODEL_MAX_SIZE)
    info  = DeviceInfo(
        url             = url.text,
        name            = "reference model",
        max_width       = width,
        max_height      = _MODEL_MAX_SIZE,
        max_pixels      = width*_MODEL_MAX_SIZE,
        max_disparities = _disparities(url, _MODEL_MAX_DISPARITIES),
        min_block_size  = MIN_BLOCK_SIZE,
        max_block_size  = _block_size(url, _MODEL_MAX_BLOCK_SIZE),
        features        = int(ALL_STAGES | Feature.RECTIFICATION),
    )
    return LocalDevice(info, ModelMatcher(), ModelRectifier())


def open_cosim(url: DeviceUrl) -> LocalDevice:
    """Return the device `cosim:`; with the option `trace` it writes a waveform, which is whole after `close`.

    Raises
    ------
    UrlError
        An option is wrong.
    DeviceError
        It cannot be built, or the waveform cannot be written.
    MissingExtraError
        The packages of the extra `gateware` are not installed.
    """
    url.check_options("disparities", "max_width", "max_block_size", "trace")
    width       = url.integer("max_width", _COSIM_MAX_WIDTH)
    disparities = _disparities(url, DEFAULT_DISPARITIES)
    block_size  = _block_size(url, _COSIM_MAX_BLOCK_SIZE)
    trace       = _trace(url)
    try:
        matcher = GatewareMatcher(width, disparities, block_size, trace)
    except (ImportError, OSError, RuntimeError, ValueError, subprocess.SubprocessError) as error:
        raise DeviceError(f"{url.text} cannot be built: {exception_line(error)}") from error
    info = DeviceInfo(
        url             = url.text,
        name            = "gateware simulation",
        max_width       = width,
        max_height      = _COSIM_MAX_HEIGHT,
        max_pixels      = width*_COSIM_MAX_HEIGHT,
        max_disparities = disparities,
        min_block_size  = MIN_BLOCK_SIZE,
        max_block_size  = block_size,
        features        = matcher.features,
    )
    return LocalDevice(info, matcher)
