#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""TCP transport: a simulated serial line, or a serial-to-network bridge."""

from __future__ import annotations

import socket

from ...core.errors import DeviceError, LinkTimeout

#: Time in seconds for the connection to be made, and for data to be taken once the buffers are full.
CONNECT_TIMEOUT_S = 5.0
WRITE_TIMEOUT_S   = 15.0

_READ_BYTES = 65536


class TcpTransport:
    """A connection to `host`:`port`; raises DeviceError if there is none to be had."""

    def __init__(self, host: str, port: int) -> None:
        self._name = f"tcp://{host}:{port}"
        try:
            self._socket = socket.create_connection((host, port), timeout=CONNECT_TIMEOUT_S)
        except ConnectionRefusedError:
            raise DeviceError(f"{self._name} refused the connection: is the device running, and the port "
                              "right?") from None
        except TimeoutError:
            raise LinkTimeout(f"{self._name} did not accept the connection within {CONNECT_TIMEOUT_S:g} s"
                              ) from None
        except OSError as error:
            raise DeviceError(f"cannot connect to {self._name}: {error.strerror or error}") from None
        # Requests are small and answered one by one: waiting to fill a packet would cost a round trip each.
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def write(self, data: bytes) -> None:
        """Sends all of `data`; raises DeviceError if the connection is gone or takes nothing any more."""
        try:
            self._socket.settimeout(WRITE_TIMEOUT_S)
            self._socket.sendall(data)
        except TimeoutError:
            raise LinkTimeout(f"{self._name} took no data for {WRITE_TIMEOUT_S:g} s: restart the device"
                              ) from None
        except OSError as error:
            raise self._lost(error) from None

    def read(self, timeout_s: float) -> bytes:
        """Bytes that have arrived within `timeout_s`; raises DeviceError if the connection is gone."""
        try:
            # A timeout of 0 would make the socket non-blocking, which reports in another way.
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
        """Closes the connection."""
        self._socket.close()
