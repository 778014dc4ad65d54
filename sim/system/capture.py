#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Reads a capture of the simulated wire: the pcap file of ethernet2socket, whose times are clocks of the wire."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from ...host_tools.core.errors import ProtocolError
from ...host_tools.protocol.messages import UDP_PORT, Message

_MAGIC  = 0xa1b23c4d # pcap with nanoseconds; each is a clock.
_HEADER = struct.Struct("=IHHIIII")
_RECORD = struct.Struct("=IIII")

_DEVICE = bytes([192, 168, 1, 50])

_UDP_OFFSET     = 14 + 20
_PAYLOAD_OFFSET = _UDP_OFFSET + 8


@dataclass(frozen=True)
class Captured:
    """A message on the wire: the clock of its last byte, and whether it went to the device."""
    clock:     int
    to_device: bool
    message:   Message


def read_capture(path: Path) -> Iterator[Captured]:
    """Yield the messages of a capture in their order; Ethernet frames without a message are skipped.

    Raises
    ------
    ValueError
        The file is not such a capture. It is raised when the first message is requested.
    """
    data = path.read_bytes()
    if len(data) < _HEADER.size or _HEADER.unpack_from(data)[0] != _MAGIC:
        raise ValueError(f"{path} is no capture of the simulated wire")
    place = _HEADER.size
    # The last record may be cut off: the simulator is killed, not stopped.
    while place + _RECORD.size <= len(data):
        seconds, nanoseconds, kept, _ = _RECORD.unpack_from(data, place)
        frame  = data[place + _RECORD.size:place + _RECORD.size + kept]
        place += _RECORD.size + kept
        if len(frame) < _PAYLOAD_OFFSET or frame[12:14] != b"\x08\x00" or frame[23] != 17:
            continue
        source, destination, length = struct.unpack_from(">HHH", frame, _UDP_OFFSET)
        if UDP_PORT not in (source, destination):
            continue
        try:
            message = Message.decode(frame[_PAYLOAD_OFFSET:_UDP_OFFSET + length])
        except ProtocolError:
            continue
        # By address, not by port: a host may use the device's port number too.
        yield Captured(seconds*10**9 + nanoseconds, frame[30:34] == _DEVICE, message)
