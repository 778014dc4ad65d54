"""Host side of LiteStereo: devices, link protocol, images, metrics and the `litestereo` command.

The names below can be imported from here; each loads its module when it is first used, so that
`import litestereo.host_tools` itself costs nothing.
"""

from __future__ import annotations

import importlib
import sys
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .cameras.rectify import Rectifier, read_calibration
    from .core.errors import LiteStereoError
    from .core.geometry import StereoGeometry
    from .core.images import disparity_pixels, read_grey, write_disparity
    from .core.settings import MatcherSettings
    from .core.speckle import SpeckleFilter
    from .data.sources import open_source
    from .devices.base import Device, DeviceInfo, Result
    from .devices.connect import connect
    from .devices.stereo_bm import StereoBM, StereoBM_create
    from .link.settings import LinkSettings

__all__ = ["Device", "DeviceInfo", "LinkSettings", "LiteStereoError", "MatcherSettings", "Rectifier", "Result",
           "SpeckleFilter", "StereoBM", "StereoBM_create", "StereoGeometry", "connect", "disparity_pixels",
           "open_source", "read_calibration", "read_grey", "write_disparity"]

#: Modules of the names.
_MODULES = {
    "Device":           "devices.base",
    "DeviceInfo":       "devices.base",
    "LinkSettings":     "link.settings",
    "LiteStereoError":  "core.errors",
    "MatcherSettings":  "core.settings",
    "Rectifier":        "cameras.rectify",
    "Result":           "devices.base",
    "SpeckleFilter":    "core.speckle",
    "StereoBM":         "devices.stereo_bm",
    "StereoBM_create":  "devices.stereo_bm",
    "StereoGeometry":   "core.geometry",
    "connect":          "devices.connect",
    "disparity_pixels": "core.images",
    "open_source":      "data.sources",
    "read_calibration": "cameras.rectify",
    "read_grey":        "core.images",
    "write_disparity":  "core.images",
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
