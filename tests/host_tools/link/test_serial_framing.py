#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Frames and console text on one line."""

import pytest

from litestereo.host_tools.link.serial_framing import FRAME_TIMEOUT_S, Demultiplexer, encode_frame
from litestereo.host_tools.protocol.messages import Message, MessageType
from support.pairs import byte_generator


class Clock:
    """A clock that a test sets."""

    def __init__(self):
        self.now = 0.0

    def __call__(self):
        return self.now


def messages(count):
    return [Message(MessageType.UPLOAD, 1, sequence, 2, 1024*sequence, bytes([sequence])*(sequence*97 % 1025))
            for sequence in range(1, count + 1)]


def on_line(message):
    return encode_frame(message.encode())


@pytest.mark.parametrize("step", [1, 2, 3, 7, 1000, 1 << 20])
def test_text_and_frames_are_sorted_in_pieces_of_any_size(step):
    sent = messages(20)
    line = b"boot\r\n" + b"".join(on_line(message) + (b"text" if index % 3 == 0 else b"")
                                  for index, message in enumerate(sent)) + b"end"
    demux    = Demultiplexer()
    received = []
    for start in range(0, len(line), step):
        received += demux.feed(line[start:start + step])
    assert received == sent
    assert demux.take_console() == "boot\r\n" + "text"*7 + "end"
    assert demux.take_console() == ""
    assert demux.errors == 0


@pytest.mark.parametrize("lost", ["first", "last"])
def test_a_lost_delimiter_costs_one_message(lost):
    sent = messages(6)
    for victim in range(5):
        parts         = [on_line(message) for message in sent]
        parts[victim] = parts[victim][1:] if lost == "first" else parts[victim][:-1]
        received      = Demultiplexer().feed(b"".join(parts))
        assert len(received) == 5
        assert {message.sequence for message in received} < {message.sequence for message in sent}


def test_a_frame_after_a_stray_delimiter_is_received():
    (sent,) = messages(1)
    assert Demultiplexer().feed(b"\0" + on_line(sent)) == [sent]
    assert Demultiplexer().feed(b"\0\0\0" + on_line(sent)) == [sent]


def test_one_more_delimiter_ends_the_frame_of_a_dead_host():
    first, second = messages(2)
    demux         = Demultiplexer()
    assert demux.feed(on_line(first)[:-20]) == []
    assert demux.feed(b"\0" + on_line(second)) == [second]
    assert demux.errors == 1


def test_silence_inside_a_frame_brings_back_the_console():
    clock = Clock()
    demux = Demultiplexer(clock)
    demux.feed(b"\0\x05ab")
    clock.now += 0.9*FRAME_TIMEOUT_S
    demux.feed(b"c")
    clock.now += 0.9*FRAME_TIMEOUT_S
    demux.feed(b"")
    assert demux.errors == 0
    clock.now += 0.2*FRAME_TIMEOUT_S
    demux.feed(b"hello")
    assert demux.take_console() == "hello"
    assert demux.errors == 1


def test_a_frame_without_end_takes_no_memory_without_end():
    demux = Demultiplexer()
    for _ in range(100):
        demux.feed(b"\0" + b"x"*5000 if demux.errors == 0 else b"x"*5000)
    (sent,) = messages(1)
    assert demux.feed(b"\0" + on_line(sent)) == [sent]
    assert len(demux._frame) == 0


def test_noise_never_makes_a_message_and_never_sticks():
    rng           = byte_generator(3)
    first, second = messages(2)
    for _ in range(300):
        demux    = Demultiplexer()
        received = demux.feed(rng.randbytes(rng.randrange(3000)))
        assert received == []
        # In any state that the noise has left, the second of two frames is received.
        received = demux.feed(on_line(first) + on_line(second))
        assert received[-1:] == [second]
