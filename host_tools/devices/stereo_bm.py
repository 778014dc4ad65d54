#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""A matcher with the methods of `cv2.StereoBM`: one changed line moves a program from the CPU to the FPGA.

    import litestereo.host_tools.devices.stereo_bm as litestereo

    matcher = litestereo.StereoBM_create(64, 21, device="serial:/dev/ttyUSB0")  # was cv2.StereoBM_create(64, 21)
"""

from __future__ import annotations

from types import TracebackType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..core.errors import SettingsError, UnsupportedError
from ..core.settings import RULES, MatcherSettings
from ..core.speckle import SpeckleFilter
from .connect import Device, connect

if TYPE_CHECKING:
    from typing_extensions import Self

PREFILTER_NORMALIZED_RESPONSE = 0
PREFILTER_XSOBEL              = 1

#: cv2.StereoBM's defaults by our names; its number of disparities is also what cv2.StereoBM_create(0) means.
_DEFAULTS = {name: rule.opencv_default for name, rule in RULES.items()}

Rectangle = tuple[int, int, int, int]


class StereoBM:
    """Block matcher with the methods, the defaults and the results of `cv2.StereoBM`, on a LiteStereo device.

    `compute` refuses settings that the hardware does not have, as cv2's does. Use it as a context manager, or `close`
    it, unless it was given an open device.

    Parameters
    ----------
    device
        URL of the device, to which the first `compute` connects, or an open device.
    num_disparities, block_size
        See `setNumDisparities` and `setBlockSize`.
    """

    def __init__(self, device: str | Device, num_disparities: int = _DEFAULTS["disparities"],
                 block_size: int = _DEFAULTS["block_size"]) -> None:
        self._url    = device if isinstance(device, str) else ""
        self._device = None if isinstance(device, str) else device
        self._values = {
            "MinDisparity":      _DEFAULTS["min_disparity"],
            "NumDisparities":    num_disparities or _DEFAULTS["disparities"],
            "BlockSize":         block_size,
            "SpeckleWindowSize": 0,
            "SpeckleRange":      0,
            "Disp12MaxDiff":     _DEFAULTS["disp12_max_diff"],
            "PreFilterType":     PREFILTER_XSOBEL,
            "PreFilterSize":     9,
            "PreFilterCap":      _DEFAULTS["prefilter_cap"],
            "TextureThreshold":  _DEFAULTS["texture_threshold"],
            "UniquenessRatio":   _DEFAULTS["uniqueness_ratio"],
        }
        self._rois: dict[str, Rectangle] = {"ROI1": (0, 0, 0, 0), "ROI2": (0, 0, 0, 0)}

    def compute(self, left: NDArray[np.uint8], right: NDArray[np.uint8]) -> NDArray[np.int16]:
        """Return the disparity map of a rectified pair.

        Parameters
        ----------
        left, right
            8-bit grey images, uint8, H x W.

        Returns
        -------
        int16, H x W, in sixteenths of a pixel; (minDisparity - 1)*16 where there is no disparity.

        Raises
        ------
        SettingsError, UnsupportedError
            No device has a setting, or this device was not built for it.
        ImageError
            The images do not suit each other, the settings or the device.
        DeviceError
            The device is gone, or does not answer.
        """
        settings = self._settings()
        speckle  = SpeckleFilter(self._values["SpeckleWindowSize"], self._values["SpeckleRange"])
        if self._device is None:
            self._device = connect(self._url)
        return speckle.apply(self._device.compute(left, right, settings).disparity, settings)

    def _settings(self) -> MatcherSettings:
        values = self._values
        if values["PreFilterType"] != PREFILTER_XSOBEL:
            raise UnsupportedError("PREFILTER_NORMALIZED_RESPONSE is not supported, use PREFILTER_XSOBEL: it takes "
                                   "the mean of a window from each pixel, which the gateware cannot compute")
        if any(self._rois[name] != (0, 0, 0, 0) for name in self._rois):
            raise UnsupportedError("regions of interest are not supported: cut the map instead")
        # For cv2 any negative number of pixels means no check.
        return MatcherSettings(
            disparities       = values["NumDisparities"],
            block_size        = values["BlockSize"],
            min_disparity     = values["MinDisparity"],
            prefilter_cap     = values["PreFilterCap"],
            texture_threshold = values["TextureThreshold"],
            uniqueness_ratio  = values["UniquenessRatio"],
            disp12_max_diff   = max(values["Disp12MaxDiff"], -1),
        )

    def close(self) -> None:
        """Close the device that this object has connected to."""
        if self._url and self._device is not None:
            self._device.close()
            self._device = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        self.close()

    def clear(self) -> None:
        """Do nothing: no state is kept from one pair to the next."""

    def empty(self) -> bool:
        """Return False, as cv2 does."""
        return False

    def getDefaultName(self) -> str:
        """Return "my_object", as cv2 does."""
        return "my_object"

    # cv2's accessors; `compute` checks the values.

    def _number(self, name: str, value: int) -> None:
        if int(value) != value:
            raise SettingsError(f"{name} must be a whole number, not {value}")
        self._values[name] = int(value)

    def getMinDisparity(self) -> int:
        """Return the smallest disparity, 0 to 255 pixels."""
        return self._values["MinDisparity"]

    def setMinDisparity(self, value: int) -> None:
        """Set it; see `getMinDisparity`."""
        self._number("MinDisparity", value)

    def getNumDisparities(self) -> int:
        """Return the number of disparities searched, a multiple of 16."""
        return self._values["NumDisparities"]

    def setNumDisparities(self, value: int) -> None:
        """Set it; see `getNumDisparities`."""
        self._number("NumDisparities", value)

    def getBlockSize(self) -> int:
        """Return the side of the block in pixels, odd, at least 5."""
        return self._values["BlockSize"]

    def setBlockSize(self, value: int) -> None:
        """Set it; see `getBlockSize`."""
        self._number("BlockSize", value)

    def getSpeckleWindowSize(self) -> int:
        """Return the largest number of pixels of an island that is removed; 0 means no filter."""
        return self._values["SpeckleWindowSize"]

    def setSpeckleWindowSize(self, value: int) -> None:
        """Set it; see `getSpeckleWindowSize`."""
        self._number("SpeckleWindowSize", value)

    def getSpeckleRange(self) -> int:
        """Return the largest difference within an island, in sixteenths of a pixel."""
        return self._values["SpeckleRange"]

    def setSpeckleRange(self, value: int) -> None:
        """Set it; see `getSpeckleRange`."""
        self._number("SpeckleRange", value)

    def getDisp12MaxDiff(self) -> int:
        """Return the largest difference in the left-right check, in pixels; negative means no check."""
        return self._values["Disp12MaxDiff"]

    def setDisp12MaxDiff(self, value: int) -> None:
        """Set it; see `getDisp12MaxDiff`."""
        self._number("Disp12MaxDiff", value)

    def getPreFilterType(self) -> int:
        """Return the type of the prefilter; `compute` accepts PREFILTER_XSOBEL only."""
        return self._values["PreFilterType"]

    def setPreFilterType(self, value: int) -> None:
        """Set it; see `getPreFilterType`."""
        self._number("PreFilterType", value)

    def getPreFilterSize(self) -> int:
        """Return the window of PREFILTER_NORMALIZED_RESPONSE, which has no effect."""
        return self._values["PreFilterSize"]

    def setPreFilterSize(self, value: int) -> None:
        """Set it; see `getPreFilterSize`."""
        self._number("PreFilterSize", value)

    def getPreFilterCap(self) -> int:
        """Return the largest slope that the prefilter keeps, 1 to 63."""
        return self._values["PreFilterCap"]

    def setPreFilterCap(self, value: int) -> None:
        """Set it; see `getPreFilterCap`."""
        self._number("PreFilterCap", value)

    def getTextureThreshold(self) -> int:
        """Return the least texture of a block."""
        return self._values["TextureThreshold"]

    def setTextureThreshold(self, value: int) -> None:
        """Set it; see `getTextureThreshold`."""
        self._number("TextureThreshold", value)

    def getUniquenessRatio(self) -> int:
        """Return by how many percent more any other disparity must cost, 0 to 100."""
        return self._values["UniquenessRatio"]

    def setUniquenessRatio(self, value: int) -> None:
        """Set it; see `getUniquenessRatio`."""
        self._number("UniquenessRatio", value)

    def getSmallerBlockSize(self) -> int:
        """Return 0, as cv2 does."""
        return 0

    def setSmallerBlockSize(self, value: int) -> None:
        """Do nothing, as cv2 does."""

    def getROI1(self) -> Rectangle:
        """Return the valid region of the left image, to which cv2 cuts the map."""
        return self._rois["ROI1"]

    def setROI1(self, value: Rectangle) -> None:
        """Set it; see `getROI1`."""
        self._rois["ROI1"] = value

    def getROI2(self) -> Rectangle:
        """Return the valid region of the right image, to which cv2 cuts the map."""
        return self._rois["ROI2"]

    def setROI2(self, value: Rectangle) -> None:
        """Set it; see `getROI2`."""
        self._rois["ROI2"] = value


def StereoBM_create(numDisparities: int = 0, blockSize: int = _DEFAULTS["block_size"], *,
                    device: str | Device = "sim:") -> StereoBM:
    """Return a `StereoBM`, as `cv2.StereoBM_create` does; `device` is a URL, or an open device."""
    return StereoBM(device, numDisparities, blockSize)
