#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Firmware images as a device's flash holds them: length, CRC-32, and the program, whose end names its device."""

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
    """A firmware image.

    Parameters
    ----------
    what
        Name of the image in messages.
    program
        The program, without the header.
    version
        "major.minor".
    name
        Name of the device that the firmware is for.
    """

    what:    str
    program: bytes
    version: str
    name:    str

    @property
    def crc(self) -> int:
        """Return the CRC-32 of the program."""
        return zlib.crc32(self.program)

    def check(self, info: DeviceInfo) -> None:
        """Check that the firmware is for a device.

        Raises
        ------
        UnsupportedError
            The device has no flash for firmware.
        FirmwareError
            The firmware is for another device.
        """
        if not info.features & Feature.UPDATE:
            raise UnsupportedError(f"{info.name} has no flash for firmware")
        if self.name != info.name:
            raise FirmwareError(f"{self.what}: is firmware for {self.name}, the device is {info.name}")

    def check_room(self, room: int) -> None:
        """Raise FirmwareError if the program is longer than `room`, the bytes that a device has for it."""
        if len(self.program) > room:
            raise FirmwareError(f"{self.what}: the program has {len(self.program)} bytes, the device's flash has room "
                                f"for {room}")


def read_firmware(firmware: Path | bytes) -> FirmwareImage:
    """Return the image in a file, or in bytes; raise FirmwareError if it is none, or is damaged."""
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
        raise FirmwareError(f"{what}: is no firmware image, or not all of one: its header announces {length} bytes, "
                            f"{len(program)} follow")
    if crc != zlib.crc32(program):
        raise FirmwareError(f"{what}: is damaged: its CRC-32 is {zlib.crc32(program):08x} instead of {crc:08x}")
    magic, _, version, _, name = _TAG.unpack_from(program, len(program) - _TAG.size)
    if magic != _MAGIC:
        raise FirmwareError(f"{what}: does not say what device it is for: build it with firmware/Makefile")
    return FirmwareImage(what, program, f"{version >> 8}.{version & 0xff}",
                         name.split(b"\0")[0].decode("ascii", "replace"))
