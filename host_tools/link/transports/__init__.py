#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Byte transports: the ways to a device that carry the serial line's bytes."""

from __future__ import annotations

from typing import Protocol

from ...core.errors import UrlError
from ..urls import DeviceUrl


class Transport(Protocol):
    """A line of bytes to and from a device, used by one thread."""

    def write(self, data: bytes) -> None:
        """Sends all of `data`; raises DeviceError if the line is gone."""

    def read(self, timeout_s: float) -> bytes:
        """Bytes that have arrived, waiting at most `timeout_s` for the first of them; none if none came.

        Raises DeviceError if the line is gone.
        """

    def close(self) -> None:
        """Closes the line; closing twice does no harm."""


def open_transport(url: DeviceUrl) -> Transport:
    """Opens the line that a tcp or serial URL names; raises DeviceError if it cannot be opened."""
    if url.scheme == "tcp":
        from .tcp import TcpTransport

        return TcpTransport(url.host, url.port)
    if url.scheme == "serial":
        from .serial_port import DEFAULT_BAUD, SerialTransport

        url.check_options("baud")
        return SerialTransport(url.path, url.integer("baud", DEFAULT_BAUD))
    raise UrlError(f"{url.text} names no line of bytes, as tcp: and serial: do")
