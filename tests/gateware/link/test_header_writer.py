#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Frames that the network puts together, against headers as the RFCs define them."""

from __future__ import annotations

import ipaddress
import struct

import pytest
from litex.gen import LiteXModule
from litex.soc.interconnect import stream
from migen import Cat, If, Signal

from litestereo.gateware.link.header_writer import HeaderWriter
from litestereo.sim.cores.stream_core import StreamCore
from litestereo.soc.parts.add_frame_link import MAC_ADDRESS
from support.ethernet_frames import BROADCAST, DEVICE, Station, arp, checksum, ip_bytes, mac_bytes
from support.frame_words import marks, packed, split, unpacked
from support.pairs import byte_generator

SENT = [("data", 32), ("tail", 2)]
#: What is sent: its kind and its receiver; of an ARP message also the MAC address, in `data` and `port`.
ITEM = [("data", 32), ("last_be", 4), ("kind", 2), ("address", 32), ("port", 16), ("length", 16)]
DATAGRAM, REQUEST, REPLY, ECHO = range(4)

#: MAC addresses of the table: this, and the last byte of the IP address. It knows none with the highest bit set.
STATIONS = 0x020000000a00
NETMASK, GATEWAY = "255.255.255.0", "192.168.1.1"


class Writer(LiteXModule):
    """The writer, with one queue of all that it sends, and a table that answers after some clocks."""
    def __init__(self) -> None:
        self.sink    = sink = stream.Endpoint(ITEM)
        self.writer  = writer = HeaderWriter()
        self.source  = writer.source
        self.on      = Signal()
        self.netmask = Signal(32)
        self.gateway = Signal(32)

        # # #

        asked, wait, busy = Signal(32), Signal(4), Signal()
        is_arp, is_echo = Signal(), Signal()
        self.comb += [
            is_arp.eq((sink.kind == REQUEST) | (sink.kind == REPLY)),
            is_echo.eq(sink.kind == ECHO),
            writer.on.eq(self.on),
            writer.mac_address.eq(MAC_ADDRESS),
            writer.ip_address.eq(int.from_bytes(ip_bytes(DEVICE.address), "big")),
            writer.netmask.eq(self.netmask),
            writer.gateway.eq(self.gateway),
            writer.arp.valid.eq(sink.valid & is_arp),
            writer.arp.request.eq(sink.kind == REQUEST),
            writer.arp.reply.eq(sink.kind == REPLY),
            writer.arp.ip_address.eq(sink.address),
            writer.arp.mac_address.eq(Cat(sink.data, sink.port)),
            writer.echo.valid.eq(sink.valid & is_echo),
            writer.echo.data.eq(sink.data),
            writer.echo.last.eq(sink.last),
            writer.echo.tail.eq(sink.port),
            writer.echo_to.eq(sink.address),
            writer.echo_bytes.eq(sink.length),
            writer.sink.valid.eq(sink.valid & ~is_arp & ~is_echo),
            writer.sink.data.eq(sink.data),
            writer.sink.last.eq(sink.last),
            writer.sink.last_be.eq(sink.last_be),
            writer.sink.ip_address.eq(sink.address),
            writer.sink.src_port.eq(DEVICE.port),
            writer.sink.dst_port.eq(sink.port),
            writer.sink.length.eq(sink.length),
            If(is_arp, sink.ready.eq(writer.arp.ready))
            .Elif(is_echo, sink.ready.eq(writer.echo.ready))
            .Else(sink.ready.eq(writer.sink.ready)),
            writer.request.ready.eq(~busy),
            writer.response.valid.eq(busy & (wait == 0)),
            writer.response.failed.eq(asked[7]),
            writer.response.mac_address.eq(STATIONS + asked[:8]),
        ]
        self.sync += [
            wait.eq(wait - (wait != 0)),
            If(writer.request.valid & writer.request.ready,
                busy.eq(1),
                asked.eq(writer.request.ip_address),
                wait.eq(asked[:4])
            ),
            If(writer.response.valid & writer.response.ready, busy.eq(0)),
        ]


@pytest.fixture(scope="module")
def built():
    return StreamCore(Writer(), ["on", "netmask", "gateway"])


@pytest.fixture
def core(built):
    built.reset()
    built.set(on=1, netmask=int(ipaddress.IPv4Address(NETMASK)), gateway=int(ipaddress.IPv4Address(GATEWAY)))
    return built


def item_rows(kind: int, address: str, payload: bytes = b"", port: int = 0, mac: str = BROADCAST) -> list[tuple]:
    """Return the items of one thing to send."""
    receiver = int.from_bytes(ip_bytes(address), "big")
    if kind in (REQUEST, REPLY):
        number = int.from_bytes(mac_bytes(mac), "big")
        return [(number & 0xffffffff, 0, kind, receiver, number >> 32, 0)]
    order = "big" if kind == ECHO else "little"
    words = [int.from_bytes(payload[start:start + 4].ljust(4, b"\x66"), order) for start in range(0, len(payload), 4)]
    tail  = (len(payload) - 1) % 4
    return [(word, 1 << tail if index == len(words) - 1 else 0, kind, receiver, tail if kind == ECHO else port,
             len(payload)) for index, word in enumerate(words)]


def expected(kind: int, address: str, payload: bytes = b"", port: int = 0, mac: str = BROADCAST,
             gateway: str = GATEWAY) -> bytes | None:
    """Return the frame, without the filling of short ones; None if it is dropped."""
    if kind in (REQUEST, REPLY):
        to = BROADCAST if kind == REQUEST else mac
        return arp(kind, DEVICE, Station(to, address), to)[:42]
    hop = address
    if ipaddress.IPv4Address(address) not in ipaddress.IPv4Network(f"{DEVICE.address}/{NETMASK}", strict=False):
        hop = gateway if gateway != "0.0.0.0" else address
    last = ip_bytes(hop)[3]
    if last & 0x80:
        return None
    if kind == DATAGRAM:
        payload = struct.pack(">HHHH", DEVICE.port, port, len(payload) + 8, 0) + payload
    def header(check: int) -> bytes:
        return struct.pack(">BBHHHBBH4s4s", 0x45, 0, 20 + len(payload), 0, 0, 128, 1 if kind == ECHO else 17, check,
                           ip_bytes(DEVICE.address), ip_bytes(address))
    return ((STATIONS + last).to_bytes(6, "big") + mac_bytes(DEVICE.mac) + b"\x08\0" + header(checksum(header(0)))
            + payload)


def send(core: StreamCore, things: list[dict], valid: float = 1.0, ready: float = 1.0, seed: int = 1) -> list[bytes]:
    """Send all; return the frames."""
    rows = [item_rows(**thing) for thing in things]
    run  = core.run(packed(ITEM, [item for row in rows for item in row]), 1 << 18, last=marks(map(len, rows)),
                    valid=valid, ready=ready, seed=seed, idle_clocks=200)
    assert run.accepted == sum(map(len, rows))
    frames = []
    for row in split(unpacked(SENT, run.words), list(run.last)):
        data = b"".join(word.to_bytes(4, "little") for word, _ in row)
        assert data[:2] == bytes(2)
        frames.append(data[2:len(data) - 3 + row[-1][1]])
    return frames


def drawn(rng, count: int) -> list[dict]:
    """Return things to send, of all kinds, lengths and receivers."""
    things = []
    for _ in range(count):
        near = f"192.168.1.{rng.randrange(256)}"
        kind = rng.choice([DATAGRAM, DATAGRAM, REQUEST, REPLY, ECHO])
        thing = {"kind": kind, "address": rng.choice([near, near, f"10.{rng.randrange(256)}.255.{rng.randrange(256)}",
                                                      f"192.168.{rng.randrange(256)}.7", "255.255.255.127"])}
        if kind == DATAGRAM:
            size = rng.choice([1, 2, 3, 4, 17, 18, 19, 28, 1052, 1469, 1470, 1471, 1472])
            thing |= {"payload": rng.randbytes(size), "port": rng.randrange(1 << 16)}
        elif kind == ECHO:
            thing["payload"] = rng.randbytes(rng.randrange(9, 129))
        else:
            thing["mac"] = rng.choice([BROADCAST, "02:12:34:56:78:9a"])
        things.append(thing)
    return things


@pytest.mark.parametrize(("valid", "ready"), [(1.0, 1.0), (1.0, 0.4), (0.3, 1.0), (0.4, 0.4)])
def test_frames(core, valid, ready):
    things = drawn(byte_generator(100, str(valid), str(ready)), 400)
    wanted = [frame for thing in things if (frame := expected(**thing)) is not None]
    assert 250 < len(wanted) < 400
    assert send(core, things, valid, ready) == wanted


@pytest.mark.parametrize("gateway", ["0.0.0.0", "192.168.1.200", "192.168.1.2"])
def test_gateways(core, gateway):
    """Without a gateway all receivers are looked for on the wire; one that is unknown drops what goes to it."""
    core.set(gateway=int(ipaddress.IPv4Address(gateway)))
    things = drawn(byte_generator(101, gateway), 100)
    assert send(core, things) == [frame for thing in things
                                  if (frame := expected(**thing, gateway=gateway)) is not None]


@pytest.mark.parametrize("bit", range(32))
def test_each_bit_of_the_netmask(core, bit):
    """A receiver whose address differs in one bit is on another subnet if the netmask has that bit."""
    address = str(ipaddress.IPv4Address(int(ipaddress.IPv4Address(DEVICE.address)) ^ 1 << bit))
    (frame,) = send(core, [{"kind": DATAGRAM, "address": address, "payload": b"1234"}]) or [None]
    assert frame == expected(DATAGRAM, address, b"1234")


def test_off(core):
    """Without addresses everything is dropped."""
    core.set(on=0)
    assert send(core, drawn(byte_generator(102), 50)) == []
    core.set(on=1)
    assert send(core, [{"kind": REQUEST, "address": "192.168.1.9"}]) == [expected(REQUEST, "192.168.1.9")]


def test_speed(core):
    """Messages without payload leave at the pace of a wire of 1 Gbit/s, at 60 MHz."""
    rows = [item_rows(DATAGRAM, "192.168.1.0", bytes(28))]*40
    run  = core.run(packed(ITEM, [item for row in rows for item in row]), 1 << 16, last=marks(map(len, rows)),
                    idle_clocks=300)
    assert run.last.sum() == 40 and run.clocks/60e6 < 40*(8 + 42 + 28 + 4 + 12)/125e6


@pytest.mark.parametrize("reset_clock", [3, 9, 14, 20, 26, 33])
def test_reset(core, reset_clock):
    """After a reset in mid-frame the next frame is whole."""
    thing = {"kind": DATAGRAM, "address": "192.168.1.3", "payload": bytes(range(41)), "port": 7}
    core.run(packed(ITEM, item_rows(**thing)), 1 << 10, last=marks([11]), reset_clock=reset_clock)
    core.reset()
    assert send(core, [thing]) == [expected(**thing)]
