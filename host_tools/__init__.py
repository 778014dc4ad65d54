"""Host side of LiteStereo: devices, link protocol, images, metrics and the `litestereo` command.

The names below can be imported from here; each loads its module when it is first used, so that
`import litestereo.host_tools` itself costs nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .calibration.rectify import Rectifier, read_calibration
    from .call import LinkSettings
    from .device import connect
    from .devices.base import Device, DeviceInfo, Result
    from .errors import LiteStereoError
    from .geometry import StereoGeometry
    from .images import disparity_pixels, read_grey, write_disparity
    from .settings import MatcherSettings
    from .sources import open_source
    from .speckle import SpeckleFilter
    from .stereo_bm import StereoBM, StereoBM_create

__all__ = ["Device", "DeviceInfo", "LinkSettings", "LiteStereoError", "MatcherSettings", "Rectifier", "Result",
           "SpeckleFilter", "StereoBM", "StereoBM_create", "StereoGeometry", "connect", "disparity_pixels",
           "open_source", "read_calibration", "read_grey", "write_disparity"]

#: Modules of the names.
_MODULES = {
    "Device":           "devices.base",
    "DeviceInfo":       "devices.base",
    "LinkSettings":     "call",
    "LiteStereoError":  "errors",
    "MatcherSettings":  "settings",
    "Rectifier":        "calibration.rectify",
    "Result":           "devices.base",
    "SpeckleFilter":    "speckle",
    "StereoBM":         "stereo_bm",
    "StereoBM_create":  "stereo_bm",
    "StereoGeometry":   "geometry",
    "connect":          "device",
    "disparity_pixels": "images",
    "open_source":      "sources",
    "read_calibration": "calibration.rectify",
    "read_grey":        "images",
    "write_disparity":  "images",
}


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f".{_MODULES[name]}", __name__), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
