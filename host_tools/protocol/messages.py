#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Messages of the link protocol, version 1, which docs/protocol.md specifies."""

from __future__ import annotations

import enum
import struct
import zlib
from dataclasses import dataclass

from ..core.errors import ProtocolError

MAGIC   = b"LS"
VERSION = 1

#: Largest payload, and the step of upload offsets, in bytes.
CHUNK_BYTES = 1024

#: In place of an offset: nothing is missing.
NO_OFFSET = 0xffffffff

#: Port on which a device listens for datagrams.
UDP_PORT = 19539

#: Set in the type of a reply.
REPLY = 0x80

_HEADER = struct.Struct("<2sBBIIIII")
_CRC    = struct.Struct("<I")

#: Lengths of the shortest and the longest message in bytes.
MIN_MESSAGE_BYTES = _HEADER.size + _CRC.size
MAX_MESSAGE_BYTES = MIN_MESSAGE_BYTES + CHUNK_BYTES


class MessageType(enum.IntEnum):
    """Types of requests; a reply has `REPLY` added, except for ERROR, which is always a reply."""

    HELLO       = 0x01
    CONFIGURE   = 0x02
    OPEN        = 0x03
    UPLOAD      = 0x04
    START       = 0x05
    STATUS      = 0x06
    READ        = 0x07
    RELEASE     = 0x08
    STATISTICS  = 0x09
    BYE         = 0x0a
    MISSING     = 0x0b
    STREAM      = 0x0c
    PAIRS       = 0x0d
    UPDATE      = 0x0e
    IMAGE       = 0x0f
    WRITE       = 0x10
    PROGRESS    = 0x11
    RESTART     = 0x12
    CALIBRATE   = 0x13
    RECORD      = 0x14
    ADOPT       = 0x15
    CALIBRATION = 0x16
    RECALL      = 0x17
    FORGET      = 0x18
    ERROR       = 0xff


class ErrorCode(enum.IntEnum):
    """Codes of an ERROR reply."""

    VERSION     = 1
    TYPE        = 2
    SESSION     = 3
    LENGTH      = 4
    PARAMETER   = 5
    RANGE       = 6
    NO_SLOT     = 7
    FRAME       = 8
    STATE       = 9
    OFFSET      = 10
    INCOMPLETE  = 11
    SIZE        = 12
    MATCHER     = 13
    TIMEOUT     = 14
    DUPLICATE   = 15
    FEATURE     = 16
    BUSY        = 17
    CALIBRATION = 18
    FLASH       = 19


def pack_header(kind: int, session: int, sequence: int, frame_id: int, offset: int,
                payload: bytes | memoryview, version: int = VERSION) -> tuple[bytes, bytes]:
    """Return the header and the CRC of a message, between which the payload goes.

    Raises struct.error if a number does not fit its field.
    """
    header = _HEADER.pack(MAGIC, version, kind, session, sequence, frame_id, offset, len(payload))
    return header, _CRC.pack(zlib.crc32(payload, zlib.crc32(header)))


@dataclass(frozen=True)
class Message:
    """One message: the fields of its header, each an unsigned number, and a payload of 0 to 1024 bytes."""

    type:     int
    session:  int = 0
    sequence: int = 0
    frame_id: int = 0
    offset:   int = 0
    payload:  bytes = b""
    version:  int = VERSION

    def encode(self) -> bytes:
        """The message as bytes, 28 to 1052 of them.

        Raises
        ------
        ProtocolError
            The payload is longer than a chunk, or a field does not fit its place.
        """
        if len(self.payload) > CHUNK_BYTES:
            raise ProtocolError(f"a payload of {len(self.payload)} bytes is longer than {CHUNK_BYTES}")
        try:
            header, crc = pack_header(self.type, self.session, self.sequence, self.frame_id, self.offset,
                                      self.payload, self.version)
        except struct.error as error:
            raise ProtocolError(f"a header field does not fit its place: {error}") from error
        return header + self.payload + crc

    @classmethod
    def decode(cls, data: bytes) -> Message:
        """Return the message that `data` is, of any version and type.

        Raises
        ------
        ProtocolError
            The length, the magic or the CRC is wrong.
        """
        if not MIN_MESSAGE_BYTES <= len(data) <= MAX_MESSAGE_BYTES:
            raise ProtocolError(f"{len(data)} bytes are no message: it has {MIN_MESSAGE_BYTES} to "
                                f"{MAX_MESSAGE_BYTES}")
        (crc,) = _CRC.unpack_from(data, len(data) - _CRC.size)
        if crc != zlib.crc32(data[:-_CRC.size]):
            raise ProtocolError("the CRC of a message is wrong")
        magic, version, kind, session, sequence, frame_id, offset, length = _HEADER.unpack_from(data)
        if magic != MAGIC:
            raise ProtocolError(f"a message begins with {magic!r} instead of {MAGIC!r}")
        if length != len(data) - MIN_MESSAGE_BYTES:
            raise ProtocolError(f"a message of {len(data)} bytes claims a payload of {length}")
        return cls(kind, session, sequence, frame_id, offset, data[_HEADER.size:-_CRC.size], version)

    def reply(self, payload: bytes = b"") -> Message:
        """Return the reply to this request that carries `payload`."""
        return Message(self.type | REPLY, self.session, self.sequence, self.frame_id, self.offset, payload)
