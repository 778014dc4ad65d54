#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Messages as UDP datagrams."""

from __future__ import annotations

import contextlib
import errno
import select
import socket

from ..core.errors import DeviceError, ProtocolError
from ..protocol.messages import CHUNK_BYTES, Message, MessageType, pack_header
from .timing import RoundTrip

#: Requested socket buffers in bytes, each way; the kernel may give less.
_BUFFER_BYTES = 4 << 20

#: Bytes of a socket buffer that a datagram of a whole chunk uses, with the kernel's own data.
_DATAGRAM_BYTES = 2560

#: Longest read in bytes, more than any message: a longer datagram is cut, and no message either way.
_READ_BYTES = 2048

#: Most datagrams of one poll, so that time limits are checked under a flood too.
_MOST_AT_ONCE = 256

_REASONS = {
    errno.ECONNREFUSED: "nothing listens there: is the device running, and is this its port?",
    errno.EHOSTUNREACH: "no such host answers: is the device on, and in this network?",
    errno.ENETUNREACH:  "there is no route to that network: is the cable plugged in?",
    errno.EMSGSIZE:     f"the network does not take datagrams of {CHUNK_BYTES} bytes: raise its MTU to 1500",
}


class UdpChannel:
    """A channel of datagrams to and from a device.

    `room` is the number of datagrams of a whole chunk that fit the receive buffer.

    Parameters
    ----------
    host, port
        Name or address of the device, and its port.

    Raises
    ------
    DeviceError
        There is no such host.
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
        """Return a new estimate of the round trip, which is what counts on a network."""
        return RoundTrip()

    def wrap(self, message: bytes) -> bytes:
        """Return an encoded message as it is: a datagram holds one."""
        return message

    def send(self, wrapped: bytes, _: bool) -> None:
        """Send a datagram; raise DeviceError if the device cannot be reached."""
        try:
            self._socket.sendmsg([wrapped])
        except OSError as error:
            self._check_sent(error)

    def send_chunk(self, session: int, sequence: int, frame_id: int, offset: int, chunk: memoryview,
                   kind: MessageType = MessageType.UPLOAD) -> None:
        """Send an UPLOAD, or PAIRS, without copying the chunk; raise DeviceError if the device cannot be reached."""
        header, crc = pack_header(kind, session, sequence, frame_id, offset, chunk)
        try:
            self._socket.sendmsg([header, chunk, crc])
        except OSError as error:
            self._check_sent(error)

    def receive(self, timeout_s: float) -> list[Message]:
        """Return the messages that have arrived, waiting at most `timeout_s` for a datagram.

        Raises DeviceError if the device cannot be reached.
        """
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

    def _check_sent(self, error: OSError) -> None:
        """Raise DeviceError for an error of sending, unless the datagram is lost only."""
        # A network card drops datagrams if its queue is full, as any queue on the path may.
        if error.errno != errno.ENOBUFS:
            raise self._lost(error) from None

    def _lost(self, error: OSError) -> DeviceError:
        return DeviceError(f"cannot reach {self._name}: "
                           f"{_REASONS.get(error.errno or 0, error.strerror or str(error))}")

    def close(self) -> None:
        """Close the socket; closing twice does no harm."""
        self._socket.close()
