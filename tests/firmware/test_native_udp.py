#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The native device with a UDP port: a frame in datagrams, from a host that is written out here."""

import contextlib
import socket
import struct
import subprocess
import zlib

import numpy as np
import pytest

from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.host_tools.protocol.messages import MessageType
from support.expected import expected_map
from support.native_device import build, native_device
from support.pairs import generator

HEADER = struct.Struct("<HBBIIIII")


@contextlib.contextmanager
def udp_device(*options):
    """Run the program and return its UDP port."""
    command = [build(), "--udp-port", "0", *options]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout.readline().startswith("listening on 127.0.0.1:")
            line = process.stdout.readline()
            assert line.startswith("listening on udp 127.0.0.1:"), line
            yield int(line.rsplit(":", 1)[1])
        finally:
            process.terminate()
            _, complaint = process.communicate(timeout=10)
        assert (process.returncode, complaint) == (0, "")


class Host:
    """A host with one address and port, and a session."""

    def __init__(self, port):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.settimeout(5)
        self.socket.connect(("127.0.0.1", port))
        self.token    = 0
        self.sequence = 0

    def send(self, kind, frame_id=0, payload=b"", offset=0):
        self.sequence += 1
        message = HEADER.pack(0x534c, 1, kind, self.token, self.sequence, frame_id, offset, len(payload)) + payload
        self.socket.send(message + struct.pack("<I", zlib.crc32(message)))

    def receive(self):
        """Return type, sequence, offset and payload of the next datagram."""
        datagram = self.socket.recv(2048)
        assert zlib.crc32(datagram[:-4]) == int.from_bytes(datagram[-4:], "little")
        _, _, kind, token, sequence, _, offset, length = HEADER.unpack_from(datagram)
        assert token == self.token and length == len(datagram) - 28
        return kind, sequence, offset, datagram[24:-4]

    def ask(self, kind, frame_id=0, payload=b""):
        """Send a request; return the payload of the reply, or code and detail of the error."""
        self.send(kind, frame_id, payload)
        answer, sequence, _, payload = self.receive()
        assert sequence == self.sequence
        if answer == MessageType.ERROR:
            return struct.unpack("<HxxI", payload)
        assert answer == kind | 0x80
        return payload

    def hello(self):
        self.token = 0
        reply      = self.ask(MessageType.HELLO, payload=b"abcd")
        if isinstance(reply, bytes):
            self.token = int.from_bytes(reply[:4], "little")
        return reply

    def upload(self, frame_id, left, right):
        height, width = left.shape
        reply         = self.ask(MessageType.OPEN, frame_id, struct.pack("<HH", width, height))
        pitch         = int.from_bytes(reply[4:], "little")
        chunks        = [(base + at, image.tobytes()[at:at + 1024]) for base, image in ((0, left), (pitch, right))
                         for at in range(0, width*height, 1024)]
        lost          = chunks
        for _ in range(20):
            # No more at a time than a socket holds.
            for offset, chunk in lost[:64]:
                self.send(MessageType.UPLOAD, frame_id, chunk, offset)
            reply = self.ask(MessageType.MISSING, frame_id)
            bits  = np.unpackbits(np.frombuffer(reply, np.uint8), bitorder="little")
            assert not bits[len(chunks):].any()
            lost = [chunks[i] for i in np.flatnonzero(bits)]
            if not lost:
                return
        raise AssertionError(f"{len(lost)} chunks are missing")

    def download(self, frame_id, size):
        parts = bytearray(size)
        for start in range(0, size, 32*1024):
            length = min(32*1024, size - start)
            self.send(MessageType.READ, frame_id, struct.pack("<I", length), start)
            for at in range(start, start + length, 1024):
                kind, sequence, offset, payload = self.receive()
                assert (kind, sequence, offset) == (0x87, self.sequence, at)
                assert len(payload) == min(1024, start + length - at)
                parts[at:at + len(payload)] = payload
        return bytes(parts)


def test_a_frame_there_and_back():
    rng           = generator(90)
    width, height = 203, 97
    left, right   = (rng.integers(0, 256, (height, width), np.uint8) for _ in range(2))
    with udp_device() as port:
        host = Host(port)
        host.hello()
        host.upload(7, left, right)
        assert host.ask(MessageType.START, 7) == b""
        while (status := host.ask(MessageType.STATUS, 7))[0] < 4:
            pass
        assert status[0] == 4
        found    = np.frombuffer(host.download(7, 2*width*height), "<i2").reshape(height, width)
        expected = expected_map(left, right, MatcherSettings(disparities=64, block_size=9))
        assert np.array_equal(found, expected)
        counters = struct.unpack("<28I", host.ask(MessageType.STATISTICS))
        assert counters[14] == 2*-(-width*height // 1024) and counters[15] == 0


def test_one_host_at_a_time():
    with udp_device("--clock-hz", "10000000") as port:
        first, second = Host(port), Host(port)
        assert isinstance(first.hello(), bytes)
        code, milliseconds = second.hello()
        assert code == 17 and 4000 < milliseconds <= 5000
        assert first.ask(MessageType.BYE) == b""
        assert isinstance(second.hello(), bytes)
        assert first.ask(MessageType.STATUS)[0] == 17


def test_larger_frames_than_gateware_counts():
    with udp_device("--max-chunks", "64") as port:
        host = Host(port)
        assert int.from_bytes(host.hello()[24:28], "little") == 32*1024
        assert host.ask(MessageType.OPEN, 1, struct.pack("<HH", 256, 129)) == (12, 3)
        assert len(host.ask(MessageType.OPEN, 1, struct.pack("<HH", 256, 128))) == 8


def test_noise_is_counted():
    with udp_device() as port:
        host = Host(port)
        for noise in (b"", b"?", bytes(28), bytes(1500), b"LS" + bytes(1060)):
            host.socket.send(noise)
        host.hello()
        counters = struct.unpack("<28I", host.ask(MessageType.STATISTICS))
        assert counters[21:24] == (7, 1, 5)


@pytest.mark.parametrize("options", [[], ["--udp-port", "0"]])
def test_the_serial_line_comes_first(options):
    with native_device(*options) as port, socket.create_connection(("127.0.0.1", port), timeout=5) as line:
        line.sendall(b"info\r")
        text = b""
        while not text.endswith(b"litestereo> "):
            text += line.recv(4096)
        assert (b"udp: 192.168.1.50 port 19539\r\n" in text) == bool(options)
