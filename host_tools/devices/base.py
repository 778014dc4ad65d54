#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What every device can do: `Device`, what it is, its results, and the lock between threads."""

from __future__ import annotations

import abc
import contextlib
import dataclasses
import threading
import warnings
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from ..core.errors import DeviceError, ImageError, UnsupportedError
from ..core.features import ALL_STAGES, DESCRIPTIONS, OPENCV_STAGES, Feature
from ..core.grid import GridPair
from ..core.settings import RULES, MatcherSettings
from ..link.settings import LinkCounters
from ..protocol.payloads import Trial

if TYPE_CHECKING:
    from typing_extensions import Self

#: Called with the phase ("upload", "match" or "download"; of an update "upload" or "write"), the number of steps done,
#: and the number of all steps.
Progress = Callable[[str, int, int], None]

#: Longest wait in seconds for a device that restarts.
RESTART_LIMIT_S = 60.0

#: Longest wait in seconds for another thread, whose stream may never end.
LOCK_LIMIT_S = 60.0

#: Width and height of the pictures that most cameras give, in pixels.
VGA = (640, 480)

#: Which images of a result are wanted.
Images = Collection[Literal["left", "right"]]

#: Left and right image: uint8, H x W.
Pair = tuple[NDArray[np.uint8], NDArray[np.uint8]]


@dataclass(frozen=True)
class Lacks:
    """What cv2.StereoBM can do and a device cannot do: its stages, its default sizes, and VGA pictures.

    `disparities`, `block_size` and `size` (width and height in pixels) are None if the device has that much.
    """

    stages:      Feature
    disparities: int | None
    block_size:  int | None
    size:        tuple[int, int] | None


@dataclass(frozen=True)
class DeviceInfo:
    """What a device is.

    Sizes are in pixels, versions "major.minor". `slots` is the number of frames that it holds at once, `features` has a
    bit for each `Feature`, and `sys_clk_hz` is 0 if it has no clock. Further
    values are in `capabilities`, by the names of `Capability`; an absent one is 0.
    """

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
    features:         int = int(ALL_STAGES)
    gateware_version: str = ""
    firmware_version: str = ""
    capabilities:     Mapping[str, int] = field(default_factory=dict, hash=False)

    def default_settings(self) -> MatcherSettings:
        """Return cv2.StereoBM's defaults with 64 disparities and block size 9, or less if the device has less.

        Stages that the device was built without are off; `choose_settings` says which.
        """
        return choose_settings([self]).settings

    @property
    def max_prefilter_cap(self) -> int:
        """Return the largest prefilter cap that the device has."""
        most = RULES["prefilter_cap"].most
        assert most is not None, "its range has an end"
        return self.capabilities.get("max_prefilter_cap", 0) or most

    @property
    def missing_features(self) -> Feature:
        """Return the stages that the device was built without."""
        return ALL_STAGES & ~Feature(self.features & ALL_STAGES)

    @property
    def lacks(self) -> Lacks:
        """Return what cv2.StereoBM can do, with its default sizes, and the device cannot do."""
        disparities   = RULES["disparities"].opencv_default
        block_size    = RULES["block_size"].opencv_default
        width, height = VGA
        fits          = width <= self.max_width and height <= self.max_height and width*height <= self.max_pixels
        return Lacks(
            stages      = self.missing_features & OPENCV_STAGES,
            disparities = None if self.max_disparities >= disparities else disparities,
            block_size  = None if self.max_block_size >= block_size else block_size,
            size        = None if fits else VGA,
        )

    def check(self, width: int, height: int, settings: MatcherSettings) -> None:
        """Check that the device can match images of `width` x `height` pixels with `settings`.

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
        if settings.prefilter == "xsobel" and settings.prefilter_cap > self.max_prefilter_cap:
            raise UnsupportedError(f"{self.name} has prefilter caps up to {self.max_prefilter_cap}, "
                                   f"not {settings.prefilter_cap}")
        for feature, description in DESCRIPTIONS.items():
            if feature & settings.features & self.missing_features:
                raise UnsupportedError(f"{self.name} was built without {description}: "
                                       "switch it off, or use a device that has it, see `litestereo info`")
        if width > self.max_width or height > self.max_height or width*height > self.max_pixels:
            raise ImageError(f"images of {width}x{height} pixels are too large for {self.name}: at most "
                             f"{self.max_width}x{self.max_height} and {self.max_pixels} pixels in all")
        check_minimum_size(width, height, settings)


@dataclass(frozen=True)
class Choice:
    """Settings for a device, and the stages that are off although they are on by default.

    `lacking` are those of them that the device was built without; the others need one of those.
    """

    settings: MatcherSettings
    missing:  Feature = Feature(0)
    lacking:  Feature = Feature(0)

    @property
    def notices(self) -> list[str]:
        """One line for each stage that is off."""
        return [f"{DESCRIPTIONS[stage]} is off: the device was built without "
                f"{'it' if stage & self.lacking else 'what it needs'}"
                for stage in DESCRIPTIONS if stage & self.missing]


def choose_settings(infos: Sequence[DeviceInfo], given: Mapping[str, Any] | None = None,
                    default: MatcherSettings | None = None, strict: bool = False) -> Choice:
    """Choose the settings for one device, or equal ones for several. All commands and classes choose them here.

    Parameters
    ----------
    infos
        The devices.
    given
        Settings that were asked for, by their names in `MatcherSettings`: they are not changed.
    default
        Values of the others; the size of the search, the blocks and the cap are reduced to what every device has, and
        stages that one of them lacks are off.
    strict
        Whether to refuse instead of switching a stage off.

    Raises
    ------
    UnsupportedError
        A stage that is missing was asked for, or would be off with `strict`.
    """
    given   = given or {}
    default = default or MatcherSettings()
    lacking = Feature(0)
    for info in infos:
        lacking |= info.missing_features
    reduced = dataclasses.replace(
        default,
        disparities   = min([default.disparities, *(info.max_disparities for info in infos)]),
        block_size    = min([default.block_size, *(info.max_block_size for info in infos)]),
        prefilter_cap = min([default.prefilter_cap, *(info.max_prefilter_cap for info in infos)]),
    )
    wanted   = dataclasses.replace(reduced, **given)
    settings = dataclasses.replace(wanted.without(lacking), **given)
    missing  = wanted.features & ~settings.features
    refused  = missing if strict else Feature(0)
    for name in given:
        # As a threshold of the texture, which has no effect without the prefilter.
        refused |= missing & RULES[name].feature
    if refused:
        stage = next(stage for stage in DESCRIPTIONS if stage & missing & lacking)
        name  = next(info.name for info in infos if stage & info.missing_features)
        raise UnsupportedError(f"{name} was built without {DESCRIPTIONS[stage]}: switch it off, or use a device that "
                               "has it, see `litestereo info`")
    return Choice(settings, missing, missing & lacking)


def check_minimum_size(width: int, height: int, settings: MatcherSettings) -> None:
    """Raise ImageError if images of `width` x `height` pixels have no pixel that can get a disparity."""
    min_width, min_height = settings.minimum_size
    if width < min_width or height < min_height:
        shifted = f" from {settings.min_disparity} on" if settings.min_disparity else ""
        raise ImageError(f"images of {width}x{height} pixels are too small for {settings.disparities} "
                         f"disparities{shifted} and block size {settings.block_size}: at least "
                         f"{min_width}x{min_height}")


def check_pair(left: NDArray[np.uint8], right: NDArray[np.uint8]) -> None:
    """Raise ImageError if the images are not both 8-bit grey (uint8, H x W) and of one size."""
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

    Parameters
    ----------
    disparity
        int16, H x W, in sixteenths of a pixel; `settings.invalid` where there is none.
    settings
        What the pair was matched with.
    clocks, first_row_clocks
        Clocks from the start to the last write, and to the end of the first row that has disparities; None if the
        device counts no clocks. For a streamed frame they include the clocks in which the matcher waits for pixels.
    upload_s, match_s, download_s
        Wall-clock time on this host, in seconds. The phases of a streamed frame overlap.
    left, right
        The images as the matcher got them, uint8, H x W: rectified if the pair was; None if they were not asked for.
    """

    disparity:        NDArray[np.int16]
    settings:         MatcherSettings
    clocks:           int | None
    first_row_clocks: int | None
    upload_s:         float
    match_s:          float
    download_s:       float
    left:             NDArray[np.uint8] | None = None
    right:            NDArray[np.uint8] | None = None


def check_grid_size(image: NDArray[np.uint8], grids: GridPair | None) -> None:
    """Raise ImageError if an image of a pair has another size than the grids that are to rectify it."""
    if grids is not None and image.shape != (grids[0].height, grids[0].width):
        raise ImageError(f"the images are {image.shape[1]}x{image.shape[0]} pixels, the grids are for "
                         f"{grids[0].width}x{grids[0].height}")


def chosen_images(pair: Pair, images: Images) -> dict[str, NDArray[np.uint8]]:
    """Return copies of the images of a pair that are wanted, by their names in `Result`."""
    return {name: image.copy() for name, image in zip(("left", "right"), pair, strict=True) if name in images}


class DeviceLock:
    """Lets one thread at a time use a device.

    The thread that holds it may take it again, so it may interleave several streams.
    """

    def __init__(self) -> None:
        self._lock  = threading.Lock()
        self._owner = 0
        self._depth = 0

    @contextlib.contextmanager
    def held(self) -> Iterator[None]:
        """Hold the lock; wait for another thread, and raise DeviceError if that takes too long."""
        if self._owner != threading.get_ident():
            if not self._lock.acquire(timeout=LOCK_LIMIT_S):
                raise DeviceError(f"another thread has used the device for {LOCK_LIMIT_S:g} s: end its stream first, "
                                  "or give each thread a device")
            self._owner = threading.get_ident()
        self._depth += 1
        try:
            yield
        finally:
            # Perhaps in another thread: an abandoned stream ends in the thread that collects it.
            self._depth -= 1
            if not self._depth:
                self._owner = 0
                self._lock.release()


class Device(abc.ABC):
    """A matcher. Use it as a context manager, or `close` it.

    Several threads may use it. Each call, and each stream from its first pair to its end, locks the device; other
    threads wait for it, a bounded time. One thread may interleave several streams. The caller makes sure that no thread
    uses the device while it is closed.
    """

    def __init__(self) -> None:
        self._lock   = DeviceLock()
        self._warned = False

    @abc.abstractmethod
    def info(self) -> DeviceInfo:
        """Return what the device is."""

    def rectification_gap(self, grids: GridPair) -> str:
        """Return why the device cannot rectify pairs with the grids; empty if it can, and `stream` may have them."""
        return "the device does not rectify"

    @abc.abstractmethod
    def stream(self, pairs: Iterable[Pair], settings: MatcherSettings | None = None,
               progress: Progress | None = None, grids: GridPair | None = None,
               images: Images = ()) -> Iterator[Result]:
        """Match pair after pair, and yield the results in that order.

        Parameters
        ----------
        pairs
            Left and right images, each uint8, H x W. A remote device gets the next pair while it matches one.
        settings
            What to match with; the device's default settings if None.
        progress
            Called with the steps of each pair.
        grids
            Grids of the left and the right camera, with which the device rectifies each pair before it matches it; None
            if the pairs are rectified already.
        images
            Which images of the results are wanted, as the matcher gets them: "left", "right" or both.

        Raises
        ------
        UnsupportedError, ImageError
            The settings, the grids or a pair do not suit the device.
        DeviceError
            The device is gone, does not answer, or could not match, or another thread does not release it.
        """

    def compute(self, left: NDArray[np.uint8], right: NDArray[np.uint8],
                settings: MatcherSettings | None = None, progress: Progress | None = None,
                grids: GridPair | None = None, images: Images = ()) -> Result:
        """Match one pair of images, uint8, H x W; see `stream` for the parameters and for what it raises."""
        (result,) = self.stream([(left, right)], settings, progress, grids, images)
        return result

    def _check_grids(self, grids: GridPair | None) -> None:
        """Raise UnsupportedError if the device is to rectify with grids with which it cannot."""
        if grids is not None and (gap := self.rectification_gap(grids)):
            raise UnsupportedError(f"{self.info().name} cannot rectify the pair: {gap}")

    def _settings(self, settings: MatcherSettings | None) -> MatcherSettings:
        """Return the settings of a call, or the default ones; warn once of stages that those lack."""
        if settings is not None:
            return settings
        choice = choose_settings([self.info()])
        if choice.missing and not self._warned:
            self._warned = True
            for notice in choice.notices:
                warnings.warn(notice, RuntimeWarning, stacklevel=4)
        return choice.settings

    @property
    def link_counters(self) -> LinkCounters | None:
        """Return the counters of this host's side of the link to the device; None if there is no link."""
        return None

    @abc.abstractmethod
    def statistics(self) -> dict[str, int]:
        """Return the device's counters by name."""

    @abc.abstractmethod
    def console(self, line: str, timeout_s: float = 10.0) -> str:
        """Type a line at the device's console, and return what it prints.

        Parameters
        ----------
        line
            The command.
        timeout_s
            Seconds without further text after which the output counts as complete if no prompt has come.

        Raises
        ------
        LinkTimeout
            The device prints nothing at all.
        DeviceError
            The device has no console, or is gone.
        """

    def calibration(self) -> bytes | None:
        """Return the record of the calibration that the device uses; None if it uses none.

        Raises
        ------
        UnsupportedError
            The device keeps no calibration.
        DeviceError
            The device is gone, or does not answer.
        """
        raise UnsupportedError(f"{self.info().name} keeps no calibration")

    def write_calibration(self, record: bytes, *, keep: bool = True, progress: Progress | None = None) -> None:
        """Have the device rectify by a calibration from now on.

        Parameters
        ----------
        record
            The calibration record.
        keep
            Whether the device writes it to flash, and uses it from power-up; otherwise until its next reset.
        progress
            Called with the steps of "upload" and "write".

        Raises
        ------
        GeometryError
            It is no record, or the device has no room for it.
        UnsupportedError
            The device keeps no calibration.
        DeviceError
            The device does not accept it, as when its map needs more rows than the device keeps: the one before stays
            in use. Or the device is gone, or does not answer.
        """
        raise UnsupportedError(f"{self.info().name} keeps no calibration")

    def erase_calibration(self) -> None:
        """Have the device use no calibration, and erase the one in its flash; raise as `calibration`."""
        raise UnsupportedError(f"{self.info().name} keeps no calibration")

    def update_firmware(self, firmware: Path | bytes, *, restart: bool = True, progress: Progress | None = None,
                        restart_limit_s: float = RESTART_LIMIT_S) -> DeviceInfo:
        """Write another firmware to the device's flash, and have the device start it.

        Parameters
        ----------
        firmware
            The image, `firmware.bin` of a build, or its bytes.
        restart
            Whether to restart the device; otherwise it starts the new firmware at its next restart.
        progress
            Called with the steps of "upload" and "write".
        restart_limit_s
            Longest wait in seconds for the device to come back.

        Returns
        -------
        What the device is after the update.

        Raises
        ------
        FirmwareError
            The image is damaged, or not for this device.
        UnsupportedError
            The device has no flash for firmware.
        DeviceError
            The device is gone, does not answer, did not accept the firmware, or did not come back with it, perhaps
            because the firmware failed its trial. Its flash holds a good firmware in any case.
        """
        raise UnsupportedError(f"{self.info().name} has no firmware that could be replaced")

    def trial(self) -> Trial:
        """Return what has become of the firmware that `update_firmware` has written.

        RUNNING: the device tries it, or will at its next restart. CONFIRMED: it works. FELL_BACK: it has failed, and
        the old one runs again. UNKNOWN: there was no update, or the device does not say.
        """
        return Trial.UNKNOWN

    def close(self) -> None:  # noqa: B027 - devices that hold nothing need none
        """Release the device; closing twice does no harm."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        self.close()
