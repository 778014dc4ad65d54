#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Firmware images that never run, for tests of updates."""

from __future__ import annotations

import random
import struct
import zlib


def image(length: int = 5000, version: int = 0x0102, name: str = "LiteStereo", soc: int = 0,
          confirms: bool = True) -> bytes:
    """Return an image, for the native device by default, with a program of `length` bytes."""
    tag     = struct.pack("<4sIII16s", b"LSFW", soc, version, confirms, name.encode())
    program = random.Random(length).randbytes(length - len(tag)) + tag
    return with_header(program)


def with_header(program: bytes) -> bytes:
    """Return a program as an image: length, CRC-32, program."""
    return struct.pack("<II", len(program), zlib.crc32(program)) + program
