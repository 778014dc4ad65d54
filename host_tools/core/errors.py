#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Errors of the host tools: each message is one line that says what is wrong and what to do about it."""


class LiteStereoError(Exception):
    """Base of every error that the host tools raise for a reason outside of their own code."""


class UsageError(LiteStereoError):
    """An argument that no device could accept: a malformed URL, an impossible parameter."""


class UrlError(UsageError):
    """A device URL that cannot be understood."""


class SettingsError(UsageError):
    """A matcher parameter with a value that no device takes."""


class UnsupportedError(LiteStereoError):
    """A matcher parameter that this device was not built for."""


class ImageError(LiteStereoError):
    """A file that is not to be read or written, or images that do not fit each other or the device."""


class FirmwareError(LiteStereoError):
    """A file that is not to be read, is damaged, or is no firmware for the device."""


class GeometryError(LiteStereoError):
    """Cameras that cannot be: a focal length or a baseline that is not above 0."""


class DatasetError(LiteStereoError):
    """A data set that is neither in the cache nor to be fetched."""


class WorkerError(LiteStereoError):
    """Processes, or a Dask cluster, that are not there or do not do what they were asked to."""


class MissingExtraError(LiteStereoError):
    """A package that only some commands need, and that is not installed."""


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
    """A firmware that the device gave up; `code` is a failure of the protocol's table of progress."""


class ProtocolError(LiteStereoError):
    """Bytes that are not what the link protocol says, or a protocol version that this host does not speak."""
