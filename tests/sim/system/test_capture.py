#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Readers of captures, against handmade files after the description of pcap."""

from __future__ import annotations

import struct

import pytest

from litestereo.host_tools.protocol.messages import Message, MessageType
from litestereo.sim.system.capture import Captured, read_capture
from support.ethernet_frames import BROADCAST, DEVICE, HOST, arp, datagram, ethernet, ip_packet, udp_packet

PEER   = HOST._replace(port=40000)
HELLO  = Message(MessageType.HELLO, 0, 7, payload=b"abcd")
REPLY  = HELLO.reply(bytes(52))
UPLOAD = Message(MessageType.UPLOAD, 0x12345678, 8, 1, 2048, bytes(range(256))*4)
BYE    = Message(MessageType.BYE, 0x12345678, 9)
HEADER = struct.pack("=IHHiIII", 0xa1b23c4d, 2, 4, 0, 0, 1514, 1)

#: A conversation, and the clocks at which its frames ended; 10**9 clocks are a second of the file.
MESSAGES = [Captured(100, True, HELLO), Captured(250, False, REPLY), Captured(10**9 - 1, True, UPLOAD),
            Captured(10**9, True, UPLOAD), Captured(3*10**9 + 5, True, BYE)]


def record(clock, frame, length=None):
    """Return a frame of the file; `length` is its length on the wire if the record is truncated."""
    return struct.pack("=IIII", clock // 10**9, clock % 10**9, len(frame), length or len(frame)) + frame


def to_device(message):
    return datagram(PEER, DEVICE, message.encode())


def to_host(message):
    return datagram(DEVICE, PEER, message.encode())


def conversation():
    """Return the records of the conversation."""
    return [record(entry.clock, (to_device if entry.to_device else to_host)(entry.message)) for entry in MESSAGES]


@pytest.fixture
def read(tmp_path):
    """Return a function that writes a capture and reads it."""
    def write_and_read(data):
        path = tmp_path / "wire.pcap"
        path.write_bytes(data)
        return list(read_capture(path))

    return write_and_read


def test_messages_with_clock_and_direction(read):
    """Clocks are correct, also from a second on."""
    assert read(HEADER + b"".join(conversation())) == MESSAGES


def test_nothing_captured(read):
    assert read(HEADER) == []


def test_last_record_cut_off(read):
    """A simulator killed while writing: cut at any byte of the last record, the others are read."""
    *before, last = conversation()
    start         = HEADER + b"".join(before)
    for length in range(len(last)):
        assert read(start + last[:length]) == MESSAGES[:-1]


def foreign_frames():
    """Yield frames of other kinds, by kind."""
    message = HELLO.encode()
    broken  = message[:25] + bytes([message[25] ^ 1]) + message[26:]
    icmp    = ip_packet(PEER.address, DEVICE.address, udp_packet(PEER, DEVICE, message), protocol=1)
    return {
        "arp":         arp(1, DEVICE, HOST, BROADCAST),
        "ipv6":        ethernet(DEVICE.mac, PEER.mac, 0x86dd, bytes(100)),
        "icmp":        ethernet(DEVICE.mac, PEER.mac, 0x0800, icmp),
        "other ports": datagram(PEER, DEVICE._replace(port=19540), message),
        "crc":         datagram(PEER, DEVICE, broken),
        "cut off":     datagram(PEER, DEVICE, message[:-1]),
        "empty":       datagram(PEER, DEVICE, b""),
        "no magic":    datagram(PEER, DEVICE, bytes(60)),
        "short":       to_device(HELLO)[:41],
        "one byte":    b"x",
        "no byte":     b"",
        "not whole":   to_device(UPLOAD)[:100],
    }


@pytest.mark.parametrize("name", foreign_frames())
def test_foreign_frames_are_passed_over(read, name):
    """Other frames do not hide the messages around them."""
    foreign = record(200, foreign_frames()[name], 1094 if name == "not whole" else None)
    first, *others = conversation()
    assert read(HEADER + first + foreign + b"".join(others)) == MESSAGES


def test_port_of_a_host(read):
    """A host may use the device's port number."""
    host  = HOST._replace(port=DEVICE.port)
    data  = record(1, datagram(host, DEVICE, HELLO.encode())) + record(2, datagram(DEVICE, host, REPLY.encode()))
    assert [entry.message for entry in read(HEADER + data)] == [HELLO, REPLY]


def test_padding_is_no_part_of_a_message(read):
    """The length in the UDP header counts, not the padding after it."""
    assert [entry.message for entry in read(HEADER + record(1, to_device(BYE) + b"\x55"*9))] == [BYE]


@pytest.mark.parametrize("data", [
    b"",
    HEADER[:-1],
    bytes(len(HEADER)),
    # Classic pcap with microseconds, the other byte order, pcapng: all are written by other programs.
    struct.pack("=IHHiIII", 0xa1b2c3d4, 2, 4, 0, 0, 1514, 1),
    HEADER[3::-1] + HEADER[4:],
    struct.pack("=III", 0x0a0d0d0a, 28, 0x1a2b3c4d) + bytes(16),
    b"\x89PNG\r\n\x1a\n" + bytes(30),
])
def test_no_capture(read, data):
    """The error is one clear line."""
    with pytest.raises(ValueError, match=r"^\S+wire\.pcap is no capture of the simulated wire$"):
        read(data)
