#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Consistent Overhead Byte Stuffing (Cheshire and Baker, 1999).

Encoded data has no zero byte, so that one can delimit it.
"""

from __future__ import annotations

from ..core.errors import ProtocolError

#: The byte that encoded data never contains.
DELIMITER = 0

#: Most data bytes that follow one code byte.
RUN_LENGTH = 254


def encode(data: bytes) -> bytes:
    """Return the encoding of `data`, without delimiters: no zero byte, and one more byte per 254 or part of them."""
    encoded = bytearray()
    runs    = data.split(b"\0")
    for index, run in enumerate(runs):
        while len(run) > RUN_LENGTH:
            encoded.append(RUN_LENGTH + 1)
            encoded += run[:RUN_LENGTH]
            run = run[RUN_LENGTH:]
        # No zero is implied after a full run, so at the end of the data no code byte has to follow it.
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
    """Return the data whose encoding, without delimiters, is `encoded`.

    Raises
    ------
    ProtocolError
        The encoding contains a zero byte, ends within a run, or is empty.
    """
    if not encoded:
        raise ProtocolError("an empty frame is no COBS encoding")
    if DELIMITER in encoded:
        raise ProtocolError("a COBS encoding contains a zero byte")
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
