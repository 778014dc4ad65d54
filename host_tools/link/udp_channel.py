#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Messages as datagrams."""

from __future__ import annotations

import contextlib
import errno
import select
import socket

from ..core.errors import DeviceError, ProtocolError
from ..protocol.messages import CHUNK_BYTES, Message, MessageType, pack_header
from .timing import RoundTrip

#: Room for datagrams in bytes, each way; the kernel may give less.
_BUFFER_BYTES = 4 << 20

#: What a datagram of a whole chunk takes of that room, with the kernel's own data.
_DATAGRAM_BYTES = 2560

#: More than any message; a datagram that is longer is cut, and no message either way.
_READ_BYTES = 2048

#: Datagrams that are taken in at once, so that time limits are looked at under a flood too.
_MOST_AT_ONCE = 256

_REASONS = {
    errno.ECONNREFUSED: "nothing listens there: is the device running, and the port right?",
    errno.EHOSTUNREACH: "no such host answers: is the device on, and in this network?",
    errno.ENETUNREACH:  "no way leads to that network: is the cable plugged in?",
    errno.EMSGSIZE:     f"the network does not take datagrams of {CHUNK_BYTES} bytes: raise its MTU to 1500",
}


class UdpChannel:
    """Datagrams to and from port `port` of `host`; raises DeviceError if there is no such host.

    `room` is the number of datagrams of a whole chunk that can wait to be read.
    """

    ordered        = False
    overhead_bytes = 0

    def __init__(self, host: str, port: int) -> None:
        self.errors = 0
        self._name  = f"udp://{host}:{port}"
        try:
            (family, kind, protocol, _, address), *_ = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)
        except (OSError, UnicodeError) as error:
            reason = error.strerror if isinstance(error, OSError) else "the name is malformed"
            raise DeviceError(f"cannot find {self._name}: {reason}") from None
        self._socket = socket.socket(family, kind, protocol)
        try:
            for option in (socket.SO_RCVBUF, socket.SO_SNDBUF):
                with contextlib.suppress(OSError):
                    self._socket.setsockopt(socket.SOL_SOCKET, option, _BUFFER_BYTES)
            self._socket.connect(address)
        except OSError as error:
            self._socket.close()
            raise self._lost(error) from None
        self.room  = self._socket.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF) // _DATAGRAM_BYTES
        self._poll = select.poll()
        self._poll.register(self._socket, select.POLLIN)

    def timing(self, *_: float) -> RoundTrip:
        """What takes time on a network is the way, not the bytes."""
        return RoundTrip()

    def wrap(self, message: bytes) -> bytes:
        """The message itself."""
        return message

    def send(self, wrapped: bytes, _: bool) -> None:
        """Sends a datagram."""
        self._send([wrapped])

    def send_chunk(self, session: int, sequence: int, frame_id: int, offset: int, chunk: memoryview,
                   kind: MessageType = MessageType.UPLOAD) -> None:
        """Sends an UPLOAD, or PAIRS, without copying the chunk."""
        header, crc = pack_header(kind, session, sequence, frame_id, offset, chunk)
        self._send([header, chunk, crc])

    def _send(self, parts: list[bytes | memoryview]) -> None:
        try:
            self._socket.sendmsg(parts)
        except OSError as error:
            # A full queue of the network card drops, as any queue on the way may.
            if error.errno != errno.ENOBUFS:
                raise self._lost(error) from None

    def receive(self, timeout_s: float) -> list[Message]:
        """Messages that have arrived, waiting at most `timeout_s` for a datagram."""
        messages = self._arrived()
        if not messages and timeout_s > 0 and self._poll.poll(timeout_s*1000):
            messages = self._arrived()
        return messages

    def _arrived(self) -> list[Message]:
        messages: list[Message] = []
        for _ in range(_MOST_AT_ONCE):
            try:
                messages.append(Message.decode(self._socket.recv(_READ_BYTES, socket.MSG_DONTWAIT)))
            except ProtocolError:
                self.errors += 1
            except BlockingIOError:
                break
            except OSError as error:
                raise self._lost(error) from None
        return messages

    def _lost(self, error: OSError) -> DeviceError:
        return DeviceError(f"cannot reach {self._name}: "
                           f"{_REASONS.get(error.errno or 0, error.strerror or str(error))}")

    def close(self) -> None:
        """Closes the socket."""
        self._socket.close()
