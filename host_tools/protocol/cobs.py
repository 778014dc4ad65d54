#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Consistent Overhead Byte Stuffing (Cheshire and Baker, 1999).

Encoded data has no zeros, so that a zero can delimit it.
"""

from __future__ import annotations

from ..core.errors import ProtocolError

#: The one byte that never stands in encoded data.
DELIMITER = 0

#: Data bytes that one code byte can announce.
RUN_LENGTH = 254


def encode(data: bytes) -> bytes:
    """Encoding of `data` without delimiters: no zero byte, at most one byte longer per 254 begun."""
    encoded = bytearray()
    runs    = data.split(b"\0")
    for index, run in enumerate(runs):
        while len(run) > RUN_LENGTH:
            encoded.append(RUN_LENGTH + 1)
            encoded += run[:RUN_LENGTH]
            run = run[RUN_LENGTH:]
        # A full run implies no zero after it, so the last run of the data needs no code byte to end it.
        if len(run) == RUN_LENGTH:
            encoded.append(RUN_LENGTH + 1)
            encoded += run
            if index == len(runs) - 1:
                break
            run = b""
        encoded.append(len(run) + 1)
        encoded += run
    return bytes(encoded)


def decode(encoded: bytes) -> bytes:
    """Data whose encoding is `encoded`, without delimiters.

    Raises
    ------
    ProtocolError
        A zero byte stands in the encoding, or it ends within a run, or it is empty.
    """
    if not encoded:
        raise ProtocolError("an empty frame is no COBS encoding")
    if DELIMITER in encoded:
        raise ProtocolError("a zero byte stands in a COBS encoding")
    data     = bytearray()
    position = 0
    while position < len(encoded):
        code = encoded[position]
        run  = encoded[position + 1:position + code]
        if len(run) != code - 1:
            raise ProtocolError("a COBS encoding ends within a run")
        data     += run
        position += code
        if code <= RUN_LENGTH and position < len(encoded):
            data.append(0)
    return bytes(data)
