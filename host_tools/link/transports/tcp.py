#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""TCP transport: a simulated serial line, or a serial-to-network bridge."""

from __future__ import annotations

import socket

from ...core.errors import DeviceError, LinkTimeout

#: Seconds in which the connection must be made, and in which the other end must accept data once buffers are full.
CONNECT_TIMEOUT_S = 5.0
WRITE_TIMEOUT_S   = 15.0

_READ_BYTES = 65536


class TcpTransport:
    """A connection to `host`:`port`; raises DeviceError if it cannot be made."""

    def __init__(self, host: str, port: int) -> None:
        self._name = f"tcp://{host}:{port}"
        try:
            self._socket = socket.create_connection((host, port), timeout=CONNECT_TIMEOUT_S)
        except ConnectionRefusedError:
            raise DeviceError(f"{self._name} refused the connection: is the device running, and is this its port?"
                              ) from None
        except TimeoutError:
            raise LinkTimeout(f"{self._name} did not accept the connection within {CONNECT_TIMEOUT_S:g} s"
                              ) from None
        except OSError as error:
            raise DeviceError(f"cannot connect to {self._name}: {error.strerror or error}") from None
        # Requests are small and answered one by one: to wait until a packet is full would cost a round trip for each.
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def write(self, data: bytes) -> None:
        """Send all of `data`; raise DeviceError if the connection is gone or accepts no more data."""
        try:
            self._socket.settimeout(WRITE_TIMEOUT_S)
            self._socket.sendall(data)
        except TimeoutError:
            raise LinkTimeout(f"{self._name} accepted no data for {WRITE_TIMEOUT_S:g} s: restart the device"
                              ) from None
        except OSError as error:
            raise self._lost(error) from None

    def read(self, timeout_s: float) -> bytes:
        """Return the bytes that arrive within `timeout_s`; raise DeviceError if the connection is gone."""
        try:
            # A timeout of 0 would make the socket non-blocking, which reports it by another exception.
            self._socket.settimeout(max(timeout_s, 1e-6))
            data = self._socket.recv(_READ_BYTES)
        except TimeoutError:
            return b""
        except OSError as error:
            raise self._lost(error) from None
        if not data:
            raise DeviceError(f"{self._name} closed the connection: the device stopped, or serves another "
                              "host")
        return data

    def _lost(self, error: OSError) -> DeviceError:
        return DeviceError(f"the connection to {self._name} is lost: {error.strerror or error}")

    def close(self) -> None:
        """Close the connection."""
        self._socket.close()
