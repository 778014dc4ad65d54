#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""COBS, messages and the demultiplexer on bytes that Hypothesis thinks of, and the firmware on the same ones."""

import subprocess
import zlib

import pytest
from hypothesis import given, seed, settings
from hypothesis import strategies as st

from litestereo.host_tools.core.errors import ProtocolError
from litestereo.host_tools.link.serial_framing import MAX_ENCODED_BYTES, Demultiplexer, encode_frame
from litestereo.host_tools.protocol import cobs
from litestereo.host_tools.protocol.messages import CHUNK_BYTES, MAGIC, MAX_MESSAGE_BYTES, Message
from support.firmware_build import build_tests
from support.pairs import SEED

RUNS = st.sampled_from([b"x"*253, b"x"*254, b"x"*255, b"\0", b"\0\0", b"\xff"])

#: Bytes, among them those of runs that fill a block of COBS.
BYTES = st.lists(st.binary(max_size=300) | RUNS, max_size=5).map(b"".join)

NUMBER  = st.integers(0, 0xffffffff)
BYTE    = st.integers(0, 255)
MESSAGE = st.builds(Message, BYTE, NUMBER, NUMBER, NUMBER, NUMBER, st.binary(max_size=CHUNK_BYTES), BYTE)


def thorough(test):
    """The same examples for the same LITESTEREO_SEED, with no folder of earlier ones and no limit of time."""
    return seed(SEED)(settings(max_examples=300, deadline=None, database=None)(test))


def sealed(data: bytes) -> bytes:
    """A message as far as magic, length and CRC go."""
    body = MAGIC + data[2:20] + (len(data) - 24).to_bytes(4, "little") + data[24:]
    return body + zlib.crc32(body).to_bytes(4, "little")


#: Near a message, or one.
ALMOST = BYTES | MESSAGE.map(Message.encode) | st.binary(min_size=24, max_size=1100).map(sealed) | st.builds(
    lambda message, place, bit: bytes(byte ^ (bit if index == place % len(message) else 0)
                                      for index, byte in enumerate(message)),
    MESSAGE.map(Message.encode), st.integers(0, 2000), st.sampled_from([1, 16, 128]))


class Firmware:
    """The firmware's own code, a line for a line."""

    def __init__(self):
        self._process = subprocess.Popen([build_tests() / "decode_lines"], stdin=subprocess.PIPE,
                                         stdout=subprocess.PIPE, text=True, bufsize=1)

    def ask(self, what: str, data: bytes) -> str:
        self._process.stdin.write(f"{what} {data.hex()}.\n")
        return self._process.stdout.readline().rstrip("\n")

    def close(self):
        self._process.stdin.close()
        status = self._process.wait(10)
        self._process.stdout.close()
        assert status == 0


@pytest.fixture(scope="module")
def device():
    firmware = Firmware()
    yield firmware
    firmware.close()


@thorough
@given(BYTES)
def test_encoded_bytes_come_back(device, data):
    encoded = cobs.encode(data)
    assert 0 not in encoded
    assert len(encoded) <= len(data) + len(data)//cobs.RUN_LENGTH + 1
    assert cobs.decode(encoded) == data
    assert device.ask("encode", data) == f"{encoded.hex()}."


@thorough
@given(BYTES | BYTES.map(cobs.encode) | st.lists(BYTE, max_size=20).map(bytes))
def test_any_bytes_are_decoded_or_refused(device, encoded):
    """And what is decoded may be another encoding than ours, but the firmware reads the same in it."""
    try:
        said = f"{cobs.decode(encoded).hex()}."
    except ProtocolError:
        said = "refused"
    assert device.ask("decode", encoded) == said


@thorough
@given(MESSAGE)
def test_messages_come_back(message):
    assert Message.decode(message.encode()) == message
    assert len(message.encode()) <= MAX_MESSAGE_BYTES
    assert len(cobs.encode(message.encode())) <= MAX_ENCODED_BYTES


@thorough
@given(ALMOST)
def test_any_bytes_are_a_message_or_refused(device, data):
    try:
        found = Message.decode(data)
        said  = (f"{found.version} {found.type} {found.session} {found.sequence} {found.frame_id} {found.offset} "
                 f"{found.payload.hex()}.")
        assert found.encode() == data
    except ProtocolError:
        said = "refused"
    assert device.ask("parse", data) == said


@thorough
@given(st.integers(-2, 0x100000001), st.integers(-2, 258), st.integers(CHUNK_BYTES - 1, CHUNK_BYTES + 2))
def test_fields_fit_or_are_refused(number, kind, length):
    message = Message(kind, number, payload=bytes(length))
    if 0 <= number <= 0xffffffff and 0 <= kind <= 255 and length <= CHUNK_BYTES:
        assert Message.decode(message.encode()) == message
    else:
        with pytest.raises(ProtocolError):
            message.encode()


#: What a line can carry: text, frames of messages, frames of noise.
LINE = st.lists(BYTES | MESSAGE.map(lambda message: encode_frame(message.encode())) | ALMOST.map(encode_frame),
                max_size=6).map(b"".join)


@thorough
@given(LINE, st.lists(st.integers(0, 4000), max_size=6), MESSAGE)
def test_a_line_is_the_same_in_any_pieces(line, cuts, last):
    """Pieces change nothing, no byte counts twice, and after any bytes the second of two frames is received."""
    whole, parts = Demultiplexer(clock=lambda: 0.0), Demultiplexer(clock=lambda: 0.0)
    expected     = whole.feed(line)
    found        = []
    places       = [0, *sorted(min(cut, len(line)) for cut in cuts), len(line)]
    for begin, end in zip(places, places[1:], strict=False):
        found += parts.feed(line[begin:end])
    assert found == expected
    assert parts.console == whole.console
    assert parts.errors == whole.errors
    assert 0 not in whole.console
    assert len(whole.console) + sum(len(cobs.encode(message.encode())) for message in expected) <= len(line)
    assert isinstance(whole.take_console(), str)
    assert whole.feed(encode_frame(last.encode())*2)[-1:] == [last]


@thorough
@given(st.lists(MESSAGE, max_size=4), st.lists(st.binary(max_size=20).map(lambda text: text.replace(b"\0", b"")),
                                                min_size=5, max_size=5))
def test_messages_and_text_are_told_apart(messages, texts):
    line  = texts[0] + b"".join(encode_frame(message.encode()) + text
                                for message, text in zip(messages, texts[1:], strict=False))
    demux = Demultiplexer()
    assert demux.feed(line) == messages
    assert bytes(demux.console) == b"".join(texts[:len(messages) + 1])
    assert demux.errors == 0
