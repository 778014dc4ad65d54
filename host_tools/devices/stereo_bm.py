#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""A matcher with the methods of `cv2.StereoBM`: one changed line moves a program from the CPU to the FPGA.

    import litestereo.host_tools.devices.stereo_bm as litestereo

    matcher = litestereo.StereoBM_create(64, 21, device="serial:/dev/ttyUSB0")  # was cv2.StereoBM_create(64, 21)
"""

from __future__ import annotations

import os
import warnings
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np
from numpy.typing import NDArray

from ..core.errors import ImageError, SettingsError, UnsupportedError
from ..core.images import quiet_stderr, read_file
from ..core.outputs import write_file
from ..core.settings import RULES, MatcherSettings
from ..core.speckle import SpeckleFilter
from ..link.urls import DEVICE_VARIABLE
from .base import check_pair, choose_settings
from .connect import Device, connect

if TYPE_CHECKING:
    from typing_extensions import Self

PREFILTER_NORMALIZED_RESPONSE = 0
PREFILTER_XSOBEL              = 1

#: cv2.StereoBM's defaults by our names; its number of disparities is also what cv2.StereoBM_create(0) means.
_DEFAULTS = {name: rule.opencv_default for name, rule in RULES.items()}

#: The settings in a cv2.FileStorage: how they are called there, in this order.
_KEYS = {
    "MinDisparity":      "minDisparity",
    "NumDisparities":    "numDisparities",
    "BlockSize":         "blockSize",
    "SpeckleWindowSize": "speckleWindowSize",
    "SpeckleRange":      "speckleRange",
    "Disp12MaxDiff":     "disp12MaxDiff",
    "PreFilterType":     "preFilterType",
    "PreFilterSize":     "preFilterSize",
    "PreFilterCap":      "preFilterCap",
    "TextureThreshold":  "textureThreshold",
    "UniquenessRatio":   "uniquenessRatio",
}
_OBJECT  = "StereoMatcher.BM"
_FORMAT  = 3
_ENDINGS = (".yml", ".yaml", ".xml", ".json")

#: Most that a pixel adds to the texture of a block: the largest cap of the prefilter.
_MOST_TEXTURE = RULES["prefilter_cap"].most or 0

#: Those that have a setting of the device.
_FIELDS = {
    "MinDisparity":      "min_disparity",
    "NumDisparities":    "disparities",
    "BlockSize":         "block_size",
    "Disp12MaxDiff":     "disp12_max_diff",
    "PreFilterType":     "prefilter",
    "PreFilterCap":      "prefilter_cap",
    "TextureThreshold":  "texture_threshold",
    "UniquenessRatio":   "uniqueness_ratio",
}

Rectangle = tuple[int, int, int, int]


class StereoBM:
    """Block matcher with the methods, the defaults and the results of `cv2.StereoBM`, on a LiteStereo device.

    The map is equal to OpenCV's in the valid region, where whole blocks lie in both images, and invalid outside of it.
    OpenCV 5.0.0 writes stray values there if `minDisparity` is above 0: that many at the left edge, where the row after
    the last valid one begins. In images that are wide enough for the range, but not for a block too, it leaves the map
    as it was in memory.

    `compute` refuses settings that the hardware does not have, as cv2's does: docs/theory.md has the list. A stage
    that is on by default and that the device was built without is off, with a RuntimeWarning; one that was set is
    refused. Use it as a context manager, or `close` it, unless it was given an open device.

    Parameters
    ----------
    device
        URL of the device, to which the first `compute` connects, or an open device. None for the one that the
        environment variable LITESTEREO_DEVICE names, or else `model:`, the reference on this computer.
    num_disparities, block_size
        See `setNumDisparities` and `setBlockSize`.
    """

    def __init__(self, device: str | Device | None = None, num_disparities: int = _DEFAULTS["disparities"],
                 block_size: int = _DEFAULTS["block_size"]) -> None:
        if device is None:
            device = os.environ.get(DEVICE_VARIABLE) or "model:"
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
        # Names of the values that a caller has set: no other one may be switched off.
        self._given  = {"NumDisparities", "BlockSize"}
        self._warned = False
        self._rois: dict[str, Rectangle] = {"ROI1": (0, 0, 0, 0), "ROI2": (0, 0, 0, 0)}

    @staticmethod
    def create(numDisparities: int = 0, blockSize: int = _DEFAULTS["block_size"], *,
               device: str | Device | None = None) -> StereoBM:
        """Return a `StereoBM`, as `StereoBM_create` does."""
        return StereoBM(device, numDisparities, blockSize)

    def compute(self, left: NDArray[np.uint8], right: NDArray[np.uint8], disparity: NDArray[Any] | None = None
                ) -> NDArray[np.int16]:
        """Return the disparity map of a rectified pair.

        Parameters
        ----------
        left, right
            8-bit grey images, uint8, H x W or H x W x 1.
        disparity
            Array to write the map to, int16, H x W or H x W x 1; one of another type or size is not used, as with cv2.

        Returns
        -------
        int16, H x W, in sixteenths of a pixel; (minDisparity - 1)*16 where there is no disparity. It is `disparity` if
        that is used. Images that are too narrow for a disparity have a map without any.

        Raises
        ------
        SettingsError, UnsupportedError
            No device has a setting, or this device was not built for it.
        ImageError
            The images do not suit each other, the settings or the device.
        DeviceError
            The device is gone, or does not answer.
        """
        left, right = _plane(left), _plane(right)
        settings    = self._settings()
        speckle     = SpeckleFilter(self._values["SpeckleWindowSize"], self._values["SpeckleRange"])
        check_pair(left, right)
        if min(left.shape) < settings.block_size:
            raise ImageError(f"images of {left.shape[1]}x{left.shape[0]} pixels are too small for a block of "
                             f"{settings.block_size}x{settings.block_size}")
        if self._device is None:
            self._device = connect(self._url)
        settings = self._chosen(self._device, settings)
        result   = np.full(left.shape, settings.invalid, np.int16)
        if left.shape[1] >= settings.minimum_size[0]:
            result = speckle.apply(self._device.compute(left, right, settings).disparity, settings)
        if (isinstance(disparity, np.ndarray) and disparity.dtype == np.int16 and disparity.flags.writeable
                and disparity.shape in (left.shape, (*left.shape, 1))):
            disparity[...] = result.reshape(disparity.shape)
            return disparity
        return result

    def _chosen(self, device: Device, settings: MatcherSettings) -> MatcherSettings:
        """Return the settings without the stages that the device lacks, if they are on by default only."""
        given  = {_FIELDS[name]: getattr(settings, _FIELDS[name]) for name in self._given if name in _FIELDS}
        choice = choose_settings([device.info()], given, settings)
        if choice.missing and not self._warned:
            self._warned = True
            for notice in choice.notices:
                warnings.warn(notice, RuntimeWarning, stacklevel=3)
        return choice.settings

    def _settings(self) -> MatcherSettings:
        values = self._values
        if values["PreFilterType"] != PREFILTER_XSOBEL:
            raise UnsupportedError("PREFILTER_NORMALIZED_RESPONSE is not supported, use PREFILTER_XSOBEL: it takes "
                                   "the mean of a window from each pixel, which the gateware cannot compute")
        if any(self._rois[name] != (0, 0, 0, 0) for name in self._rois):
            raise UnsupportedError("regions of interest are not supported: cut the map instead")
        # For cv2 any negative number of pixels means no check. Two disparities never differ by as many as there are,
        # and no block has more texture than its pixels have together: larger limits mean the same.
        disp12  = max(values["Disp12MaxDiff"], -1)
        texture = values["TextureThreshold"]
        if disp12 >= values["NumDisparities"] > 0:
            disp12 = min(disp12, values["NumDisparities"])
        if texture > values["BlockSize"]**2*_MOST_TEXTURE > 0:
            texture = values["BlockSize"]**2*_MOST_TEXTURE + 1
        return MatcherSettings(
            disparities       = values["NumDisparities"],
            block_size        = values["BlockSize"],
            min_disparity     = values["MinDisparity"],
            prefilter_cap     = values["PreFilterCap"],
            texture_threshold = texture,
            uniqueness_ratio  = values["UniquenessRatio"],
            disp12_max_diff   = disp12,
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

    def write(self, fs: cv2.FileStorage, name: str = "") -> None:
        """Write the settings to a cv2.FileStorage, as cv2 does: into its top, or into a map called `name`."""
        if name:
            fs.startWriteStruct(name, cv2.FILE_NODE_MAP)
        fs.write("format", _FORMAT)
        fs.write("name", _OBJECT)
        for value, key in _KEYS.items():
            fs.write(key, self._values[value])
        if name:
            fs.endWriteStruct()

    def save(self, filename: str | Path) -> None:
        """Write the settings to a file that cv2.StereoBM reads: .yml, .yaml, .xml or .json.

        Raises
        ------
        ImageError
            The file cannot be written, or has another ending.
        """
        path = Path(filename)
        if path.suffix.lower() not in _ENDINGS:
            raise ImageError(f"{path}: cannot be written: the ending must be one of {', '.join(_ENDINGS)}")
        storage = cv2.FileStorage(path.suffix.lower(), cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY)
        self.write(storage, self.getDefaultName())
        write_file(path, storage.releaseAndGetString().encode())

    def read(self, fn: cv2.FileNode) -> None:
        """Read the settings from a node of a cv2.FileStorage; nothing is changed by one that is refused.

        Raises
        ------
        SettingsError
            The node is not of a StereoBM, or a value is missing.
        """
        if not fn.isMap() or not fn.getNode("name").isString() or fn.getNode("name").string() != _OBJECT:
            raise SettingsError(f"this is no {_OBJECT}, as cv2.StereoBM and this class write it")
        for key in _KEYS.values():
            if not fn.getNode(key).isInt():
                raise SettingsError(f"{_OBJECT} has no whole number {key}")
        for value, key in _KEYS.items():
            self._number(value, int(fn.getNode(key).real()))

    def load(self, filename: str | Path) -> None:
        """Read the settings from a file that cv2.StereoBM or `save` has written.

        Raises
        ------
        ImageError
            The file cannot be read.
        SettingsError
            It is not of a StereoBM.
        """
        text = read_file(Path(filename)).decode("utf-8", "replace")
        try:
            with quiet_stderr():
                storage = cv2.FileStorage(text, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
            node = storage.getFirstTopLevelNode()
        except (cv2.error, SystemError):
            raise SettingsError(f"{filename}: is no file of cv2.FileStorage") from None
        self.read(node)

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
        self._given.add(name)

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


def _plane(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return H x W of an image of H x W x 1, which is one too; others as they are."""
    return image[:, :, 0] if image.ndim == 3 and image.shape[2] == 1 else image


def StereoBM_create(numDisparities: int = 0, blockSize: int = _DEFAULTS["block_size"], *,
                    device: str | Device | None = None) -> StereoBM:
    """Return a `StereoBM`, as `cv2.StereoBM_create` does.

    `device` is a URL, or an open device; None for what the environment variable LITESTEREO_DEVICE names, or `model:`.
    """
    return StereoBM(device, numDisparities, blockSize)
