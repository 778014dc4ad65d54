#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Images of the firmware, as a device's flash holds them: length, CRC-32, program, whose end says what it is for."""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from pathlib import Path

from ..core.errors import FirmwareError, UnsupportedError
from ..core.features import Feature
from .base import DeviceInfo

_HEADER = struct.Struct("<II")
_TAG    = struct.Struct("<4sIII16s")
_MAGIC  = b"LSFW"


@dataclass(frozen=True)
class FirmwareImage:
    """A firmware: its program, its version as "major.minor", and the name of the device that it is for."""

    what:    str # what to call it in messages
    program: bytes
    version: str
    name:    str

    @property
    def crc(self) -> int:
        """CRC-32 of the program."""
        return zlib.crc32(self.program)

    def check(self, info: DeviceInfo) -> None:
        """Checks that a device can take it; raises UnsupportedError or FirmwareError if not."""
        if not info.features & Feature.UPDATE:
            raise UnsupportedError(f"{info.name} has no flash that its firmware could be written to")
        if self.name != info.name:
            raise FirmwareError(f"{self.what}: is firmware for {self.name}, the device is {info.name}")

    def check_room(self, room: int) -> None:
        """Raises FirmwareError if the program is longer than the `room` bytes of a device."""
        if len(self.program) > room:
            raise FirmwareError(f"{self.what}: has {len(self.program)} bytes of program, the device's flash has room "
                                f"for {room}")


def read_firmware(firmware: Path | bytes) -> FirmwareImage:
    """Reads and checks an image, from a file or from its bytes; raises FirmwareError if it is none."""
    if isinstance(firmware, bytes):
        return _parse(firmware, "the firmware")
    try:
        return _parse(firmware.read_bytes(), str(firmware))
    except OSError as error:
        raise FirmwareError(f"{firmware}: cannot be read: {error.strerror}") from None


def _parse(data: bytes, what: str) -> FirmwareImage:
    program = data[_HEADER.size:]
    if len(program) < _TAG.size:
        raise FirmwareError(f"{what}: has {len(data)} bytes, too few for a firmware image: take firmware.bin of "
                            "`make bitstream`")
    length, crc = _HEADER.unpack_from(data)
    if length != len(program):
        raise FirmwareError(f"{what}: is no firmware image, or not all of one: its header tells of {length} bytes, "
                            f"{len(program)} follow")
    if crc != zlib.crc32(program):
        raise FirmwareError(f"{what}: is damaged: its CRC-32 is {zlib.crc32(program):08x} instead of {crc:08x}")
    magic, _, version, _, name = _TAG.unpack_from(program, len(program) - _TAG.size)
    if magic != _MAGIC:
        raise FirmwareError(f"{what}: does not say what device it is for: build it with firmware/Makefile")
    return FirmwareImage(what, program, f"{version >> 8}.{version & 0xff}",
                         name.split(b"\0")[0].decode("ascii", "replace"))
