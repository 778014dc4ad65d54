#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Errors of the host tools: each message is one line that says what is wrong and what to do about it.

::

    LiteStereoError
    ├── UsageError              wrong call: exit status 2
    │   ├── UrlError            device URL
    │   └── SettingsError       matcher parameter, on any device
    ├── UnsupportedError        matcher parameter, on this device
    ├── ImageError              file or image
    ├── FirmwareError           firmware file
    ├── GeometryError           cameras
    ├── DatasetError            data set
    ├── WorkerError             processes or Dask cluster
    ├── MissingExtraError       package
    ├── OpenCVError             OpenCV
    ├── ViewerError             viewer or recording
    ├── DeviceError             device or its link
    │   ├── LinkTimeout         no answer
    │   ├── SessionLost         session ended by the device
    │   └── DeviceRefused       ERROR reply
    │       └── UpdateFailed    firmware refused
    └── ProtocolError           bytes of the link
"""


class LiteStereoError(Exception):
    """Base of all errors whose cause is outside of the host tools' own code."""


class UsageError(LiteStereoError):
    """A wrong call: an argument that is malformed, or impossible on every device."""


class UrlError(UsageError):
    """A device URL that cannot be parsed."""


class SettingsError(UsageError):
    """A matcher parameter whose value no device accepts."""


class UnsupportedError(LiteStereoError):
    """A matcher parameter that this device was not built for."""


class ImageError(LiteStereoError):
    """A file that cannot be read or written, or images that do not fit each other or the device."""


class FirmwareError(LiteStereoError):
    """A firmware file that cannot be read, is damaged, or is not for this device."""


class GeometryError(LiteStereoError):
    """Cameras that cannot be one rectified pair, or a calibration that cannot be read."""


class DatasetError(LiteStereoError):
    """A data set that is missing, cannot be downloaded, or contradicts itself."""


class WorkerError(LiteStereoError):
    """A worker process or a Dask cluster that is missing or has failed."""


class MissingExtraError(LiteStereoError):
    """A package that only some commands need is not installed."""


class OpenCVError(LiteStereoError):
    """OpenCV is not installed: there is no module `cv2`."""


class ViewerError(LiteStereoError):
    """A viewer that cannot be started or reached, or a recording that cannot be written."""


class DeviceError(LiteStereoError):
    """A device that cannot be reached, or fails while it is used."""


class LinkTimeout(DeviceError):
    """A device that does not answer within a bounded time."""


class SessionLost(DeviceError):
    """A session that the device has ended: another host said hello, or the device restarted."""


class DeviceRefused(DeviceError):
    """An ERROR reply.

    `code` and `detail` are the numbers of the protocol's table of errors.
    """

    def __init__(self, message: str, code: int, detail: int) -> None:
        super().__init__(message)
        self.code   = code
        self.detail = detail


class UpdateFailed(DeviceRefused):
    """A firmware that the device has refused; `code` is a failure of the protocol's table of progress."""


class ProtocolError(LiteStereoError):
    """Bytes that violate the link protocol, or a protocol version that this host does not support."""
