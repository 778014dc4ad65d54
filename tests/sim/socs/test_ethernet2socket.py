#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The litex_sim module that connects the simulated Ethernet to a UDP socket, without a SoC."""

from __future__ import annotations

import os
import socket
import struct
import subprocess

import pytest

from support.ethernet_bench import MODULE, EthernetBench, build, litex_sim_core
from support.ethernet_frames import (
    BROADCAST,
    DEVICE,
    HOST,
    Station,
    arp,
    datagram,
    ethernet,
    host_takes,
    ip_packet,
    udp_packet,
)
from support.pairs import SEED, byte_generator

UNKNOWN = Station("00:00:00:00:00:00", "192.168.1.100")


class Host:
    """A host's socket: on loopback a datagram arrives within the call that sends it, so no test waits."""
    def __init__(self, port: int) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.setblocking(False)
        self.device  = ("127.0.0.1", port)
        self.station = HOST._replace(port=self.socket.getsockname()[1])

    def send(self, payload: bytes) -> bytes:
        """Send a datagram; return the frame that must result."""
        self.socket.sendto(payload, self.device)
        return datagram(self.station, DEVICE, payload)

    def received(self) -> list[bytes]:
        """Return everything received from the device."""
        payloads = []
        while True:
            try:
                payload, sender = self.socket.recvfrom(4096)
            except BlockingIOError:
                return payloads
            assert sender == self.device
            payloads.append(payload)


@pytest.fixture
def bench():
    """Return the module with its defaults."""
    with EthernetBench() as bench:
        yield bench


@pytest.fixture
def hosts():
    """Return a maker of hosts, which are closed at the end."""
    made = []

    def make(port: int) -> Host:
        made.append(Host(port))
        return made[-1]

    yield make
    for host in made:
        host.socket.close()


@pytest.fixture
def host(bench, hosts):
    """Return a host at the module with its defaults."""
    return hosts(bench.ports[0])


@pytest.mark.parametrize("length", [0, 1, 17, 18, 19, 28, 1051, 1052, 1472])
def test_datagram_to_frame(bench, host, length):
    """A datagram becomes exactly this frame, padded to 60 bytes, without a gap."""
    expected = host.send(byte_generator(length).randbytes(length))
    (frame,) = bench.run(3000)
    assert frame.data == expected
    assert len(frame.data) == max(60, 42 + length)
    assert bench.outcomes() == {}


@pytest.mark.parametrize("gap", [None, 1, 24, 100])
def test_pace(hosts, gap):
    """A frame takes a clock per byte, and the gap between frames is exact."""
    with EthernetBench(None if gap is None else {"gap": gap}) as bench:
        host     = hosts(bench.ports[0])
        rng      = byte_generator(100)
        expected = [host.send(rng.randbytes(rng.choice((0, 28, 500, 1052)))) for _ in range(40)]
        frames   = bench.run(80000)
    assert [frame.data for frame in frames] == expected
    for before, after in zip(frames, frames[1:], strict=False):
        assert after.clock - before.clock == len(before.data) + (gap or 24)


@pytest.mark.parametrize("clocks", [200, 1000, 1001])
def test_stranger(hosts, clocks):
    """It sends its datagram at its pace, also while the host sends, and answers no ARP."""
    stranger = Station("02:00:00:00:00:c8", "192.168.1.200", 40000)
    payload  = bytes(range(30))
    expected = datagram(stranger, DEVICE, payload)
    with EthernetBench({"stranger_clocks": clocks, "stranger_payload": payload.hex()}) as bench:
        assert {frame.data for frame in bench.run(20*clocks)} == {expected}
        host   = hosts(bench.ports[0])
        mine   = [host.send(bytes(size)) for size in (0, 20, 40)]
        bench.send([arp(1, DEVICE, Station(BROADCAST, stranger.address), BROADCAST)])
        frames = bench.run(30*clocks)
    assert [frame.data for frame in frames if frame.data != expected] == mine
    assert abs(sum(frame.data == expected for frame in frames) - 30) <= 1


def test_idle_host_is_heard(bench, host):
    """After any silence, a datagram becomes a frame within 64 clocks."""
    clock = 0
    for idle in (1, 63, 64, 65, 1000):
        assert bench.run(idle) == []
        expected = host.send(b"hello")
        (frame,) = bench.run(200)
        assert frame.data == expected
        assert frame.clock <= clock + idle + 66
        clock += idle + 200


def test_burst(bench, host):
    """The socket has room for a burst: a pair of images of 640 x 480 at least."""
    if os.geteuid() != 0:
        pytest.skip("only root may go beyond the system's limit of a socket's buffer")
    expected = [host.send(bytes([number % 256])*1052) for number in range(600)]
    frames   = bench.run(600*(1094 + 24) + 200)
    assert [frame.data for frame in frames] == expected


def test_frame_to_its_host(bench, hosts):
    """Each of two hosts receives what is for its port, and only the bytes of the datagram, without the padding."""
    first, second = (hosts(bench.ports[0]) for _ in range(2))
    rng = byte_generator(101)
    sent: dict[Host, list[bytes]] = {first: [], second: []}
    frames = []
    for length in (0, 1, 28, 1052, 1472, 17, 18):
        for host in (second, first):
            sent[host].append(rng.randbytes(length))
            frames.append(datagram(DEVICE, host.station, sent[host][-1], padding=rng.randbytes(46)))
    assert bench.deliver(frames) == []
    assert first.received() == sent[first]
    assert second.received() == sent[second]
    assert bench.outcomes() == {"datagram": 14}


def test_both_ways_at_once(bench, host):
    """Neither direction waits for the other."""
    rng      = byte_generator(102)
    payloads = [rng.randbytes(1052) for _ in range(20)]
    expected = [host.send(payload) for payload in payloads]
    bench.send([datagram(DEVICE, host.station, payload) for payload in payloads])
    frames = bench.run(20*(1094 + 24) + 100)
    assert [frame.data for frame in frames] == expected
    assert host.received() == payloads


@pytest.mark.parametrize("to", [BROADCAST, HOST.mac])
def test_arp_answered(bench, to):
    (answer,) = bench.deliver([arp(1, DEVICE, UNKNOWN, to)])
    assert answer.data == arp(2, HOST, DEVICE, DEVICE.mac)
    assert bench.outcomes() == {"arp_request": 1}


def test_arp_before_what_waits(bench, host):
    """The ARP answer is the next frame: queued frames are for the device that asks, which may need the answer first."""
    frames = [host.send(bytes(1000)) for _ in range(3)]
    bench.send([arp(1, DEVICE, UNKNOWN, BROADCAST)])
    got = [frame.data for frame in bench.run(6000)]
    assert got == [frames[0], arp(2, HOST, DEVICE, DEVICE.mac), *frames[1:]]


def test_datagram_right_after_arp(bench, host):
    """A datagram during the answer starts after its gap, after any silence."""
    for idle in (500, 513, 537, 561):
        bench.run(idle)
        bench.send([arp(1, DEVICE, UNKNOWN, BROADCAST)])
        # The request, and the start of the answer.
        bench.run(60 + 20)
        expected = host.send(b"at once")
        answer, frame = bench.run(200)
        assert (answer.data, frame.data) == (arp(2, HOST, DEVICE, DEVICE.mac), expected)
        assert frame.clock - answer.clock == 60 + 24


def test_arp_not_answered(bench):
    """Requests for other addresses, answers, and ARP not for IPv4 on Ethernet are ignored."""
    request = arp(1, DEVICE, UNKNOWN, BROADCAST)
    others  = [arp(1, DEVICE, UNKNOWN._replace(address="192.168.1.101"), BROADCAST),
               arp(2, DEVICE, HOST, HOST.mac), arp(1, DEVICE, UNKNOWN, "02:00:00:00:00:65")]
    others += [request[:14 + place] + b"\x77" + request[15 + place:] for place in range(8)]
    assert bench.deliver(others) == []
    assert bench.outcomes() == {"other": len(others)}


def packet_frame(payload: bytes = b"", **wrong) -> bytes:
    return ethernet(HOST.mac, DEVICE.mac, 0x0800, ip_packet(DEVICE.address, HOST.address, payload, **wrong))


TO_NINE = HOST._replace(port=9)
UDP     = udp_packet(DEVICE, TO_NINE, b"x"*40)
FAULTS  = {
    "short":        [datagram(DEVICE, TO_NINE, b"")[:59], b"x", datagram(DEVICE, TO_NINE, b"")[:13]],
    "long":         [datagram(DEVICE, TO_NINE, bytes(1473)), bytes(2000)],
    "ip_length":    [packet_frame(UDP, total=69), packet_frame(UDP, total=19), packet_frame(UDP, total=0xffff),
                     packet_frame(UDP, first=0x65), packet_frame(UDP, first=0x44), packet_frame(UDP[:8], first=0x4f),
                     datagram(DEVICE, TO_NINE, bytes(500))[:300]],
    "ip_checksum":  [packet_frame(UDP, wrong=1), packet_frame(UDP, wrong=0x8000)],
    "fragment":     [packet_frame(UDP, fragment=0x2000), packet_frame(UDP, fragment=1)],
    "udp_length":   [packet_frame(udp_packet(DEVICE, TO_NINE, b"x"*40, length=length)) for length in (0, 7, 47, 49)]
                    + [packet_frame(UDP[:7]), packet_frame()],
    "udp_checksum": [packet_frame(udp_packet(DEVICE, TO_NINE, b"x"*41, check=True, wrong=1))],
    "sender":       [datagram(DEVICE._replace(port=19540), TO_NINE, b""),
                     datagram(DEVICE._replace(address="192.168.1.51"), TO_NINE, b"")],
    "unsent":       [datagram(DEVICE, HOST._replace(port=0), b"")],
}


@pytest.mark.parametrize("name", FAULTS)
def test_fault_of_the_soc(hosts, name):
    """A faulty frame of the SoC is counted, reported once, and does not affect the next ones."""
    with EthernetBench() as bench:
        host = hosts(bench.ports[0])
        assert bench.deliver(FAULTS[name]) == []
        outcomes = bench.outcomes()
        if name == "unsent":
            assert outcomes.pop("datagram") == 1
        assert outcomes == {name: len(FAULTS[name])}
        bench.deliver([datagram(DEVICE, host.station, b"well")])
        assert host.received() == [b"well"]
    assert len(bench.complaints) == 1
    assert bench.complaints[0].startswith("[ethernet2socket] dropped")


def test_options_and_checksum(bench, host):
    """IP options and a UDP checksum are accepted, although LiteEth sends neither."""
    udp = udp_packet(DEVICE, host.station, b"odd", check=True)
    bench.deliver([packet_frame(udp, options=b"\1"*8)])
    assert host.received() == [b"odd"]


def test_other_frames(bench):
    """Frames for other hosts, and other protocols than UDP, are dropped silently."""
    elsewhere = HOST._replace(port=9, address="192.168.1.101")
    bench.deliver([datagram(DEVICE, elsewhere, b""), datagram(DEVICE, TO_NINE._replace(mac=BROADCAST), b""),
                   packet_frame(bytes(64), protocol=1), ethernet(HOST.mac, DEVICE.mac, 0x86dd, bytes(64))])
    assert bench.outcomes() == {"other": 4}


def test_datagrams_that_do_not_fit(hosts):
    """Datagrams too long for a frame, or from another loopback address, are dropped; the next one passes."""
    with EthernetBench() as bench:
        host = hosts(bench.ports[0])
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
            stranger.bind(("127.0.0.2", 0))
            stranger.sendto(b"hello", host.device)
        host.send(bytes(1473))
        host.send(bytes(60000))
        expected = host.send(b"fits")
        assert [frame.data for frame in bench.run(200)] == [expected]
        assert bench.outcomes() == {"long_datagram": 2, "datagram_elsewhere": 1}
    assert len(bench.complaints) == 2


def test_mutated_frames(bench, host):
    """The module delivers exactly the frames that a second implementation of the host accepts."""
    rng      = byte_generator(103)
    expected = []
    count    = 0
    for number in range(3000):
        udp   = udp_packet(DEVICE, host.station, rng.randbytes(rng.randrange(60)), check=rng.random() < 0.5)
        frame = bytearray(packet_frame(udp, options=b"\1"*(4*rng.choice((0, 0, 1, 10)))))
        for _ in range(rng.choice((0, 1, 1, 2))):
            place         = rng.randrange(len(frame))
            frame[place] ^= 1 << rng.randrange(8)
        if rng.random() < 0.2:
            del frame[rng.randrange(1, len(frame)):]
        taken = host_takes(bytes(frame))
        # Noise must not reach other programs on this machine.
        if taken is None or taken[0] == host.station.port:
            bench.send([bytes(frame)])
        if taken and taken[0] == host.station.port:
            expected.append(taken[1])
        if number % 50 == 49:
            bench.run(10000)
            assert host.received() == expected
            count += len(expected)
            expected.clear()
    assert count > 500


def test_fuzz(hosts):
    """After 200000 faulty frames no sanitizer has reported an error, and the module still works."""
    print(f"LITESTEREO_SEED={SEED}")
    with EthernetBench() as bench:
        host      = hosts(bench.ports[0])
        templates = [datagram(DEVICE, host.station, bytes(length)) for length in (0, 28, 100)]
        templates += [arp(1, DEVICE, UNKNOWN, BROADCAST),
                      packet_frame(udp_packet(DEVICE, host.station, b"odd", check=True), options=b"\1"*12)]
        delivered = bench.fuzz(templates, SEED, 200_000)
        outcomes  = bench.outcomes()
        assert 1000 < delivered == outcomes.pop("datagram")
        assert sum(outcomes.values()) + delivered == 200_000
        for name in ("arp_request", "other", *FAULTS):
            assert name == "unsent" or outcomes[name] > 50, name
        bench.deliver([datagram(DEVICE, host.station, b"well")])
        assert host.received() == [b"well"]
        expected = host.send(b"and you")
        assert [frame.data for frame in bench.run(200)] == [expected]


@pytest.mark.parametrize("seed", [0, 2**32 - 1, 2**32, -1])
def test_fuzz_of_any_seed(bench, seed):
    """No seed makes the generator repeat one frame."""
    bench.fuzz([datagram(DEVICE, TO_NINE, bytes(28))], seed, 1000)
    assert len(bench.outcomes()) > 5


def read_capture(path) -> list[tuple[float, int, bytes]]:
    """Return nanoseconds, original length and bytes of each frame of a pcap file."""
    data = path.read_bytes()
    assert struct.unpack_from("<IHHIIII", data) == (0xa1b23c4d, 2, 4, 0, 0, 1514, 1)
    frames, place = [], 24
    while place < len(data):
        seconds, nanoseconds, kept, length = struct.unpack_from("<IIII", data, place)
        frames.append((seconds*10**9 + nanoseconds, length, data[place + 16:place + 16 + kept]))
        place += 16 + kept
    assert place == len(data)
    return frames


def test_capture(hosts, tmp_path):
    """The capture has every frame of both directions, in order of time, bad ones too; the file is always complete."""
    path = tmp_path / "frames.pcap"
    with EthernetBench({"capture": str(path)}) as bench:
        assert read_capture(path) == []
        host     = hosts(bench.ports[0])
        bad      = datagram(DEVICE, TO_NINE, bytes(1473))
        from_soc = [arp(1, DEVICE, UNKNOWN, BROADCAST), datagram(DEVICE, host.station, bytes(700)), b"short", bad]
        to_soc   = [host.send(bytes(length)) for length in (300, 5)]
        bench.send(from_soc)
        got      = bench.run(5000)
        captured = read_capture(path)
    assert [frame.data for frame in got] == [to_soc[0], arp(2, HOST, DEVICE, DEVICE.mac), to_soc[1]]
    expected = from_soc[:3] + [frame.data for frame in got]
    assert sorted(frame for _, _, frame in captured) == sorted([*expected, bad[:1514]])
    assert [length for _, length, frame in captured if frame == bad[:1514]] == [1515]
    times = [time for time, _, _ in captured]
    assert times == sorted(times)
    # A clock is a nanosecond, and a frame's time is that of its last byte.
    ends = {frame: time for time, _, frame in captured}
    assert ends[got[2].data] - ends[got[0].data] == got[2].clock + 60 - got[0].clock - len(got[0].data)


@pytest.mark.parametrize("clock", [10**9 - 70, 10**9, 7*10**9 + 123_456_789, 2**32*10**9 - 1000])
def test_time_of_a_capture(tmp_path, clock):
    """Seconds and nanoseconds are correct as far as the format can represent them."""
    path = tmp_path / "frames.pcap"
    with EthernetBench({"capture": str(path)}) as bench:
        bench.set_clock(clock)
        frames = [datagram(DEVICE, TO_NINE._replace(mac=BROADCAST), bytes(length)) for length in (0, 200)]
        bench.deliver(frames)
    (first, *_), (second, *_) = read_capture(path)
    assert clock + 60 <= first <= clock + 62
    assert second - first == len(frames[1]) + 1


def test_two_sessions(hosts):
    """Two ports of a SoC, one with a separate clock of half the frequency, do not affect each other."""
    other = {"clock": "eth_clk", "device_address": "10.0.0.7", "device_mac": "02:11:22:33:44:55", "device_port": 77}
    with EthernetBench({"gap": 12}, other) as bench:
        device   = Station("02:11:22:33:44:55", "10.0.0.7", 77)
        one, two = (hosts(port) for port in bench.ports)
        expected: tuple[list[bytes], list[bytes]] = [], []
        for number in range(10):
            expected[0].append(one.send(bytes([number])*100))
            two.send(bytes([number])*100)
            expected[1].append(datagram(two.station, device, bytes([number])*100))
        bench.send([datagram(DEVICE, one.station, b"one")], 0)
        bench.send([datagram(device, two.station, b"two"), datagram(DEVICE, two.station, b"one")], 1)
        frames = bench.run(10*2*(142 + 24) + 200)
        assert (one.received(), two.received()) == ([b"one"], [b"two"])
        assert bench.outcomes(1) == {"datagram": 1, "sender": 1}
    for session, gap in enumerate((12, 24)):
        mine = [frame for frame in frames if frame.session == session]
        assert [frame.data for frame in mine] == expected[session]
        assert {after.clock - before.clock for before, after in zip(mine, mine[1:], strict=False)} == {142 + gap}


@pytest.mark.parametrize("arguments, complaint", [
    ('{"gap": 0}', "gap is 1 to 1000000, not 0"),
    ('{"port": 70000}', "port is 0 to 65535, not 70000"),
    ('{"device_port": 0}', "device_port is 1 to 65535, not 0"),
    ('{"device_address": "192.168.1"}', "device_address is an IPv4 address, not 192.168.1"),
    ('{"device_mac": "10:e2:d5:00:00"}', "device_mac is six bytes in hexadecimal with colons, not 10:e2:d5:00:00"),
    ('{"device_mac": "10:e2:d5:00:00:02:03"}',
     "device_mac is six bytes in hexadecimal with colons, not 10:e2:d5:00:00:02:03"),
    ('{"capture": "/nowhere/file"}', "cannot write the capture /nowhere/file: No such file or directory"),
    ("[1]", "arguments are a JSON object, not [1]"),
    ('{"stranger_clocks": -1}', "stranger_clocks is 0 to 1000000000, not -1"),
    ('{"stranger_payload": "123"}', "stranger_payload is at most 1472 bytes in hexadecimal, not 123"),
    ('{"stranger_payload": "0x"}', "stranger_payload is at most 1472 bytes in hexadecimal, not 0x"),
    ('{"stranger_payload": "' + "00"*1473 + '"}',
     "stranger_payload is at most 1472 bytes in hexadecimal, not " + "00"*1473),
])
def test_wrong_argument(arguments, complaint):
    done = subprocess.run([build(), "sys_clk", arguments], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (1, "", f"[ethernet2socket] {complaint}\n")


def test_port_in_use(bench):
    """Two simulators never share a port."""
    (port,) = bench.ports
    done = subprocess.run([build(), "sys_clk", f'{{"port": {port}}}'], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr == f"[ethernet2socket] cannot listen on port {port}: Address already in use\n"


def test_clock_that_is_not_there():
    """Without its pads the simulator does not start."""
    done = subprocess.run([build(), "sys_clk", '{"clock": "rx_clk"}'], input="run 1\n", capture_output=True, text=True,
                          check=False)
    assert done.returncode == 1
    assert done.stderr == "[ethernet2socket] needs the interfaces eth and rx_clk\n"


def test_makefile(tmp_path):
    """LiteX's rules build the module."""
    (tmp_path / "variables.mak").write_text(f"SRC_DIR = {litex_sim_core()}\nEXTRA_MOD_BASE_DIR = {MODULE.parent}\n")
    folder = tmp_path / "modules" / "ethernet2socket"
    folder.mkdir(parents=True)
    command = ["make", "MOD=ethernet2socket", "-C", folder, "-f", MODULE / "Makefile"]
    done    = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert (folder / "ethernet2socket.so").is_file()


class PacedHost:
    """A host in the device's time; the module waits while it computes."""
    def __init__(self, name: str) -> None:
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.socket.settimeout(10)
        self.socket.connect(f"\0{name}")

    def send(self, payload: bytes) -> None:
        """Queue a datagram for the wire."""
        self.socket.sendall(b"D" + payload)

    def wait(self, clock: int) -> None:
        """Let the module go on, until a datagram comes or at most up to a clock."""
        self.socket.sendall(struct.pack("=cQ", b"W", clock))

    def woken(self) -> tuple[int, bytes]:
        """Return the clock of the answer to a wait, and the datagram."""
        answer = self.socket.recv(4096)
        return struct.unpack_from("=Q", answer)[0], answer[8:]


FIRST = 1 << 20   # The host's time begins at a multiple.
LATER = FIRST << 8 # After the end of a test: at the end of a wait the module waits for the host.
PACED = HOST._replace(port=40001)


@pytest.fixture
def paced():
    """Return the module and a host that connects at the clock `FIRST`, and whose first wait ends at once."""
    name = f"litestereo-test-{os.getpid()}"
    with EthernetBench({"paced": name, "paced_latency": 300}) as bench:
        host = PacedHost(name)
        host.wait(0)
        bench.set_clock(FIRST - 1)
        bench.run(1)
        yield bench, host
        host.socket.close()


def test_paced_host_sends(paced):
    """What a host sends at once is sent at the pace of the wire, from the clock at which it waits."""
    bench, host = paced
    payloads = [bytes([n])*1000 for n in range(20)]
    for payload in payloads:
        host.send(payload)
    host.wait(LATER)
    frames = bench.run(20*(1042 + 24) + 10)
    assert host.woken() == (FIRST + 1, b"")
    assert [frame.data for frame in frames] == [datagram(PACED, DEVICE, payload) for payload in payloads]
    assert {later.clock - first.clock for first, later in zip(frames, frames[1:], strict=False)} == {1042 + 24}


def test_paced_host_receives(paced):
    """A datagram ends a wait, its latency after its last byte; another one waits for the next wait."""
    bench, host = paced
    for _ in range(3):
        host.wait(LATER)
    frames = [datagram(DEVICE, PACED, bytes([n])*200) for n in range(2)]
    bench.send(frames)
    bench.run(2000)
    assert host.woken() == (FIRST + 1, b"")
    (first, payload), (second, other) = host.woken(), host.woken()
    assert (payload, other) == (bytes([0])*200, bytes([1])*200)
    assert second - first == len(frames[1]) + 1
    assert 0 <= first - (FIRST + len(frames[0]) + 300) <= 4


def test_paced_host_sleeps(paced):
    """Without a datagram a wait ends at its clock; one for a clock that has passed ends at the next one."""
    bench, host = paced
    for clock in (FIRST + 1234, FIRST + 1234, LATER):
        host.wait(clock)
    bench.run(2000)
    assert [host.woken() for _ in range(3)] == [(FIRST + 1, b""), (FIRST + 1234, b""), (FIRST + 1235, b"")]
