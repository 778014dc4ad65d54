#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""COBS against the definition of the code, byte by byte."""

import pytest

from litestereo.host_tools.core.errors import ProtocolError
from litestereo.host_tools.protocol import cobs
from support.pairs import byte_generator


def encode_by_definition(data: bytes) -> bytes:
    """Block by block: the data with a zero appended, cut after each zero and after 254 other bytes."""
    blocks, block = [], bytearray()
    for byte in data + b"\0":
        if byte == 0:
            blocks.append(bytes([len(block) + 1]) + block)
            block = bytearray()
        else:
            block.append(byte)
            if len(block) == 254:
                blocks.append(b"\xff" + block)
                block = bytearray()
    # The appended zero needs no further block when a full block ends the data.
    if blocks[-1] == b"\x01" and len(blocks) > 1 and blocks[-2][0] == 0xff:
        blocks.pop()
    return b"".join(blocks)


@pytest.mark.parametrize(("data", "encoded"), [
    (b"", b"\x01"),
    (b"\0", b"\x01\x01"),
    (b"\0\0", b"\x01\x01\x01"),
    (b"a", b"\x02a"),
    (b"a\0b", b"\x02a\x02b"),
    (b"a\0", b"\x02a\x01"),
    (b"x" * 253, b"\xfe" + b"x" * 253),
    (b"x" * 254, b"\xff" + b"x" * 254),
    (b"x" * 255, b"\xff" + b"x" * 254 + b"\x02x"),
    (b"x" * 254 + b"\0", b"\xff" + b"x" * 254 + b"\x01\x01"),
    (b"x" * 508, (b"\xff" + b"x" * 254) * 2),
])
def test_known_encodings(data, encoded):
    assert cobs.encode(data) == encoded
    assert cobs.decode(encoded) == data


def test_random_data_is_encoded_as_defined_and_comes_back():
    rng = byte_generator(1)
    for _ in range(500):
        length  = rng.randrange(300)
        data    = bytes(rng.choice((0, rng.randrange(1, 256), 0x55, 0x55, 0x55)) for _ in range(length))
        data   += b"\x55" * rng.choice((0, 0, 253, 254, 255, 508, 509)) + data[:rng.randrange(3)]
        encoded = cobs.encode(data)
        assert 0 not in encoded
        assert encoded == encode_by_definition(data)
        assert cobs.decode(encoded) == data


@pytest.mark.parametrize("encoded", [b"", b"\x02", b"\x05abc", b"\x02\x00", b"\xff" + b"x" * 253,
                                     b"\x03ab\x04a"])
def test_what_is_no_encoding_is_refused(encoded):
    with pytest.raises(ProtocolError):
        cobs.decode(encoded)
