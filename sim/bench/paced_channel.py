#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Host tools in the time of a simulated device: its clock is stopped while they compute."""

from __future__ import annotations

import contextlib
import socket
import struct
import time
from collections.abc import Iterator

from ...host_tools.core.errors import DeviceError, ProtocolError
from ...host_tools.link.udp_channel import UdpChannel
from ...host_tools.protocol.messages import Message, MessageType, pack_header

#: Datagrams of a whole chunk that fit the host's receive buffer, as if it had 4 MB.
_ROOM = 1638

#: A wait, and the clock that answers it.
_WAIT   = struct.Struct("=cQ")
_ANSWER = struct.Struct("=Q")

#: Longest answer in bytes: a clock and a datagram.
_LONGEST = 2048


class PacedChannel(UdpChannel):
    """Datagrams to and from a simulated device, whose clock goes on only while the host waits.

    Parameters
    ----------
    name
        `Simulation.paced`.
    clock_hz
        Clocks of the wire in a second of the host.

    Raises
    ------
    DeviceError
        The simulation does not run.
    """

    def __init__(self, name: str, clock_hz: int) -> None:
        self.errors    = 0
        self.room      = _ROOM
        self.clock     = 0
        self._clock_hz = clock_hz
        self._socket   = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        try:
            self._socket.connect(f"\0{name}")
        except OSError as error:
            self._socket.close()
            raise DeviceError(f"cannot reach the simulation: {error.strerror}") from None
        self._wait(0)

    @property
    def now_s(self) -> float:
        """Return the time in the device's world, in seconds."""
        return self.clock/self._clock_hz

    def send(self, wrapped: bytes, _: bool) -> None:
        """Queue a datagram for the wire."""
        self._put(b"D" + wrapped)

    def send_chunk(self, session: int, sequence: int, frame_id: int, offset: int, chunk: memoryview,
                   kind: MessageType = MessageType.UPLOAD) -> None:
        """Queue an UPLOAD, or PAIRS, for the wire."""
        header, crc = pack_header(kind, session, sequence, frame_id, offset, chunk)
        self._put(b"".join([b"D", header, chunk, crc]))

    def receive(self, timeout_s: float) -> list[Message]:
        """Return the next message that arrives within `timeout_s`, if one does."""
        payload = self._wait(self.clock + round(timeout_s*self._clock_hz))
        if not payload:
            return []
        try:
            return [Message.decode(payload)]
        except ProtocolError:
            self.errors += 1
            return []

    def _wait(self, until: int) -> bytes:
        """Let the simulation go on until a datagram has come, at most up to a clock; return it."""
        self._put(_WAIT.pack(b"W", until))
        try:
            answer = self._socket.recv(_LONGEST)
        except OSError as error:
            raise self._gone(error) from None
        if not answer:
            raise DeviceError("the simulation has ended")
        (self.clock,) = _ANSWER.unpack_from(answer)
        return answer[_ANSWER.size:]

    def _put(self, packet: bytes) -> None:
        try:
            self._socket.sendall(packet)
        except OSError as error:
            raise self._gone(error) from None

    @staticmethod
    def _gone(error: OSError) -> DeviceError:
        return DeviceError(f"the simulation has ended: {error.strerror}")


@contextlib.contextmanager
def time_of(channel: PacedChannel) -> Iterator[None]:
    """Have this process read the time of a channel's device from `time.monotonic`, until the context ends.

    The host tools' time limits then depend neither on this computer nor on its load.
    """
    monotonic, time.monotonic = time.monotonic, lambda: channel.now_s
    try:
        yield
    finally:
        time.monotonic = monotonic
