#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Transports: what carries the bytes of a serial line to and from a device."""

from __future__ import annotations

from typing import Protocol

from ...core.errors import UrlError
from ..urls import DeviceUrl


class Transport(Protocol):
    """A line of bytes to and from a device, used by one thread."""

    def write(self, data: bytes) -> None:
        """Send all of `data`; raise DeviceError if the line is gone."""

    def read(self, timeout_s: float) -> bytes:
        """Return the bytes that have arrived, waiting at most `timeout_s` for the first one; b"" if none came.

        Raises DeviceError if the line is gone.
        """

    def close(self) -> None:
        """Close the line; closing twice does no harm."""


def open_transport(url: DeviceUrl) -> Transport:
    """Open the line that a URL names.

    Raises
    ------
    UrlError
        The URL is neither tcp nor serial, or an option of it is wrong.
    DeviceError
        The line cannot be opened.
    """
    if url.scheme == "tcp":
        from .tcp import TcpTransport

        return TcpTransport(url.host, url.port)
    if url.scheme == "serial":
        from .serial_port import DEFAULT_BAUD, SerialTransport

        url.check_options("baud")
        return SerialTransport(url.path, url.integer("baud", DEFAULT_BAUD))
    raise UrlError(f"{url.text} names no line of bytes, as tcp: and serial: do")
