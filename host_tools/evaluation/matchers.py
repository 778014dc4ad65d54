#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Matchers side by side: devices, and OpenCV's with the same settings."""

from __future__ import annotations

from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from ..core.errors import UnsupportedError
from ..core.settings import MatcherSettings
from ..devices.base import check_minimum_size
from ..devices.connect import Device, connect
from ..devices.local import is_shareable

#: OpenCV's matchers by their names in a command.
OPENCV = ("bm", "sgbm")

#: Beginning of the name of one of OpenCV's matchers, in the place of a device's URL.
_OPENCV_PREFIX = "cv2:"

#: Penalties of StereoSGBM for a step of one disparity, and of more, per pixel of a block, as OpenCV recommends them.
_P1, _P2 = 8, 32

#: StereoSGBM always runs the left-right check, and treats 0 and less as 1. No two disparities differ by this much.
_NO_CHECK = 1 << 20


class Matcher(Protocol):
    """Something that matches pairs."""

    def match(self, left: NDArray[np.uint8], right: NDArray[np.uint8], settings: MatcherSettings) -> NDArray[np.int16]:
        """Match a pair; return int16, H x W, in sixteenths of a pixel, `settings.invalid` where there is none."""

    def close(self) -> None:
        """Release what the matcher holds."""


class DeviceMatcher:
    """A device as a matcher."""

    def __init__(self, device: Device) -> None:
        self._device = device

    def match(self, left: NDArray[np.uint8], right: NDArray[np.uint8], settings: MatcherSettings) -> NDArray[np.int16]:
        """Match a pair; raise as `Device.compute` does."""
        return self._device.compute(left, right, settings).disparity

    def close(self) -> None:
        """Close the device."""
        self._device.close()


class OpenCVMatcher:
    """`cv2.StereoBM` ("bm") or `cv2.StereoSGBM` ("sgbm")."""

    def __init__(self, kind: str) -> None:
        self._kind = kind

    def match(self, left: NDArray[np.uint8], right: NDArray[np.uint8], settings: MatcherSettings) -> NDArray[np.int16]:
        """Match a pair.

        The map of "bm" is invalid outside of the region where StereoBM computes disparities; see below.

        Raises
        ------
        UnsupportedError
            OpenCV's matcher has no such setting.
        ImageError
            The images are too small.
        """
        check_opencv(self._kind, settings)
        check_minimum_size(left.shape[1], left.shape[0], settings)
        matcher = _stereo_bm(settings) if self._kind == "bm" else _stereo_sgbm(settings)
        found   = np.asarray(matcher.compute(left, right), np.int16)
        if self._kind == "sgbm":
            return found
        # With a smallest disparity above 0, StereoBM of OpenCV 5.0.0 leaves the border of its map undefined: it writes
        # that many values past the end of each row. Only the region where it computes disparities is kept.
        margin  = settings.block_size//2
        first   = settings.min_disparity + settings.disparities - 1 + margin
        inside  = np.s_[margin:left.shape[0] - margin, first:left.shape[1] - margin]
        map_    = np.full(left.shape, settings.invalid, np.int16)
        map_[inside] = found[inside]
        return map_

    def close(self) -> None:
        """Release nothing: OpenCV's matcher holds nothing."""


def check_opencv(kind: str, settings: MatcherSettings) -> None:
    """Raise UnsupportedError if OpenCV's matcher `kind` lacks a stage that `settings` need."""
    for lacking, what in ((settings.prefilter != "xsobel", "a match without prefilter"),
                          (not settings.subpixel, "whole pixels"), (settings.median, "a median")):
        if lacking:
            raise UnsupportedError(f"--opencv {kind}: OpenCV's matcher has no setting for {what}: leave one of the two "
                                   "out")


def _stereo_bm(settings: MatcherSettings) -> cv2.StereoBM:
    matcher = cv2.StereoBM.create(settings.disparities, settings.block_size)
    matcher.setMinDisparity(settings.min_disparity)
    matcher.setPreFilterCap(settings.prefilter_cap)
    matcher.setTextureThreshold(settings.texture_threshold)
    matcher.setUniquenessRatio(settings.uniqueness_ratio)
    matcher.setDisp12MaxDiff(settings.disp12_max_diff)
    return matcher


def _stereo_sgbm(settings: MatcherSettings) -> cv2.StereoSGBM:
    """Build StereoSGBM, which has no texture test, with all other settings as for StereoBM."""
    pixels = settings.block_size**2
    return cv2.StereoSGBM.create(
        minDisparity    = settings.min_disparity,
        numDisparities  = settings.disparities,
        blockSize       = settings.block_size,
        P1              = _P1*pixels,
        P2              = _P2*pixels,
        disp12MaxDiff   = settings.disp12_max_diff if settings.disp12_max_diff >= 0 else _NO_CHECK,
        preFilterCap    = settings.prefilter_cap,
        uniquenessRatio = settings.uniqueness_ratio,
    )


def opencv_name(kind: str) -> str:
    """Return the name of OpenCV's matcher `kind`, in the place of a device's URL."""
    return _OPENCV_PREFIX + kind


def open_matcher(name: str) -> Matcher:
    """Open a matcher by its name, a device's URL or what `opencv_name` returns; raise as `connect` does."""
    if name.startswith(_OPENCV_PREFIX):
        return OpenCVMatcher(name.removeprefix(_OPENCV_PREFIX))
    return DeviceMatcher(connect(name))


def is_shared(name: str) -> bool:
    """Return whether several processes may open the matcher at once: OpenCV's, and some devices."""
    return name.startswith(_OPENCV_PREFIX) or is_shareable(name)
