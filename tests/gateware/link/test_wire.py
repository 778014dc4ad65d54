#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The bytes of the wire and the words of frames, in both directions, against the definition of Ethernet's frames."""

from __future__ import annotations

import zlib

import numpy as np
import pytest

from litestereo.gateware.link.wire_receiver import WireReceiver
from litestereo.gateware.link.wire_sender import WireSender
from litestereo.sim.cores.stream_core import StreamCore
from support.ethernet_frames import PREAMBLE, on_the_wire
from support.frame_words import frame_words, marks, packed, split, unpacked
from support.pairs import byte_generator

BYTE     = [("data", 8), ("last_be", 1), ("error", 1)]
RECEIVED = [("data", 32), ("tail", 2), ("error", 1)]
SENT     = [("data", 32), ("tail", 2)]

#: Around the limits: within the first words, the shortest and the longest frame, and one that is longer.
LENGTHS = [1, 2, 3, 4, 5, 6, 7, 41, 42, 43, 44, 45, 46, 47, 58, 59, 60, 61, 62, 63, 64, 1513, 1514, 1515, 1600]


@pytest.fixture(scope="module", params=[True, False], ids=["wire", "model"])
def receiver(request):
    core = StreamCore(WireReceiver(request.param))
    core.framed = request.param
    return core


@pytest.fixture(scope="module", params=[True, False], ids=["wire", "model"])
def sender(request):
    core = StreamCore(WireSender(request.param))
    core.framed = request.param
    return core


def receive(core, rows, valid=1.0, ready=1.0, seed=0):
    """Put rows of bytes on the wire; return the frames that come out, as lists of (word, tail, error)."""
    core.reset()
    data = b"".join(rows)
    run  = core.run(packed(BYTE, [(byte, 0, 0) for byte in data]), 1 << 16, last=marks(map(len, rows)), valid=valid,
                    ready=ready, seed=seed, idle_clocks=200)
    assert run.accepted == len(data)
    return split(unpacked(RECEIVED, run.words), list(run.last))


def checked(frames, got):
    """Assert that frames came out: for each its bytes, and whether it has an error."""
    assert len(got) == len(frames)
    for (frame, error), words in zip(frames, got, strict=True):
        wanted = frame_words(frame)
        data   = b"".join(word.to_bytes(4, "little") for word, _, _ in words)
        assert len(words) == len(wanted) and words[-1][1] == wanted[-1][1]
        assert data[2:2 + len(frame)] == frame
        assert bool(words[-1][2]) == error


@pytest.mark.parametrize("valid", [1.0, 0.5, 0.1])
def test_receiver(receiver, valid):
    """Frames of all lengths, back to back and with gaps, some of them damaged."""
    rng    = byte_generator(90, str(valid))
    frames = [rng.randbytes(length) for length in LENGTHS]
    rng.shuffle(frames)
    rows, wanted = [], []
    for frame in frames:
        damaged = receiver.framed and rng.random() < 0.4
        row     = bytearray(on_the_wire(frame) if receiver.framed else frame)
        if damaged:
            row[rng.randrange(8, len(row))] ^= 1 << rng.randrange(8)
            frame = bytes(row[8:-4])
        rows.append(bytes(row))
        wanted.append((frame, damaged))
    checked(wanted, receive(receiver, rows, valid=valid, seed=3))


def test_preambles():
    """The preamble may be short or long; without its end there is no frame, and too short a frame is discarded."""
    receiver = StreamCore(WireReceiver())
    frame = bytes(range(1, 61))
    body  = on_the_wire(frame)[8:]
    rows  = [PREAMBLE[-1:] + body, bytes([0x55])*20 + b"\xd5" + body, b"\x55"*30, b"\xd5", PREAMBLE, PREAMBLE + b"1",
             PREAMBLE + b"12", PREAMBLE + body]
    checked([(frame, False)]*3, receive(receiver, rows))


def test_a_frame_without_room_has_an_error(receiver):
    """A word that is not taken is lost; its frame, or the one that it grows together with, has an error."""
    rng    = byte_generator(91)
    frames = [rng.randbytes(rng.randrange(46, 200)) for _ in range(300)]
    rows   = [on_the_wire(frame) if receiver.framed else frame for frame in frames]
    got    = receive(receiver, rows, ready=0.97, seed=5)
    sound  = [b"".join(word.to_bytes(4, "little") for word, _, _ in words) for words in got if not words[-1][2]]
    assert 20 < len(sound) < 280 and len(got) > len(sound)
    rest = iter(frames)
    for data in sound:
        assert any(data[2:2 + len(frame)] == frame and len(data) == 4*len(frame_words(frame)) for frame in rest)


@pytest.mark.parametrize("reset_clock", [5, 9, 30, 71])
def test_receiver_reset(receiver, reset_clock):
    """After a reset in mid-frame the next frame is received."""
    frame = bytes(range(1, 61))
    row   = on_the_wire(frame) if receiver.framed else frame
    receiver.reset()
    receiver.run(packed(BYTE, [(byte, 0, 0) for byte in row]), 1 << 16, last=marks([len(row)]), reset_clock=reset_clock)
    checked([(frame, False)], receive(receiver, [row]))


def send(core, frames, valid=1.0, ready=1.0, seed=0):
    """Send frames as words; return the rows of bytes, and the clocks."""
    core.reset()
    words = [frame_words(frame) for frame in frames]
    items = [item for frame in words for item in frame]
    run   = core.run(packed(SENT, items), 1 << 20, last=marks(map(len, words)), valid=valid, ready=ready, seed=seed,
                     idle_clocks=200)
    assert run.accepted == len(items)
    rows  = split([byte for byte, _, _ in unpacked(BYTE, run.words)], list(run.last))
    return [bytes(row) for row in rows], run.clocks


def on_wire(core, frame):
    """Return what the wire gets of a frame."""
    frame = frame.ljust(60, b"\0")
    return on_the_wire(frame) if core.framed else frame


@pytest.mark.parametrize(("valid", "ready"), [(1.0, 1.0), (1.0, 0.5), (0.3, 1.0), (0.3, 0.3)])
def test_sender(sender, valid, ready):
    rng    = byte_generator(92, str(valid), str(ready))
    frames = [rng.randbytes(length) for length in LENGTHS]
    rng.shuffle(frames)
    rows, _ = send(sender, frames, valid, ready, seed=4)
    assert rows == [on_wire(sender, frame) for frame in frames]


@pytest.mark.parametrize("length", [42, 60, 61, 1094, 1514])
def test_sender_speed(sender, length):
    """A frame follows the one before after twelve bytes of gap, and has no gap itself."""
    frame = zlib.compress(bytes(5000), 0)[:length]
    rows, clocks = send(sender, [frame]*20)
    period = len(on_wire(sender, frame)) + 12
    assert len(rows) == 20 and 20*period - 12 <= clocks <= 20*period + 12


@pytest.mark.parametrize("reset_clock", [3, 15, 22, 40, 90])
def test_sender_reset(sender, reset_clock):
    """After a reset in mid-frame the next frame is whole."""
    frame = bytes(range(1, 71))
    items = packed(SENT, frame_words(frame))
    sender.reset()
    sender.run(items, 1 << 16, last=marks([len(items)]), reset_clock=reset_clock)
    rows, _ = send(sender, [frame])
    assert rows == [on_wire(sender, frame)]


def test_crc_of_the_definition():
    """The reference is Ethernet's CRC: that of the digits is known."""
    assert zlib.crc32(b"123456789") == 0xcbf43926
    assert np.frombuffer(on_the_wire(b"123456789")[-4:], "<u4")[0] == 0xcbf43926
