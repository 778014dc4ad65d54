#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What every device can do."""

from __future__ import annotations

import abc
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..core.errors import ImageError, UnsupportedError
from ..core.features import ALL_FEATURES, DESCRIPTIONS, Feature
from ..core.settings import DEFAULT_BLOCK_SIZE, DEFAULT_DISPARITIES, MatcherSettings
from ..link.call import LinkCounters
from .lock import Turns

if TYPE_CHECKING:
    from typing_extensions import Self

#: Receives the phase ("upload", "match" or "download"; of an update "upload" or "write"), the steps done and the steps
#: in all.
Progress = Callable[[str, int, int], None]

#: Longest wait in seconds for a device that restarts.
RESTART_LIMIT_S = 60.0

#: Left and right image: uint8, H x W.
Pair = tuple[NDArray[np.uint8], NDArray[np.uint8]]


@dataclass(frozen=True)
class DeviceInfo:
    """What a device is: sizes in pixels, versions as "major.minor", `sys_clk_hz` 0 if it has no clock."""

    url:              str
    name:             str
    max_width:        int
    max_height:       int
    max_pixels:       int
    max_disparities:  int
    min_block_size:   int
    max_block_size:   int
    slots:            int = 1
    sys_clk_hz:       int = 0
    features:         int = int(ALL_FEATURES)
    gateware_version: str = ""
    firmware_version: str = ""

    def default_settings(self) -> MatcherSettings:
        """64 disparities, block size 9, cv2.StereoBM's defaults, or what the device has if that is less."""
        settings = MatcherSettings(min(DEFAULT_DISPARITIES, self.max_disparities),
                                   min(DEFAULT_BLOCK_SIZE, self.max_block_size))
        return settings.without(self.missing_features)

    @property
    def missing_features(self) -> Feature:
        """Stages that the device was not built with."""
        return ALL_FEATURES & ~Feature(self.features & ALL_FEATURES)

    def check(self, width: int, height: int, settings: MatcherSettings) -> None:
        """Checks that the device can match images of `width` x `height` pixels with `settings`.

        Raises
        ------
        UnsupportedError
            The device was not built for that many disparities, that block size, or a stage.
        ImageError
            The images are too large for the device, or too small for the settings.
        """
        if settings.disparities > self.max_disparities:
            raise UnsupportedError(f"{self.name} has {self.max_disparities} disparities, "
                                   f"{settings.disparities} are too many")
        if not self.min_block_size <= settings.block_size <= self.max_block_size:
            raise UnsupportedError(f"{self.name} has block sizes from {self.min_block_size} to "
                                   f"{self.max_block_size}, not {settings.block_size}")
        for feature, description in DESCRIPTIONS.items():
            if feature & settings.features & self.missing_features:
                raise UnsupportedError(f"{self.name} was built without {description}: "
                                       "switch it off, or use a device that has it, see `litestereo info`")
        if width > self.max_width or height > self.max_height or width*height > self.max_pixels:
            raise ImageError(f"images of {width}x{height} pixels are too large for {self.name}: at most "
                             f"{self.max_width}x{self.max_height} and {self.max_pixels} pixels in all")
        check_minimum_size(width, height, settings)


def check_minimum_size(width: int, height: int, settings: MatcherSettings) -> None:
    """Raises ImageError if images of `width` x `height` pixels have no pixel that can get a disparity."""
    min_width, min_height = settings.minimum_size
    if width < min_width or height < min_height:
        shifted = f" from {settings.min_disparity} on" if settings.min_disparity else ""
        raise ImageError(f"images of {width}x{height} pixels are too small for {settings.disparities} "
                         f"disparities{shifted} and block size {settings.block_size}: at least "
                         f"{min_width}x{min_height}")


def check_pair(left: NDArray[np.uint8], right: NDArray[np.uint8]) -> None:
    """Raises ImageError if the images are not two 8-bit grey ones, H x W, of one size."""
    for side, image in (("left", left), ("right", right)):
        if image.ndim != 2 or image.dtype != np.uint8:
            raise ImageError(f"the {side} image must be 8-bit grey (uint8, H x W), not {image.dtype} "
                             f"{image.shape}")
    if left.shape != right.shape:
        raise ImageError(f"the images must be of one size: left is {left.shape[1]}x{left.shape[0]} pixels, "
                         f"right {right.shape[1]}x{right.shape[0]}")


@dataclass(frozen=True)
class Result:
    """A matched pair.

    `disparity` is int16, H x W, in sixteenths of a pixel, `settings.invalid` where there is none. `clocks`
    counts from the start to the last write, `first_row_clocks` to the end of the first row that has
    disparities; both are None where nothing counts clocks. The seconds are wall-clock time of this host. Those of a
    streamed frame overlap, and its clocks go on while pixels are waited for.
    """

    disparity:        NDArray[np.int16]
    settings:         MatcherSettings
    clocks:           int | None
    first_row_clocks: int | None
    upload_s:         float
    match_s:          float
    download_s:       float


class Device(abc.ABC):
    """A matcher. Use it as a context manager, or `close` it.

    Several threads may use it: each call, and each stream from its first pair to its end, has the device to itself, and
    the other threads wait for it, a bounded time. One thread may have several streams at once. Whoever closes the
    device sees to it that nobody uses it any more.
    """

    def __init__(self) -> None:
        self._turns = Turns()

    @abc.abstractmethod
    def info(self) -> DeviceInfo:
        """What the device is."""

    def stream(self, pairs: Iterable[Pair], settings: MatcherSettings | None = None,
               progress: Progress | None = None) -> Iterator[Result]:
        """Matches pair after pair; remote devices get the next pair while they match the one before.

        Raises
        ------
        UnsupportedError, ImageError
            The settings or a pair do not suit the device.
        DeviceError
            The device is gone, does not answer, or could not match, or another thread does not let go of it.
        """
        with self._turns.turn():
            yield from self._stream(pairs, settings, progress)

    @abc.abstractmethod
    def _stream(self, pairs: Iterable[Pair], settings: MatcherSettings | None,
                progress: Progress | None) -> Iterator[Result]:
        """As `stream`, for the one thread whose turn it is."""

    def compute(self, left: NDArray[np.uint8], right: NDArray[np.uint8],
                settings: MatcherSettings | None = None, progress: Progress | None = None) -> Result:
        """Matches one pair of images, uint8, H x W; without `settings` with the device's default.

        Raises as `stream`.
        """
        (result,) = self.stream([(left, right)], settings, progress)
        return result

    @property
    def link_counters(self) -> LinkCounters | None:
        """What happened on this host's side of the link to the device; None if there is no link."""
        return None

    @abc.abstractmethod
    def statistics(self) -> dict[str, int]:
        """The device's counters by name."""

    @abc.abstractmethod
    def console(self, line: str, timeout_s: float = 10.0) -> str:
        """Types a line at the device's console.

        Returns the text printed up to the next prompt, or until nothing comes for `timeout_s`. Raises
        DeviceError if the device has no console, LinkTimeout if it prints nothing at all.
        """

    def update_firmware(self, firmware: Path | bytes, *, restart: bool = True, progress: Progress | None = None,
                        restart_limit_s: float = RESTART_LIMIT_S) -> DeviceInfo:
        """Writes another firmware to the device's flash, and has the device start it.

        Parameters
        ----------
        firmware
            The image, `firmware.bin` of a build, or its bytes.
        restart
            Whether the device is restarted; else it starts the new firmware when somebody does that.
        progress
            Told of the phases "upload" and "write".
        restart_limit_s
            Longest wait in seconds for the device to come back.

        Returns
        -------
        What the device is after that.

        Raises
        ------
        FirmwareError
            The image is damaged, or not for this device.
        UnsupportedError
            The device has no flash that could be written to.
        DeviceError
            The device is gone, does not answer, did not take the firmware, or did not come back with it. A good
            firmware is in its flash in any case.
        """
        raise UnsupportedError(f"{self.info().name} has no firmware that could be replaced")

    def close(self) -> None:  # noqa: B027 - devices that hold nothing need none
        """Lets go of the device; closing twice does no harm."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        self.close()
