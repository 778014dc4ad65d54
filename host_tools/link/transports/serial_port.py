#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Serial transport: a UART at a tty."""

from __future__ import annotations

import errno

import serial

from ...core.errors import DeviceError, LinkTimeout

#: Speed in bits per second unless the URL says otherwise.
DEFAULT_BAUD = 1_000_000

#: Seconds in which the port must accept data.
_WRITE_TIMEOUT_S = 15.0

_REASONS = {
    errno.ENOENT: "there is no such port: is the device plugged in?",
    errno.EACCES: "access is denied: your user needs permission for the port",
    errno.EBUSY:  "the port is busy: close the other program that uses it",
    errno.EAGAIN: "the port is busy: close the other program that uses it",
}


class SerialTransport:
    """A tty, 8N1.

    Parameters
    ----------
    path
        The port, such as /dev/ttyUSB0.
    baud
        Bits per second.

    Raises
    ------
    DeviceError
        The port cannot be opened.
    """

    def __init__(self, path: str, baud: int) -> None:
        self._path = path
        try:
            self._port = serial.Serial(path, baud, write_timeout=_WRITE_TIMEOUT_S, exclusive=True)
        except serial.SerialException as error:
            reason = _REASONS.get(error.errno or 0, f"it is no serial port that can run at {baud} baud")
            raise DeviceError(f"cannot open {path}: {reason}") from None
        except (OSError, ValueError) as error:
            raise DeviceError(f"cannot open {path} at {baud} baud: {error}") from None

    def write(self, data: bytes) -> None:
        """Send all of `data`; raise DeviceError if the port is gone or accepts no more data."""
        try:
            self._port.write(data)
        except serial.SerialTimeoutException:
            raise LinkTimeout(f"{self._path} accepted no data for {_WRITE_TIMEOUT_S:g} s: restart the device"
                              ) from None
        except (OSError, serial.SerialException):
            raise self._lost() from None

    def read(self, timeout_s: float) -> bytes:
        """Return the bytes that arrive within `timeout_s`; raise DeviceError if the port is gone."""
        try:
            self._port.timeout = timeout_s
            first = self._port.read(1)
            return bytes(first + self._port.read(self._port.in_waiting)) if first else b""
        except (OSError, serial.SerialException):
            raise self._lost() from None

    def _lost(self) -> DeviceError:
        return DeviceError(f"{self._path} is gone: is the device unplugged, or does another program use it?")

    def close(self) -> None:
        """Close the port."""
        self._port.close()
