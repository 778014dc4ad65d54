#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Host side of LiteStereo: the public names of the host tools.

Programs import from here alone; the modules below are not a stable interface. Each name loads its module when it is
first used, so `import litestereo.host_tools` itself loads no other package. The command is `litestereo`, in `cli`.
"""

from __future__ import annotations

import importlib
import sys
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .cameras.rectify import Rectifier, read_calibration
    from .core.decimation import DecimationFilter
    from .core.disparity_map import DisparityMap
    from .core.errors import (
        DatasetError,
        DeviceError,
        DeviceRefused,
        FirmwareError,
        GeometryError,
        ImageError,
        LinkTimeout,
        LiteStereoError,
        MissingExtraError,
        OpenCVError,
        ProtocolError,
        SessionLost,
        SettingsError,
        UnsupportedError,
        UpdateFailed,
        UrlError,
        UsageError,
        ViewerError,
        WorkerError,
    )
    from .core.features import Feature
    from .core.filters import FilterChain
    from .core.geometry import StereoGeometry
    from .core.hole_filling import HoleFillingFilter
    from .core.images import disparity_pixels, read_grey, write_disparity
    from .core.settings import MatcherSettings
    from .core.spatial import SpatialFilter
    from .core.speckle import SpeckleFilter, SpeckleMapFilter
    from .core.temporal import TemporalFilter
    from .core.threshold import ThresholdFilter
    from .data.ground_truth import read_ground_truth
    from .data.sources import Shortfall, Shot, Source, open_source
    from .devices.base import Device, DeviceInfo, Result
    from .devices.connect import connect
    from .devices.stereo_bm import StereoBM, StereoBM_create
    from .evaluation.metrics import measure_map
    from .link.settings import LinkSettings

__all__ = ["DatasetError", "DecimationFilter", "Device", "DeviceError", "DeviceInfo", "DeviceRefused", "DisparityMap",
           "Feature", "FilterChain", "FirmwareError", "GeometryError", "HoleFillingFilter", "ImageError",
           "LinkSettings", "LinkTimeout", "LiteStereoError", "MatcherSettings", "MissingExtraError", "OpenCVError",
           "ProtocolError", "Rectifier", "Result", "SessionLost", "SettingsError", "Shortfall", "Shot", "Source",
           "SpatialFilter", "SpeckleFilter", "SpeckleMapFilter", "StereoBM", "StereoBM_create", "StereoGeometry",
           "TemporalFilter", "ThresholdFilter", "UnsupportedError", "UpdateFailed", "UrlError", "UsageError",
           "ViewerError", "WorkerError", "connect", "disparity_pixels", "measure_map", "open_source",
           "read_calibration", "read_grey", "read_ground_truth", "write_disparity"]

#: Modules of the names.
_MODULES = {
    "DatasetError":      "core.errors",
    "DecimationFilter":  "core.decimation",
    "Device":            "devices.base",
    "DeviceError":       "core.errors",
    "DeviceInfo":        "devices.base",
    "DeviceRefused":     "core.errors",
    "DisparityMap":      "core.disparity_map",
    "Feature":           "core.features",
    "FilterChain":       "core.filters",
    "FirmwareError":     "core.errors",
    "GeometryError":     "core.errors",
    "HoleFillingFilter": "core.hole_filling",
    "ImageError":        "core.errors",
    "LinkSettings":      "link.settings",
    "LinkTimeout":       "core.errors",
    "LiteStereoError":   "core.errors",
    "MatcherSettings":   "core.settings",
    "MissingExtraError": "core.errors",
    "OpenCVError":       "core.errors",
    "ProtocolError":     "core.errors",
    "Rectifier":         "cameras.rectify",
    "Result":            "devices.base",
    "SessionLost":       "core.errors",
    "SettingsError":     "core.errors",
    "Shortfall":         "data.sources",
    "Shot":              "data.sources",
    "Source":            "data.sources",
    "SpatialFilter":     "core.spatial",
    "SpeckleFilter":     "core.speckle",
    "SpeckleMapFilter":  "core.speckle",
    "StereoBM":          "devices.stereo_bm",
    "StereoBM_create":   "devices.stereo_bm",
    "StereoGeometry":    "core.geometry",
    "TemporalFilter":    "core.temporal",
    "ThresholdFilter":   "core.threshold",
    "UnsupportedError":  "core.errors",
    "UpdateFailed":      "core.errors",
    "UrlError":          "core.errors",
    "UsageError":        "core.errors",
    "ViewerError":       "core.errors",
    "WorkerError":       "core.errors",
    "connect":           "devices.connect",
    "disparity_pixels":  "core.images",
    "measure_map":       "evaluation.metrics",
    "open_source":       "data.sources",
    "read_calibration":  "cameras.rectify",
    "read_grey":         "core.images",
    "read_ground_truth": "data.ground_truth",
    "write_disparity":   "core.images",
}


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    try:
        module = importlib.import_module(f".{_MODULES[name]}", __name__)
    except ModuleNotFoundError as error:
        if error.name == "cv2":
            importlib.import_module(".core.opencv", __name__).check_opencv() # Raises: what is missing, what to do.
        raise
    if sys.modules.get("cv2"):
        importlib.import_module(".core.opencv", __name__).warn_once()
    return getattr(module, name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
