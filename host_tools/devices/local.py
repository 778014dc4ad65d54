#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Matchers in this process: the reference model, and the gateware's Verilog in Verilator."""

from __future__ import annotations

import subprocess
import time
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ..core.errors import DeviceError, UrlError
from ..core.features import ALL_STAGES, Feature
from ..core.grid import GridPair
from ..core.settings import DEFAULT_DISPARITIES, DISPARITY_STEP, MIN_BLOCK_SIZE, MatcherSettings
from ..core.settings_table import MAX_HEIGHT
from ..link.urls import DeviceUrl, parse_url
from .base import Device, DeviceInfo, Images, Pair, Progress, Result, check_grid_size, check_pair, chosen_images
from .registry import load, load_rectification

#: Sizes of the model unless the URL says otherwise: only memory limits them.
_MODEL_MAX_SIZE        = 8192
_MODEL_MAX_DISPARITIES = 256
_MODEL_MAX_BLOCK_SIZE  = 51

#: What the simulated gateware is built for unless the URL says otherwise.
_COSIM_MAX_WIDTH      = 1024
_COSIM_MAX_HEIGHT     = MAX_HEIGHT
_COSIM_MAX_BLOCK_SIZE = 21

#: Rows of the rectification of the simulated gateware, and of the highest frame that it rectifies.
_COSIM_ROWS             = 96
_COSIM_RECTIFIED_HEIGHT = 1024

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


class LocalRectification(Protocol):
    """A matcher in this process with a rectification before it."""

    def gap(self, grids: GridPair) -> str:
        """Return why it cannot rectify with the grids; empty if it can."""

    def match(self, pair: Pair, settings: MatcherSettings, grids: GridPair) -> MatchedPair:
        """Rectify and match a pair (uint8, H x W each)."""

    def rectify(self, pair: Pair, grids: GridPair) -> Pair:
        """Return the pair as the matcher gets it."""

    def close(self) -> None:
        """Free what it holds."""


class ModelMatcher:
    """The reference model in NumPy, which counts no clocks."""

    def __init__(self) -> None:
        self._model = load("model")

    def match(self, left: NDArray[np.uint8], right: NDArray[np.uint8], settings: MatcherSettings) -> MatchedPair:
        """Match a pair (uint8, H x W), without clocks."""
        return self._model.stereo_bm(left, right, settings), None, None

    def close(self) -> None:
        """Do nothing: the model holds nothing."""


class ModelRectification:
    """The reference model of the gateware's rectification, in NumPy, before the model of the matcher."""

    def __init__(self, matcher: ModelMatcher) -> None:
        self._matcher = matcher
        self._model   = load_rectification()
        self._grids:    GridPair | None = None
        self._maps:     list[Any] = []

    def gap(self, _: GridPair) -> str:
        """Return an empty text: the model can rectify with all grids."""
        return ""

    def match(self, pair: Pair, settings: MatcherSettings, grids: GridPair) -> MatchedPair:
        """Rectify and match a pair (uint8, H x W each), without clocks."""
        return self._matcher.match(*self.rectify(pair, grids), settings)

    def rectify(self, pair: Pair, grids: GridPair) -> Pair:
        """Rectify a pair (uint8, H x W each)."""
        if grids is not self._grids:
            self._maps  = [self._model.expand(grid.nodes, grid.width, grid.height) for grid in grids]
            self._grids = grids
        left, right = (self._model.remap(image, maps) for image, maps in zip(pair, self._maps, strict=True))
        return left, right

    def close(self) -> None:
        """Do nothing: the model holds nothing."""


class GatewareMatcher:
    """The gateware's Verilog in Verilator; raises what `sim.cores.cosim.CosimMatcher` raises.

    Parameters
    ----------
    parameters
        What is built, of `sim.cores.cosim.MatcherParameters`.
    trace
        File for a waveform; None without one.
    """

    def __init__(self, parameters: Any, trace: Path | None = None) -> None:
        self._matcher = load("cosim").CosimMatcher(parameters, trace)

    def match(self, left: NDArray[np.uint8], right: NDArray[np.uint8], settings: MatcherSettings) -> MatchedPair:
        """Match a pair (uint8, H x W), with exact clocks."""
        matched: MatchedPair = self._matcher.match_settings(left, right, settings)
        return matched

    def close(self) -> None:
        """Free the simulation."""
        self._matcher.close()


class GatewareRectification:
    """The gateware's rectification before its matcher, in Verilator; built when a pair is to be rectified.

    Parameters
    ----------
    parameters
        What is built, of `sim.cores.cosim.MatcherParameters`, with the feature "rectification".
    """

    def __init__(self, parameters: Any) -> None:
        self._cosim      = load("cosim")
        self._parameters = parameters
        self._matcher:     Any = None

    def gap(self, grids: GridPair) -> str:
        """Return why the build cannot rectify with the grids; empty if it can."""
        try:
            self._cosim.check_grids(self._parameters, self._nodes(grids), grids[0].width, grids[0].height)
        except ValueError as error:
            return str(error)
        return ""

    def match(self, pair: Pair, settings: MatcherSettings, grids: GridPair) -> MatchedPair:
        """Rectify and match a pair (uint8, H x W each), with exact clocks."""
        matched: MatchedPair = self._built().match_settings(*pair, settings, grids=self._nodes(grids))
        return matched

    def rectify(self, pair: Pair, grids: GridPair) -> Pair:
        """Rectify a pair (uint8, H x W each)."""
        rectified: Pair = self._built().rectify(*pair, self._nodes(grids))
        return rectified

    def close(self) -> None:
        """Free the simulation."""
        if self._matcher is not None:
            self._matcher.close()

    def _built(self) -> Any:
        if self._matcher is None:
            self._matcher = self._cosim.CosimMatcher(self._parameters)
        return self._matcher

    @staticmethod
    def _nodes(grids: GridPair) -> list[NDArray[np.int16]]:
        return [grid.nodes for grid in grids]


class LocalDevice(Device):
    """A device around a matcher in this process, and around one with rectification; None if nothing rectifies."""

    def __init__(self, info: DeviceInfo, matcher: LocalMatcher,
                 rectification: LocalRectification | None = None) -> None:
        super().__init__()
        self._info          = info
        self._matcher       = matcher
        self._rectification = rectification
        self._matched       = 0

    def info(self) -> DeviceInfo:
        """Return what the matcher was built for."""
        return self._info

    def rectification_gap(self, grids: GridPair) -> str:
        """Return why the matcher cannot rectify; see `Device.rectification_gap`."""
        return super().rectification_gap(grids) if self._rectification is None else self._rectification.gap(grids)

    def stream(self, pairs: Iterable[Pair], settings: MatcherSettings | None = None,
               progress: Progress | None = None, grids: GridPair | None = None,
               images: Images = ()) -> Iterator[Result]:
        """Match pair after pair; see `Device.stream`."""
        self._check_grids(grids)
        settings = self._settings(settings)
        with self._lock.held():
            for left, right in pairs:
                yield self._match(left, right, settings, progress, grids, images)

    def _match(self, left: NDArray[np.uint8], right: NDArray[np.uint8], settings: MatcherSettings,
               progress: Progress | None, grids: GridPair | None, images: Images) -> Result:
        check_pair(left, right)
        self._info.check(left.shape[1], left.shape[0], settings)
        check_grid_size(left, grids)
        if progress is not None:
            progress("match", 0, 1)
        begin = time.monotonic()
        seen  = (left, right)
        try:
            if self._rectification is None or grids is None:
                matched = self._matcher.match(left, right, settings)
            else:
                matched = self._rectification.match((left, right), settings, grids)
                seen    = self._rectification.rectify(seen, grids) if images else seen
        except (OSError, RuntimeError, subprocess.SubprocessError) as error:
            raise DeviceError(f"{self._info.url} failed: {exception_line(error)}") from error
        seconds = time.monotonic() - begin
        self._matched += 1
        if progress is not None:
            progress("match", 1, 1)
        disparity, clocks, first_row_clocks = matched
        return Result(disparity, settings, clocks, first_row_clocks, 0.0, seconds, 0.0, **chosen_images(seen, images))

    def statistics(self) -> dict[str, int]:
        """Return the number of frames that this object has matched."""
        return {"frames_matched": self._matched}

    def console(self, line: str, timeout_s: float = 10.0) -> str:
        """Raise DeviceError: there is no firmware."""
        raise DeviceError(f"{self._info.url} has no console: it is a matcher without firmware")

    def close(self) -> None:
        """Free the matcher."""
        self._matcher.close()
        if self._rectification is not None:
            self._rectification.close()


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
    matcher = ModelMatcher()
    return LocalDevice(info, matcher, ModelRectification(matcher))


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
        parameters = load("cosim").MatcherParameters(max_width=width, disparities=disparities,
                                                     max_block_size=block_size)
        matcher    = GatewareMatcher(parameters, trace)
    except (ImportError, OSError, RuntimeError, ValueError, subprocess.SubprocessError) as error:
        raise DeviceError(f"{url.text} cannot be built: {exception_line(error)}") from error
    rectifying = replace(parameters, features=parameters.features | {"rectification"},
                         rectification_rows=_COSIM_ROWS, rectification_height=_COSIM_RECTIFIED_HEIGHT)
    if trace is not None:
        # The waveform is of the matcher alone.
        rectifying = parameters
    info = DeviceInfo(
        url             = url.text,
        name            = "gateware simulation",
        max_width       = width,
        max_height      = _COSIM_MAX_HEIGHT,
        max_pixels      = width*_COSIM_MAX_HEIGHT,
        max_disparities = disparities,
        min_block_size  = MIN_BLOCK_SIZE,
        max_block_size  = block_size,
        features        = int(rectifying.feature_bits),
    )
    return LocalDevice(info, matcher, GatewareRectification(rectifying) if trace is None else None)
