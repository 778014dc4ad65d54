#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""MAC, LiteEth's UDP core and the frame link, from the wire's bytes to memory and back."""

from __future__ import annotations

import struct

import numpy as np
import pytest
from liteeth.common import convert_ip, eth_phy_description
from litex.gen import LiteXModule
from litex.soc.interconnect import stream
from migen import ClockDomain, ClockDomainsRenamer, ClockSignal, If, ResetSignal, Signal

from litestereo.gateware.link.event_counters import COUNTER_NUMBERS
from litestereo.gateware.link.network import Network
from litestereo.gateware.peripherals.frame_link import FrameLink
from litestereo.gateware.peripherals.frame_link_csr import COUNTERS
from litestereo.host_tools.protocol.messages import Message, MessageType
from litestereo.sim.cores.stream_core import StreamCore
from litestereo.soc.parts.add_frame_link import IP_ADDRESS, MAC_ADDRESS, NETMASK, UDP_PORT
from litestereo.soc.parts.wide_ram import WideRAM
from support.ethernet_frames import (
    BROADCAST,
    DEVICE,
    HOST,
    Station,
    arp,
    checksum,
    datagram,
    ethernet,
    host_takes,
    ip_bytes,
    ip_packet,
    off_the_wire,
    on_the_wire,
)
from support.pairs import byte_generator

TOKEN  = 0x1234
PEER   = HOST._replace(port=40001)
UNKNOWN = Station("00:00:00:00:00:00", HOST.address)


class Wire(LiteXModule):
    """A PHY in a clock domain, by default the system's."""
    dw = 8

    def __init__(self, with_preamble_crc: bool, clock: str) -> None:
        self.with_preamble_crc = with_preamble_crc
        self.sink   = stream.Endpoint(eth_phy_description(8))
        self.source = stream.Endpoint(eth_phy_description(8))
        self.cd_eth_rx = ClockDomain()
        self.cd_eth_tx = ClockDomain()
        for domain in (self.cd_eth_rx, self.cd_eth_tx):
            self.comb += [domain.clk.eq(ClockSignal(clock)), domain.rst.eq(ResetSignal(clock))]


class Device(LiteXModule):
    """All cores with a memory, and the wire as bytes."""
    def __init__(self, with_preamble_crc: bool, clock: str = "sys") -> None:
        self.wire    = wire = Wire(with_preamble_crc, clock)
        # Each form of the network has one kind of wire.
        self.network = network = Network(wire, UDP_PORT, clk_freq=1000000, pipelined=with_preamble_crc)
        self.ram     = ram  = WideRAM(1 << 15)
        self.link    = link = FrameLink(ram.get_port("read"), ram.get_port("write"), UDP_PORT, with_csr=False)
        self.sink, self.source = stream.Endpoint([("data", 8)]), stream.Endpoint([("data", 8)])
        self.comb += [
            network.mac_address.eq(MAC_ADDRESS),
            network.ip_address.eq(convert_ip(IP_ADDRESS)),
            network.netmask.eq(convert_ip(NETMASK)),
            network.source.connect(link.sink),
            link.source.connect(network.sink),
            self.sink.connect(wire.source, keep={"valid", "ready", "last", "data"}),
            wire.sink.connect(self.source, keep={"valid", "ready", "last", "data"}),
            link.sorter.enable.eq(1),
            link.sorter.token.eq(TOKEN),
            link.sorter.peer_address.eq(int.from_bytes(ip_bytes(PEER.address), "big")),
            link.sorter.peer_port.eq(PEER.port),
            link.sorter.mailbox_base.eq(1 << 14),
            link.table.frame_id.eq(7),
            link.table.pixels.eq(4096),
            link.queue.job.address.eq(int.from_bytes(ip_bytes(PEER.address), "big")),
            link.queue.job.port.eq(PEER.port),
            link.queue.job.type.eq(0x87),
        ]
        self.open, self.burst, self.length = link.table.open, link.queue.burst, Signal(16)
        self.comb += link.queue.job.length.eq(self.length)
        self.produced, self.missing    = link.sorter.produced, link.table.missing
        self.counter_index, self.counter_read = link.counters.index, link.counters.read
        self.counter                          = link.counters.value


#: Numbers of the frame link's counters.
NUMBERS = dict(zip(COUNTERS, COUNTER_NUMBERS, strict=True))

SETTINGS = ["open", "burst", "length", "counter_index", "counter_read"]
STATUS   = ["produced", "missing", "counter"]


class FastWireDevice(LiteXModule):
    """The device with a clock of half the wire's: a word is 32 bits, so this is 1 Gbit/s at 62.5 MHz."""
    def __init__(self) -> None:
        self.device  = device = ClockDomainsRenamer({"sys": "slow"})(Device(True, "fast"))
        self.cd_slow = ClockDomain()
        self.cd_fast = ClockDomain()
        self.sink, self.source = device.sink, device.source
        self.torn    = Signal() # A frame to the wire had a gap.
        for name in SETTINGS + STATUS:
            setattr(self, name, getattr(device, name))
        slow, inside = Signal(reset_less=True), Signal()
        self.comb += [
            self.cd_slow.clk.eq(slow),
            self.cd_slow.rst.eq(ResetSignal()),
            self.cd_fast.clk.eq(ClockSignal()),
            self.cd_fast.rst.eq(ResetSignal()),
        ]
        self.sync += [
            slow.eq(~slow),
            If(self.source.valid, inside.eq(~self.source.last)),
            If(inside & ~self.source.valid, self.torn.eq(1)),
        ]


class Host:
    """The host at the other end of the wire."""
    def __init__(self, with_preamble_crc: bool, device: LiteXModule, status: list[str], pulse_clocks: int = 1) -> None:
        self.framed = with_preamble_crc
        self.core   = StreamCore(device, SETTINGS, status=status)
        self.pulse_clocks = pulse_clocks

    def exchange(self, frames: list[bytes], answers: int, settle: int = 3000) -> list[bytes]:
        """Send frames back to back, and receive the device's frames."""
        if self.framed:
            frames = [on_the_wire(frame) for frame in frames]
        data  = np.frombuffer(b"".join(frames), np.uint8).astype(np.uint32)
        last  = np.zeros(len(data), bool)
        last[np.cumsum([len(frame) for frame in frames]) - 1 if frames else []] = True
        taken: list[bytes] = []
        while len(taken) < answers:
            run   = self.core.run(data, 1 << 20 if answers > 1 else 1600, last=last, idle_clocks=settle)
            ends  = np.flatnonzero(run.last)
            bytes_ = run.words[:, 0].astype(np.uint8).tobytes()
            begin = 0
            for end in ends:
                taken.append(bytes_[begin:end + 1])
                begin = end + 1
            assert begin == len(bytes_), "a frame without an end"
            if not len(ends):
                break
            data, last = data[:0], last[:0]
        if answers == 0:
            self.core.run(data, 1, last=last, idle_clocks=settle)
        return [off_the_wire(frame) for frame in taken] if self.framed else taken

    def pulse(self, name: str) -> None:
        self.core.set(**{name: 1})
        self.core.run(np.zeros(0, np.uint32), 1, ready=0.0, idle_clocks=self.pulse_clocks)
        self.core.set(**{name: 0})
        self.core.run(np.zeros(0, np.uint32), 1, ready=0.0, idle_clocks=100)

    def counter(self, name: str) -> int:
        """Return a counter of the frame link."""
        self.core.set(counter_index=NUMBERS[name])
        self.pulse("counter_read")
        return self.core.get("counter")


@pytest.fixture(scope="module", params=[False, True], ids=["model", "wire"])
def host(request):
    return Host(request.param, Device(request.param), STATUS)


@pytest.fixture(scope="module")
def fast_wire():
    return Host(True, FastWireDevice(), [*STATUS, "torn"], pulse_clocks=2)


@pytest.fixture(autouse=True)
def fresh(request):
    # A reset takes some clocks to reach the other clock domain, and the crossings some more to agree on it.
    for name in {"host", "fast_wire"} & set(request.fixturenames):
        core = request.getfixturevalue(name).core
        for _ in range(8):
            core.reset()
        core.run(np.zeros(0, np.uint32), 1, ready=0.0, idle_clocks=64)


def test_arp(host):
    asked = arp(1, HOST, DEVICE._replace(mac=UNKNOWN.mac), BROADCAST)
    assert host.exchange([asked], 1) == [arp(2, DEVICE, HOST, HOST.mac)]
    assert host.exchange([arp(1, HOST, Station(UNKNOWN.mac, "192.168.1.51"), BROADCAST)], 1) == []


def meet(host: Host, frames: list[bytes], answers: int) -> list[bytes]:
    """Send frames; the device asks for the host's address before its first answer."""
    assert host.exchange(frames, 1) == [arp(1, DEVICE, Station(BROADCAST, HOST.address), BROADCAST)]
    return host.exchange([arp(2, HOST, DEVICE, DEVICE.mac)], answers)


@pytest.mark.parametrize("length", [0, 1, 18, 56, 57, 59])
def test_ping(host, length):
    def echo(kind: int) -> bytes:
        packet = struct.pack(">BBHHH", kind, 0, 0, 1, 2) + bytes(range(length))
        return packet[:2] + struct.pack(">H", checksum(packet)) + packet[4:]

    (answer,) = meet(host, [ethernet(DEVICE.mac, HOST.mac, 0x0800, ip_packet(HOST.address, DEVICE.address, echo(8),
                                                                               protocol=1))], 1)
    packet = answer[14:14 + 20 + 8 + length]
    assert packet[20:] == echo(0)


def echo(kind: int, number: int) -> bytes:
    packet = struct.pack(">BBHHH", kind, 0, 0, number, 2) + bytes(range(56))
    return packet[:2] + struct.pack(">H", checksum(packet)) + packet[4:]


def ping(sender: Station, number: int) -> bytes:
    return ethernet(DEVICE.mac, sender.mac, 0x0800, ip_packet(sender.address, DEVICE.address, echo(8, number),
                                                              protocol=1))


def question(station: Station) -> bytes:
    """What the device asks before it knows a station."""
    return arp(1, DEVICE, Station(BROADCAST, station.address), BROADCAST)


def answer(sender: Station, number: int) -> bytes:
    """The frame that a ping is answered by."""
    packet = ip_packet(DEVICE.address, sender.address, echo(0, number), protocol=1, fragment=0)
    # As LiteEth sends it: another time to live.
    packet = packet[:8] + b"\x80" + packet[9:10] + bytes(2) + packet[12:]
    packet = packet[:10] + struct.pack(">H", checksum(packet[:20])) + packet[12:]
    return ethernet(sender.mac, DEVICE.mac, 0x0800, packet)


#: Stations that answer nothing.
SILENT = [Station(f"02:00:00:00:01:{n:02x}", f"192.168.1.{n}") for n in range(200, 208)]

#: Clocks after which the device no longer waits for an answer to ARP. It does not wait again for 31 times as long,
#: longer than any of these tests.
WAIT = 10000


def test_answers_to_silent_stations_delay_and_damage_no_others(host):
    """The first one is waited for, briefly; the others are dropped at once. What follows has its own checksum."""
    assert meet(host, [ping(HOST, 0)], 1) == [answer(HOST, 0)]
    assert host.exchange([ping(SILENT[0], 1)], 1) == [question(SILENT[0])]
    assert host.exchange([ping(HOST, 2)], 1, settle=2*WAIT) == [answer(HOST, 2)]
    for number, station in enumerate(SILENT[1:], 3):
        assert host.exchange([ping(station, number)], 1) == [question(station)]
        assert host.exchange([ping(HOST, number)], 1) == [answer(HOST, number)]


def test_a_new_station_during_the_rest(host):
    """Its first ping is dropped, but its answer to ARP is stored, so the second one is answered."""
    assert host.exchange([ping(SILENT[0], 1)], 1) == [question(SILENT[0])]
    host.exchange([], 0, settle=2*WAIT)
    assert host.exchange([ping(HOST, 2)], 1) == [question(HOST)]
    assert host.exchange([arp(2, HOST, DEVICE, DEVICE.mac)], 0) == []
    assert host.exchange([ping(HOST, 3), ping(HOST, 4)], 2) == [answer(HOST, 3), answer(HOST, 4)]


def test_an_answer_that_was_not_asked_for_is_not_stored(host):
    stranger = Station("02:00:00:00:00:65", HOST.address)
    assert host.exchange([arp(2, stranger, DEVICE, DEVICE.mac)], 0) == []
    assert meet(host, [ping(HOST, 1)], 1) == [answer(HOST, 1)]
    assert host.exchange([arp(2, stranger, DEVICE, DEVICE.mac)], 0) == []
    assert host.exchange([ping(HOST, 2)], 1) == [answer(HOST, 2)]


def test_questions_during_a_wait_are_answered(host):
    assert host.exchange([ping(SILENT[0], 1)], 1) == [question(SILENT[0])]
    mine = arp(1, HOST, DEVICE._replace(mac=UNKNOWN.mac), BROADCAST)
    assert host.exchange([mine, mine], 2) == [arp(2, DEVICE, HOST, HOST.mac)]*2


def test_chunks_at_the_speed_of_the_wire_and_the_map_back(host):
    rng    = byte_generator()
    chunks = {offset: rng.randbytes(1024) for offset in range(0, 8192, 1024)}
    host.pulse("open")
    host.exchange([datagram(PEER, DEVICE, Message(MessageType.UPLOAD, TOKEN, 1, 7, offset, payload).encode())
                   for offset, payload in chunks.items()], 0)
    assert host.core.get("missing") == 0
    assert [host.counter(f"datagrams_{name}") for name in ("received", "overrun", "malformed")] == [8, 0, 0]
    host.core.set(length=8192)
    host.pulse("burst")
    taken    = [host_takes(frame) for frame in meet(host, [], 8)]
    messages = [Message.decode(payload) for port, payload in taken if port == PEER.port]
    assert {message.offset: message.payload for message in messages} == chunks


def test_a_wire_twice_as_fast_as_the_clock(fast_wire):
    """Nothing is lost on the way to memory, and no frame to the wire has a gap: chunks, maps, messages, pings."""
    rng    = byte_generator(103)
    chunks = {offset: rng.randbytes(1024) for offset in range(0, 8192, 1024)}
    fast_wire.pulse("open")
    fast_wire.exchange([datagram(PEER, DEVICE, Message(MessageType.UPLOAD, TOKEN, 1, 7, offset, payload).encode())
                        for offset, payload in chunks.items()], 0)
    assert fast_wire.core.get("missing") == 0
    assert [fast_wire.counter(f"datagrams_{name}") for name in ("received", "overrun", "malformed")] == [8, 0, 0]
    for _ in range(6):
        fast_wire.exchange([datagram(PEER, DEVICE, Message(MessageType.CONFIGURE).encode())], 0)
    assert fast_wire.core.get("produced") == 6
    for length in (8192, 1021, 1):
        fast_wire.core.set(length=length)
        fast_wire.pulse("burst")
        parts    = -(-length//1024)
        frames   = meet(fast_wire, [], parts) if length == 8192 else fast_wire.exchange([], parts)
        messages = [Message.decode(host_takes(frame)[1]) for frame in frames]
        assert b"".join(message.payload for message in messages) == b"".join(chunks.values())[:length]
    assert fast_wire.exchange([ping(HOST, 3), ping(HOST, 4)], 2) == [answer(HOST, 3), answer(HOST, 4)]
    assert fast_wire.core.get("torn") == 0


@pytest.mark.parametrize("length", [0, 1, 2, 3, 4, 1021, 1024])
def test_other_messages_go_to_the_mailbox(host, length):
    host.exchange([datagram(PEER, DEVICE, Message(MessageType.CONFIGURE, payload=bytes(length)).encode())], 0)
    assert host.core.get("produced") == 1


def test_frames_for_others_and_broken_ones_do_no_harm(host):
    rng     = byte_generator()
    message = datagram(PEER, DEVICE, Message(MessageType.HELLO, payload=bytes(4)).encode())
    frames  = [ethernet(rng.choice([DEVICE.mac, BROADCAST]), HOST.mac, rng.choice([0x0800, 0x0806, 0x86dd]),
                        rng.randbytes(rng.randint(46, 1500))) for _ in range(300)]
    for _ in range(300):
        # No checksum protects the UDP header and the padding.
        broken = bytearray(message)
        broken[rng.choice([*range(14, 34), *range(42, 74)])] ^= 1 << rng.randrange(8)
        frames.append(bytes(broken))
    rng.shuffle(frames)
    host.exchange(frames, 0)
    assert host.core.get("produced") == 0
    host.exchange([message], 0)
    assert host.core.get("produced") == 1
