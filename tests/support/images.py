#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Image files of all formats, depths and orientations, some of which OpenCV does not write itself."""

from __future__ import annotations

import struct
import zlib

import cv2
import numpy as np
from numpy.typing import NDArray

from .pairs import SEED

#: Colour types of PNG.
GREY, RGB, PALETTE, GREY_ALPHA, RGBA = 0, 2, 3, 4, 6


def exif(orientation: int) -> bytes:
    """Return a TIFF directory with nothing but an orientation, 1 to 8."""
    return b"II*\0" + struct.pack("<IHHHIHHI", 8, 1, 0x112, 3, 1, orientation, 0, 0)


def with_orientation(data: bytes, orientation: int) -> bytes:
    """Return a JPEG or a PNG with an orientation in its EXIF data."""
    if data.startswith(b"\xff\xd8"):
        segment = b"Exif\0\0" + exif(orientation)
        return data[:2] + b"\xff\xe1" + struct.pack(">H", len(segment) + 2) + segment + data[2:]
    return data[:33] + _chunk(b"eXIf", exif(orientation)) + data[33:]


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png(pixels: NDArray[np.uint8], bits: int, kind: int, size: tuple[int, int] | None = None,
        palette: bytes = b"") -> bytes:
    """Return a PNG of rows of bytes as they are stored (uint8, H x bytes); `size` is width and height of the header."""
    height = pixels.shape[0]
    width  = pixels.shape[1]*8//(bits*{GREY: 1, RGB: 3, PALETTE: 1, GREY_ALPHA: 2, RGBA: 4}[kind])
    rows   = b"".join(b"\0" + row.tobytes() for row in pixels)
    header = struct.pack(">IIBBBBB", *(size or (width, height)), bits, kind, 0, 0, 0)
    chunks = [(b"IHDR", header), *([(b"PLTE", palette)] if palette else []), (b"IDAT", zlib.compress(rows)),
              (b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(_chunk(*chunk) for chunk in chunks)


def image_files(width: int = 24, height: int = 10, salt: int = 0) -> dict[str, bytes]:
    """Return files of random images of all formats that OpenCV reads, by their names."""
    rng    = np.random.default_rng([SEED, 110, salt])
    grey   = rng.integers(0, 256, (height, width), np.uint8)
    colour = rng.integers(0, 256, (height, width, 3), np.uint8)
    alpha  = rng.integers(0, 256, (height, width, 4), np.uint8)
    deep   = rng.integers(0, 65536, (height, width, 3)).astype(np.uint16)
    files  = {}
    for name, image, endings in (
        ("grey", grey, ("png", "jpg", "bmp", "tiff", "pgm", "webp")),
        ("colour", colour, ("png", "jpg", "bmp", "tiff", "ppm", "webp")),
        ("alpha", alpha, ("png", "tiff", "webp")),
        ("deep", deep, ("png", "tiff", "ppm")),
        ("deep_grey", deep[:, :, 0], ("png", "tiff", "pgm")),
        ("deep_alpha", np.dstack([deep, deep[:, :, :1]]), ("png",)),
    ):
        for ending in endings:
            done, data = cv2.imencode(f".{ending}", image)
            assert done
            files[f"{name}.{ending}"] = data.tobytes()
    stored = rng.integers(0, 256, (height, width*8), np.uint8)
    colours = rng.integers(0, 256, 256*3, np.uint8).tobytes()
    for bits in (1, 2, 4, 8):
        files[f"palette_{bits}_bits.png"] = png(stored[:, :width*bits//8], bits, PALETTE, palette=colours[:3 << bits])
        files[f"grey_{bits}_bits.png"]    = png(stored[:, :width*bits//8], bits, GREY)
    files["grey_alpha_8_bits.png"]  = png(stored[:, :width*2], 8, GREY_ALPHA)
    files["grey_alpha_16_bits.png"] = png(stored[:, :width*4], 16, GREY_ALPHA)
    for orientation in range(1, 9):
        for name in ("grey.jpg", "colour.jpg", "colour.png", "grey.png", "deep.png", "alpha.png"):
            stem, ending = name.split(".")
            files[f"{stem}_{orientation}.{ending}"] = with_orientation(files[name], orientation)
        # A TIFF has its orientation in its own directory; cv2.imread of OpenCV 5.0 fails for those that swap the axes.
        if orientation > 4:
            continue
        data = bytearray(files["colour.tiff"])
        (at,) = struct.unpack_from("<I", data, 4)
        (count,) = struct.unpack_from("<H", data, at)
        entries  = [bytes(data[at + 2 + 12*number:at + 14 + 12*number]) for number in range(count)]
        entries  = [entry for entry in entries if entry[:2] != b"\x12\x01"]
        entries  = sorted([*entries, struct.pack("<HHIHH", 0x112, 3, 1, orientation, 0)],
                          key=lambda entry: struct.unpack("<H", entry[:2]))
        data[4:8] = struct.pack("<I", len(data))
        data     += struct.pack("<H", len(entries)) + b"".join(entries) + bytes(4)
        files[f"colour_{orientation}.tiff"] = bytes(data)
    return files
