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
from ..core.settings import MatcherSettings
from ..core.speckle import SpeckleFilter
from .connect import Device, connect

if TYPE_CHECKING:
    from typing_extensions import Self

PREFILTER_NORMALIZED_RESPONSE = 0
PREFILTER_XSOBEL              = 1

#: cv2.StereoBM_create(0) means this.
_DEFAULT_DISPARITIES = 64

Rectangle = tuple[int, int, int, int]


class StereoBM:
    """Block matcher with the methods, the defaults and the results of `cv2.StereoBM`, on a LiteStereo device.

    A setting that the hardware does not have is refused when `compute` is called, as cv2 does it. Use it as a context
    manager, or `close` it, unless it was given an open device.

    Parameters
    ----------
    device
        URL of the device, which is connected to by the first `compute`, or an open device.
    num_disparities, block_size
        As `setNumDisparities` and `setBlockSize` take them.
    """

    def __init__(self, device: str | Device, num_disparities: int = _DEFAULT_DISPARITIES,
                 block_size: int = 21) -> None:
        self._url    = device if isinstance(device, str) else ""
        self._device = None if isinstance(device, str) else device
        self._values = {
            "MinDisparity":      0,
            "NumDisparities":    num_disparities or _DEFAULT_DISPARITIES,
            "BlockSize":         block_size,
            "SpeckleWindowSize": 0,
            "SpeckleRange":      0,
            "Disp12MaxDiff":     -1,
            "PreFilterType":     PREFILTER_XSOBEL,
            "PreFilterSize":     9,
            "PreFilterCap":      31,
            "TextureThreshold":  10,
            "UniquenessRatio":   15,
        }
        self._rois: dict[str, Rectangle] = {"ROI1": (0, 0, 0, 0), "ROI2": (0, 0, 0, 0)}

    def compute(self, left: NDArray[np.uint8], right: NDArray[np.uint8]) -> NDArray[np.int16]:
        """Disparity map of a rectified pair.

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
            A setting that no device takes, or that this device was not built for.
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
                                   "the mean of a window of its own from each pixel, which the gateware has not")
        if any(self._rois[name] != (0, 0, 0, 0) for name in self._rois):
            raise UnsupportedError("regions of interest are not supported: cut the map instead")
        # Any negative number of pixels means no check to cv2.
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
        """Lets go of a device that this object has connected to."""
        if self._url and self._device is not None:
            self._device.close()
            self._device = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        self.close()

    def clear(self) -> None:
        """Nothing is kept from one pair to the next."""

    def empty(self) -> bool:
        """False, as cv2's."""
        return False

    def getDefaultName(self) -> str:
        """"my_object", as cv2's."""
        return "my_object"

    # cv2's accessors, whose values are checked by `compute`.

    def _number(self, name: str, value: int) -> None:
        if int(value) != value:
            raise SettingsError(f"{name} must be a whole number, not {value}")
        self._values[name] = int(value)

    def getMinDisparity(self) -> int:
        """Smallest disparity, 0 to 255 pixels."""
        return self._values["MinDisparity"]

    def setMinDisparity(self, value: int) -> None:
        """Sets it; see `getMinDisparity`."""
        self._number("MinDisparity", value)

    def getNumDisparities(self) -> int:
        """Number of disparities searched, a multiple of 16."""
        return self._values["NumDisparities"]

    def setNumDisparities(self, value: int) -> None:
        """Sets it; see `getNumDisparities`."""
        self._number("NumDisparities", value)

    def getBlockSize(self) -> int:
        """Side of the block in pixels, odd, at least 5."""
        return self._values["BlockSize"]

    def setBlockSize(self, value: int) -> None:
        """Sets it; see `getBlockSize`."""
        self._number("BlockSize", value)

    def getSpeckleWindowSize(self) -> int:
        """Largest number of pixels of an island that is removed; 0 for no filter."""
        return self._values["SpeckleWindowSize"]

    def setSpeckleWindowSize(self, value: int) -> None:
        """Sets it; see `getSpeckleWindowSize`."""
        self._number("SpeckleWindowSize", value)

    def getSpeckleRange(self) -> int:
        """Largest difference within an island, in sixteenths of a pixel."""
        return self._values["SpeckleRange"]

    def setSpeckleRange(self, value: int) -> None:
        """Sets it; see `getSpeckleRange`."""
        self._number("SpeckleRange", value)

    def getDisp12MaxDiff(self) -> int:
        """Largest difference in the left-right check, pixels; negative for no check."""
        return self._values["Disp12MaxDiff"]

    def setDisp12MaxDiff(self, value: int) -> None:
        """Sets it; see `getDisp12MaxDiff`."""
        self._number("Disp12MaxDiff", value)

    def getPreFilterType(self) -> int:
        """PREFILTER_XSOBEL."""
        return self._values["PreFilterType"]

    def setPreFilterType(self, value: int) -> None:
        """Sets it; see `getPreFilterType`."""
        self._number("PreFilterType", value)

    def getPreFilterSize(self) -> int:
        """Window of PREFILTER_NORMALIZED_RESPONSE: without effect."""
        return self._values["PreFilterSize"]

    def setPreFilterSize(self, value: int) -> None:
        """Sets it; see `getPreFilterSize`."""
        self._number("PreFilterSize", value)

    def getPreFilterCap(self) -> int:
        """Largest slope that the prefilter keeps, 1 to 63."""
        return self._values["PreFilterCap"]

    def setPreFilterCap(self, value: int) -> None:
        """Sets it; see `getPreFilterCap`."""
        self._number("PreFilterCap", value)

    def getTextureThreshold(self) -> int:
        """Least texture of a block."""
        return self._values["TextureThreshold"]

    def setTextureThreshold(self, value: int) -> None:
        """Sets it; see `getTextureThreshold`."""
        self._number("TextureThreshold", value)

    def getUniquenessRatio(self) -> int:
        """By how many percent more any other disparity must cost, 0 to 100."""
        return self._values["UniquenessRatio"]

    def setUniquenessRatio(self, value: int) -> None:
        """Sets it; see `getUniquenessRatio`."""
        self._number("UniquenessRatio", value)

    def getSmallerBlockSize(self) -> int:
        """0, as cv2's."""
        return 0

    def setSmallerBlockSize(self, value: int) -> None:
        """Without effect, as cv2's."""

    def getROI1(self) -> Rectangle:
        """Valid region of the left image, which cv2 cuts the map to."""
        return self._rois["ROI1"]

    def setROI1(self, value: Rectangle) -> None:
        """Sets it; see `getROI1`."""
        self._rois["ROI1"] = value

    def getROI2(self) -> Rectangle:
        """Valid region of the right image, which cv2 cuts the map to."""
        return self._rois["ROI2"]

    def setROI2(self, value: Rectangle) -> None:
        """Sets it; see `getROI2`."""
        self._rois["ROI2"] = value


def StereoBM_create(numDisparities: int = 0, blockSize: int = 21, *, device: str | Device = "sim:") -> StereoBM:
    """As `cv2.StereoBM_create`, and which device to use: its URL, or an open one."""
    return StereoBM(device, numDisparities, blockSize)
