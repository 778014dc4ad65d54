#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Received frames, correct and not, against a model that reads their bytes as the RFCs define them."""

from __future__ import annotations

import struct
from dataclasses import dataclass

import pytest
from litex.gen import LiteXModule
from litex.soc.interconnect import stream
from migen import If, Signal

from litestereo.gateware.link.echo import Echo
from litestereo.gateware.link.header_parser import HeaderParser
from litestereo.sim.cores.stream_core import StreamCore
from litestereo.soc.parts.add_frame_link import MAC_ADDRESS
from support.ethernet_frames import (
    BROADCAST,
    DEVICE,
    HOST,
    Station,
    arp,
    checksum,
    datagram,
    ethernet,
    ip_bytes,
    ip_packet,
    mac_bytes,
    udp_packet,
)
from support.frame_words import frame_words, marks, packed, split, unpacked
from support.pairs import byte_generator

RECEIVED  = [("data", 32), ("tail", 2), ("error", 1)]
DATAGRAMS = [("data", 32), ("last_be", 4), ("error", 4), ("address", 32), ("port", 16), ("length", 16)]
ARP       = [("reply", 1), ("request", 1), ("ip_address", 32), ("mac_address", 48)]
ECHO      = [("data", 32), ("tail", 2), ("address", 32), ("length", 8)]
PEER      = HOST._replace(port=40001)
UNKNOWN   = Station("00:00:00:00:00:00", HOST.address)
MOST_ECHO = 120


class Parser(LiteXModule):
    """The parser with one of its three kinds of output as a stream; those of ARP wait in a FIFO."""
    def __init__(self, kind: str) -> None:
        self.sink   = stream.Endpoint(RECEIVED)
        self.parser = parser = HeaderParser(DEVICE.port)
        self.on     = Signal()
        self.comb += [
            self.sink.connect(parser.sink),
            parser.on.eq(self.on),
            parser.mac_address.eq(MAC_ADDRESS),
            parser.ip_address.eq(int.from_bytes(ip_bytes(DEVICE.address), "big")),
        ]
        if kind == "datagrams":
            self.source = stream.Endpoint(DATAGRAMS)
            self.comb += [
                parser.source.connect(self.source, keep={"valid", "ready", "last", "data", "last_be", "error"}),
                self.source.address.eq(parser.source.ip_address),
                self.source.port.eq(parser.source.src_port),
                self.source.length.eq(parser.source.length),
            ]
        else:
            self.comb += parser.source.ready.eq(1)
        if kind == "arp":
            self.fifo   = stream.SyncFIFO(ARP, 512)
            self.source = self.fifo.source
            self.comb += parser.arp.connect(self.fifo.sink)
        if kind == "echo":
            self.source = stream.Endpoint(ECHO)
            self.echo   = echo = Echo()
            self.comb += [
                echo.word.eq(parser.echo_word),
                echo.write.eq(parser.echo_write),
                echo.begin.eq(parser.echo_begin),
                echo.done.eq(parser.echo_done),
                echo.bytes.eq(parser.echo_bytes),
                echo.sender.eq(parser.sender),
                echo.source.connect(self.source, keep={"valid", "ready", "last", "data", "tail"}),
                If(self.source.last, self.source.address.eq(echo.address), self.source.length.eq(echo.length)),
            ]


@pytest.fixture(scope="module")
def cores():
    built = {kind: StreamCore(Parser(kind), ["on"]) for kind in ("datagrams", "arp", "echo")}
    for core in built.values():
        core.set(on=1)
    return built


@dataclass(frozen=True)
class Frame:
    """A frame without its CRC, and whether that was wrong."""
    data: bytes
    error: bool = False


# Model.

def whole(frame: bytes, begin: int, size: int) -> tuple[int, bool]:
    """Return how many words of a payload a frame has, and whether that is all; a payload of no bytes has a word."""
    there = len(frame) - begin
    words = max(1, -(-size//4))
    return min(words, -(-there//4)), there > 4*words or there - 4*(words - 1) >= (size - 1) % 4 + 1


def is_for_us(frame: bytes, broadcast: bool) -> bool:
    return frame[:6] == mac_bytes(DEVICE.mac) or broadcast and frame[:6] == mac_bytes(BROADCAST)


def ip_size(frame: bytes, protocol: int) -> int | None:
    """Return the bytes after the header of an IP packet to the device; None if the frame is none."""
    if len(frame) <= 42 or not is_for_us(frame, False) or frame[12:15] != b"\x08\x00\x45":
        return None
    total, fragment = struct.unpack_from(">H2xH", frame, 16)
    if total >= 2048 or fragment & 0x3fff or checksum(frame[14:34]) or frame[23] != protocol:
        return None
    return total - 20 if frame[30:34] == ip_bytes(DEVICE.address) else None


def model_datagram(frame: Frame) -> list[tuple[int, ...]] | None:
    """Return the items of a datagram, or None."""
    size = ip_size(frame.data, 17)
    if size is None:
        return None
    source, destination, length = struct.unpack_from(">HHH", frame.data, 34)
    if destination != DEVICE.port or length != size or length < 8:
        return None
    words, complete = whole(frame.data, 42, size - 8)
    data   = [word for word, _ in frame_words(frame.data)][11:11 + words]
    sender = int.from_bytes(frame.data[26:30], "big")
    bad    = frame.error or not complete
    return [(word, 1 << (size - 1) % 4 if index == words - 1 else 0, 15*(bad and index == words - 1), sender, source,
             size - 8) for index, word in enumerate(data)]


def model_arp(frame: Frame) -> tuple[int, ...] | None:
    """Return the fields of an ARP message, or None."""
    data = frame.data
    if len(data) <= 42 or frame.error or not is_for_us(data, True) or data[12:14] != b"\x08\x06":
        return None
    if data[14:20] != bytes([0, 1, 8, 0, 6, 4]) or data[20:22] not in (b"\0\1", b"\0\2"):
        return None
    if data[38:42] != ip_bytes(DEVICE.address):
        return None
    request = data[21] == 1
    return not request, request, int.from_bytes(data[28:32], "big"), int.from_bytes(data[22:28], "big")


def model_echo(frame: Frame) -> tuple[int, bytes] | None:
    """Return who gets the reply to a ping, and the reply."""
    size = ip_size(frame.data, 1)
    if size is None or frame.error or not 8 <= size <= 8 + MOST_ECHO or frame.data[34:36] != b"\x08\0":
        return None
    if not whole(frame.data, 42, size - 8)[1]:
        return None
    request = frame.data[34:34 + size]
    total   = int.from_bytes(request[2:4], "big") + 0x0800
    return (int.from_bytes(frame.data[26:30], "big"),
            bytes(2) + ((total & 0xffff) + (total >> 16)).to_bytes(2, "big") + request[4:])


# Frames.

def echo_request(size: int, rng, kind: int = 0x0800) -> bytes:
    data = struct.pack(">HHHH", kind, 0, rng.randrange(1 << 16), rng.randrange(1 << 16)) + rng.randbytes(size)
    return data[:2] + checksum(data).to_bytes(2, "big") + data[4:]


def ip_frame(rng, protocol: int, payload: bytes, **header) -> bytes:
    sender = f"192.168.1.{rng.randrange(1, 255)}"
    return ethernet(DEVICE.mac, HOST.mac, 0x0800, ip_packet(sender, DEVICE.address, payload, protocol=protocol,
                                                            **header), rng.randbytes(46))


def udp_frame(rng, size: int, port: int = DEVICE.port, length: int | None = None, **header) -> bytes:
    sender = PEER._replace(port=rng.randrange(1 << 16))
    return ip_frame(rng, 17, udp_packet(sender, DEVICE._replace(port=port), rng.randbytes(size), length=length),
                    **header)


def correct(rng) -> bytes:
    """Return a correct frame of one of the three kinds."""
    kind = rng.randrange(4)
    if kind == 0:
        return arp(rng.choice([1, 2]), Station(f"02:00:00:00:00:{rng.randrange(256):02x}", "192.168.1.77"), DEVICE,
                   rng.choice([DEVICE.mac, BROADCAST]))
    if kind == 1:
        return ip_frame(rng, 1, echo_request(rng.randrange(125), rng))
    return udp_frame(rng, rng.choice([0, 1, 2, 3, 4, 5, 17, 18, 19, 28, 100, 1052, 1053, 1471, 1472, 1473]))


def around_the_limits(rng) -> list[bytes]:
    """Return frames at and around each limit."""
    frames = [udp_frame(rng, size) for size in [*range(24), 1052, 1468, 1469, 1470, 1471, 1472, 1473, 2019, 2020]]
    frames += [ip_frame(rng, 1, echo_request(size, rng)) for size in [*range(24), *range(118, 126), 1472]]
    for change in (-9, -8, -1, 1, 4):
        frames.append(udp_frame(rng, 20, length=28 + change))
        frames.append(udp_frame(rng, 20, total=48 + change))
        frames.append(ip_frame(rng, 1, echo_request(20, rng), total=48 + change))
    for total in range(12, 30):
        frames.append(udp_frame(rng, 0, length=(total - 20) % 4096, total=total))
        frames.append(ip_frame(rng, 1, echo_request(0, rng), total=total))
    for length in range(9):
        frames.append(udp_frame(rng, 0, length=length, total=20 + length))
    for wrong in (1, 0xffff, 0x100, 0x8000):
        frames.append(udp_frame(rng, 20, wrong=wrong))
    for fragment in (0, 0x4000, 0x8000, 0x2000, 1, 0x1fff, 0x6000):
        frames.append(udp_frame(rng, 20, fragment=fragment))
    frames.append(udp_frame(rng, 20, options=bytes(4)))
    frames += [udp_frame(rng, 20, first=first) for first in (0x44, 0x46, 0x55, 0x65)]
    frames += [udp_frame(rng, 20, port=DEVICE.port ^ change) for change in (1, 0x8000)]
    frames += [ip_frame(rng, protocol, udp_packet(PEER, DEVICE, bytes(20))) for protocol in (0, 1, 6, 16, 18, 255)]
    frames += [ip_frame(rng, 1, echo_request(20, rng, kind)) for kind in (0, 0x0801, 0x0800, 0x0900, 0x8800)]
    frames.append(datagram(PEER, Station(BROADCAST, DEVICE.address, DEVICE.port), bytes(20)))
    for station in (DEVICE._replace(mac="10:e2:d5:00:00:03"), DEVICE._replace(mac="11:e2:d5:00:00:02"),
                    DEVICE._replace(address="192.168.1.51"), DEVICE._replace(address="193.168.1.50"),
                    Station("ff:ff:00:00:00:00", DEVICE.address, DEVICE.port),
                    Station("ff:ff:d5:00:00:02", DEVICE.address, DEVICE.port),
                    Station("10:e2:ff:ff:ff:ff", DEVICE.address, DEVICE.port)):
        frames.append(datagram(PEER, station, bytes(20)))
        frames.append(arp(1, HOST, station, station.mac))
    tagged = udp_frame(rng, 40)
    frames.append(tagged[:12] + b"\x81\x00\x00\x01" + tagged[12:])
    for base in (udp_frame(rng, 20), ip_frame(rng, 1, echo_request(20, rng)), arp(2, HOST, DEVICE, DEVICE.mac)):
        frames += [base[:length] for length in range(1, len(base) + 1)]
        frames += [base + rng.randbytes(length) for length in range(1, 9)]
        # Each bit of the headers.
        for place in range(42):
            changed = bytearray(base)
            changed[place] ^= 1 << rng.randrange(8)
            frames.append(bytes(changed))
    frames += [arp(operation, HOST, DEVICE, DEVICE.mac) for operation in (0, 3, 0x101, 0x102)]
    return frames


def drawn(rng, count: int) -> list[Frame]:
    """Return correct and damaged frames in any order."""
    frames = []
    for _ in range(count):
        frame = bytearray(correct(rng))
        fate  = rng.randrange(6)
        if fate == 0:
            frame[rng.randrange(min(len(frame), 44))] ^= 1 << rng.randrange(8)
        elif fate == 1:
            del frame[rng.randrange(1, len(frame)):]
        elif fate == 2:
            frame += rng.randbytes(rng.randrange(20))
        frames.append(Frame(bytes(frame), rng.random() < 0.1))
    return frames


# Runs.

def run(core: StreamCore, layout, frames: list[Frame], valid: float = 1.0, ready: float = 1.0, seed: int = 1):
    """Put frames into the parser; return the frames of its output."""
    words = [frame_words(frame.data) for frame in frames]
    items = [(word, tail, frame.error) for frame, row in zip(frames, words, strict=True) for word, tail in row]
    got   = core.run(packed(RECEIVED, items), 1 << 18, last=marks(map(len, words)), valid=valid, ready=ready, seed=seed,
                     idle_clocks=300)
    assert got.accepted == len(items)
    return split(unpacked(layout, got.words), list(got.last) if layout != ARP else [True]*len(got.words))


RATES = [(1.0, 1.0), (0.5, 1.0), (1.0, 0.4), (0.3, 0.3)]


def all_frames(rng) -> list[Frame]:
    frames = [Frame(frame) for frame in around_the_limits(rng)] + drawn(rng, 300)
    rng.shuffle(frames)
    return frames


@pytest.mark.parametrize(("valid", "ready"), RATES)
def test_datagrams(cores, valid, ready):
    frames = all_frames(byte_generator(93, str(valid), str(ready)))
    wanted = [items for frame in frames if (items := model_datagram(frame)) is not None]
    assert len(wanted) > 150 and sum(items[-1][2] != 0 for items in wanted) > 20
    cores["datagrams"].reset()
    assert run(cores["datagrams"], DATAGRAMS, frames, valid, ready) == wanted


@pytest.mark.parametrize("ready", [0.1, 0.03])
def test_fields_of_a_datagram_that_waits(cores, ready):
    """However long the last word waits, its fields are those of its datagram, not of the next one."""
    rng    = byte_generator(97, str(ready))
    frames = [Frame(udp_frame(rng, rng.randrange(5))) for _ in range(200)]
    cores["datagrams"].reset()
    assert run(cores["datagrams"], DATAGRAMS, frames, 1.0, ready) == [model_datagram(frame) for frame in frames]


@pytest.mark.parametrize(("valid", "ready"), [(1.0, 1.0), (0.5, 0.5)])
def test_arp(cores, valid, ready):
    frames = all_frames(byte_generator(94, str(valid)))
    wanted = [[fields] for frame in frames if (fields := model_arp(frame)) is not None]
    assert len(wanted) > 60
    cores["arp"].reset()
    assert run(cores["arp"], ARP, frames, valid, ready) == wanted


def replies(rows) -> list[tuple[int, bytes]]:
    """Return receiver and bytes of replies to an echo."""
    result = []
    for row in rows:
        data = b"".join(item[0].to_bytes(4, "big") for item in row)
        _, tail, address, length = row[-1]
        assert length == 4*(len(row) - 1) + tail + 1
        result.append((address, data[:length]))
    return result


@pytest.mark.parametrize(("valid", "ready"), [(0.1, 1.0), (0.05, 0.5)])
def test_echo(cores, valid, ready):
    """With time between the frames, each correct request is answered."""
    frames = all_frames(byte_generator(95, str(valid)))
    wanted = [reply for frame in frames if (reply := model_echo(frame)) is not None]
    assert len(wanted) > 80
    cores["echo"].reset()
    assert replies(run(cores["echo"], ECHO, frames, valid, ready)) == wanted


@pytest.mark.parametrize("ready", [1.0, 0.3, 0.1])
def test_echo_flood(cores, ready):
    """Requests faster than the replies leave: some are discarded, but none is damaged, and two of 64 bytes wait."""
    rng    = byte_generator(96, str(ready))
    frames = [frame for frame in all_frames(rng) if model_echo(frame) or rng.random() < 0.1]
    wanted = [reply for frame in frames if (reply := model_echo(frame)) is not None]
    cores["echo"].reset()
    got    = replies(run(cores["echo"], ECHO, frames, 1.0, ready))
    rest   = iter(wanted)
    assert len(got) > 10 and all(reply in rest for reply in got)
    two = [Frame(ip_frame(rng, 1, echo_request(56, rng))) for _ in range(2)]
    cores["echo"].reset()
    assert replies(run(cores["echo"], ECHO, two, 1.0, ready)) == [model_echo(frame) for frame in two]


def test_off(cores):
    """Without addresses nothing is received."""
    frames = [Frame(udp_frame(byte_generator(97), 20)), Frame(arp(1, HOST, DEVICE, BROADCAST))]
    for kind, layout in (("datagrams", DATAGRAMS), ("arp", ARP)):
        cores[kind].reset()
        cores[kind].set(on=0)
        assert run(cores[kind], layout, frames) == []
        cores[kind].set(on=1)
        assert len(run(cores[kind], layout, frames)) == 1


@pytest.mark.parametrize("reset_clock", [3, 8, 17, 22, 25, 29])
def test_reset(cores, reset_clock):
    """After a reset in mid-frame the next frames are received."""
    rng    = byte_generator(98)
    frames = [Frame(udp_frame(rng, 28)), Frame(udp_frame(rng, 41))]
    core   = cores["datagrams"]
    core.reset()
    core.run(packed(RECEIVED, [(word, tail, 0) for word, tail in frame_words(frames[0].data)]), 1 << 10,
             reset_clock=reset_clock, ready=0.2)
    core.reset()
    assert run(core, DATAGRAMS, frames) == [model_datagram(frame) for frame in frames]


@pytest.mark.parametrize("size", [0, 18, 28, 1052])
def test_speed(cores, size):
    """The parser keeps pace with a wire of 1 Gbit/s at 60 MHz."""
    rng    = byte_generator(99)
    frames = [Frame(udp_frame(rng, size)) for _ in range(50)]
    words  = [frame_words(frame.data) for frame in frames]
    core   = cores["datagrams"]
    core.reset()
    got    = core.run(packed(RECEIVED, [(word, tail, 0) for row in words for word, tail in row]), 1 << 16,
                      last=marks(map(len, words)), idle_clocks=300)
    on_wire = len(frames)*(8 + len(frames[0].data) + 4 + 12)
    assert got.last.sum() == len(frames) and got.clocks/60e6 < on_wire/125e6
