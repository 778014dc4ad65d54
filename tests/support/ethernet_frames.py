#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Ethernet frames, field by field as the RFCs define them, and independent of the module that they test."""

from __future__ import annotations

import ipaddress
import struct
import zlib
from typing import NamedTuple

BROADCAST = "ff:ff:ff:ff:ff:ff"
PREAMBLE  = b"\x55"*7 + b"\xd5"


class Station(NamedTuple):
    """One end of a datagram."""
    mac:     str
    address: str
    port:    int = 0


#: The device as the module's defaults have it, and the host that the module plays.
DEVICE = Station("10:e2:d5:00:00:02", "192.168.1.50", 19539)
HOST   = Station("02:00:00:00:00:64", "192.168.1.100")


def mac_bytes(mac: str) -> bytes:
    """Return the six bytes of an address."""
    return bytes.fromhex(mac.replace(":", ""))


def ip_bytes(address: str) -> bytes:
    """Return the four bytes of an address."""
    return ipaddress.IPv4Address(address).packed


def checksum(data: bytes) -> int:
    """Return the Internet checksum, RFC 1071."""
    total  = sum(struct.unpack(f">{(len(data) + 1)//2}H", data + bytes(len(data) % 2)))
    folded = (total - 1) % 0xffff + 1 if total else 0
    return 0xffff - folded


def ethernet(destination: str, source: str, kind: int, payload: bytes, padding: bytes = bytes(46)) -> bytes:
    """Return a frame without preamble and FCS, filled to 60 bytes from `padding`."""
    frame = mac_bytes(destination) + mac_bytes(source) + struct.pack(">H", kind) + payload
    return frame + padding[:max(0, 60 - len(frame))]


def ip_packet(source: str, destination: str, payload: bytes, *, protocol: int = 17, options: bytes = b"",
              fragment: int = 0x4000, total: int | None = None, wrong: int = 0, first: int | None = None) -> bytes:
    """Return an IPv4 packet; `wrong` is added to the checksum, `first` and `total` replace the correct values."""
    length = 20 + len(options) + len(payload) if total is None else total
    first  = 0x45 + len(options)//4 if first is None else first

    def header(check: int) -> bytes:
        return struct.pack(">BBHHHBBH4s4s", first, 0, length, 0, fragment, 64, protocol, check, ip_bytes(source),
                           ip_bytes(destination)) + options

    return header(checksum(header(0)) + wrong & 0xffff) + payload


def udp_packet(source: Station, destination: Station, payload: bytes, *, length: int | None = None,
               check: bool = False, wrong: int = 0) -> bytes:
    """Return UDP header and payload; `wrong` is added to a checksum, `length` replaces the correct length."""
    length = 8 + len(payload) if length is None else length
    header = struct.pack(">HHH", source.port, destination.port, length)
    number = 0
    if check:
        pseudo = ip_bytes(source.address) + ip_bytes(destination.address) + struct.pack(">HH", 17, length)
        number = (checksum(pseudo + header + payload) or 0xffff) + wrong & 0xffff
    return header + struct.pack(">H", number) + payload


def datagram(source: Station, destination: Station, payload: bytes, padding: bytes = bytes(46)) -> bytes:
    """Return a whole, correct frame."""
    packet = ip_packet(source.address, destination.address, udp_packet(source, destination, payload))
    return ethernet(destination.mac, source.mac, 0x0800, packet, padding)


def arp(operation: int, sender: Station, target: Station, destination: str, source: str | None = None) -> bytes:
    """Return a whole frame: request (1) or answer (2)."""
    packet = struct.pack(">HHBBH6s4s6s4s", 1, 0x0800, 6, 4, operation, mac_bytes(sender.mac), ip_bytes(sender.address),
                         mac_bytes(target.mac), ip_bytes(target.address))
    return ethernet(destination, source or sender.mac, 0x0806, packet)


def on_the_wire(frame: bytes) -> bytes:
    """Return a frame with its preamble and FCS."""
    return PREAMBLE + frame + zlib.crc32(frame).to_bytes(4, "little")


def off_the_wire(data: bytes) -> bytes:
    """Return a frame without preamble and FCS; assert that both are correct."""
    frame = data[len(PREAMBLE):-4]
    assert data == on_the_wire(frame)
    return frame


def host_takes(frame: bytes, device: Station = DEVICE) -> tuple[int, bytes] | None:
    """Return port and payload that the host's application gets from a frame of the device; None if it gets nothing."""
    if not 60 <= len(frame) <= 1514 or frame[:6] != mac_bytes(HOST.mac) or frame[12:14] != b"\x08\x00":
        return None
    packet = frame[14:]
    words  = (packet[0] & 15)*4
    (total,) = struct.unpack_from(">H", packet, 2)
    if packet[0] >> 4 != 4 or not 20 <= words <= total <= len(packet) or checksum(packet[:words]):
        return None
    addressed = packet[12:20] == ip_bytes(device.address) + ip_bytes(HOST.address)
    if packet[9] != 17 or not addressed or struct.unpack_from(">H", packet, 6)[0] & 0x3fff:
        return None
    udp = packet[words:total]
    if len(udp) < 8:
        return None
    source, destination, length, check = struct.unpack_from(">HHHH", udp)
    pseudo = packet[12:20] + struct.pack(">HH", 17, length)
    if source != device.port or length != len(udp) or (check and checksum(pseudo + udp)):
        return None
    return destination, udp[8:]
