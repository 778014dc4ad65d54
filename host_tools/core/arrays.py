#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Arrays of numbers from .npy, .npz and PFM files, which may hold anything.

NumPy's own loader believes the header: it allocates what that asks for. Here the size must be that of the data.
"""

from __future__ import annotations

import io
import math
import re
import warnings
import zipfile
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import MAX_PIXELS
from .errors import ImageError

#: Beginnings of the files.
NPY = b"\x93NUMPY"
NPZ = b"PK"
PFM = (b"Pf", b"PF")

#: The longest header of a .npy file that is read, in bytes.
_MAX_HEADER_BYTES = 10000

#: The largest item of an array of numbers, in bytes.
_MAX_ITEM_BYTES = 16

#: Three or four words, each with one character of white space after it, and what is between width and height.
_PFM_HEADER = re.compile(rb"(P[fF])\s+(\d{1,9})(\s+)(\d{1,9})\s+([-+]?[0-9.]+(?:[eE][-+]?\d{1,3})?)(?:\r\n|\s)")


def decode_npy(data: bytes, name: str) -> NDArray[Any]:
    """Decode a .npy file with an array of numbers.

    Raises
    ------
    ImageError
        With `name`: it is no such file, holds objects or records, or has another size than its header says.
    """
    if not data.startswith(NPY):
        raise ImageError(f"{name}: is not an array that NumPy can read")
    stream = io.BytesIO(data)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            version = np.lib.format.read_magic(stream)
            read    = {(1, 0): np.lib.format.read_array_header_1_0,
                       (2, 0): np.lib.format.read_array_header_2_0}[version]
            shape, column_major, dtype = read(stream, max_header_size=_MAX_HEADER_BYTES)
    except Exception: # The header is a Python literal, and NumPy documents no list of what it raises for a bad one.
        raise ImageError(f"{name}: is not an array that NumPy can read, or its header is damaged") from None
    if dtype.kind not in "biufc" or dtype.itemsize > _MAX_ITEM_BYTES:
        raise ImageError(f"{name}: holds items of type {_short(dtype)}, one number per pixel is needed")
    have, need = len(data) - stream.tell(), math.prod(shape)*dtype.itemsize
    if have != need or len(shape) > 4 or min(shape, default=0) < 0:
        raise ImageError(f"{name}: is damaged: its header says an array of {_short(shape)} {dtype}, it has "
                         f"{have} bytes")
    array = np.frombuffer(data, dtype, offset=stream.tell()).reshape(shape, order="F" if column_major else "C")
    return array.astype(dtype.newbyteorder("="))


def decode_npz(data: bytes, name: str) -> NDArray[Any]:
    """Decode the only array of a .npz file, or its only one of two dimensions.

    Raises
    ------
    ImageError
        With `name`: it is no such file, or has none or several such arrays.
    """
    found: dict[str, NDArray[Any]] = {}
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = [member for member in archive.infolist() if member.filename.endswith(".npy")]
            for member in members:
                if member.file_size > MAX_PIXELS*_MAX_ITEM_BYTES//2:
                    raise ImageError(f"{name}: {member.filename} is too large")
                with archive.open(member) as file:
                    # The size in the directory may be wrong: no more than that is unpacked.
                    found[member.filename.removesuffix(".npy")] = decode_npy(
                        file.read(member.file_size), f"{name}: {_short(member.filename)}")
    except ImageError:
        raise
    except Exception: # zipfile raises what its decompressors do, and struct.error, RuntimeError, KeyError.
        raise ImageError(f"{name}: is not an archive that NumPy can read, or is damaged") from None
    if len(found) > 1:
        found = {key: array for key, array in found.items() if array.ndim == 2}
    if len(found) != 1:
        raise ImageError(f"{name}: has {len(found) or 'no'} arrays of two dimensions, one is needed: save it as .npy")
    return next(iter(found.values()))


def decode_pfm(data: bytes, name: str) -> NDArray[np.float32]:
    """Decode a grey PFM file.

    Rows are stored from the bottom. Photoshop, which has width and height on separate lines, stores them from the
    top: see `is_photoshop`. The absolute value of the scale is ignored, as Middlebury does it.

    Returns
    -------
    float32, H x W, top row first.

    Raises
    ------
    ImageError
        With `name`: it is no such file, is in colour, or has other bytes than its header says.
    """
    header = _PFM_HEADER.match(data)
    if header is not None and header[1] == b"PF":
        raise ImageError(f"{name}: is a colour PFM, a grey one is needed")
    try:
        scale = float(header[5]) if header is not None else 0.0
    except ValueError:
        scale = 0.0
    if header is None or not 0 < abs(scale) < math.inf:
        raise ImageError(f"{name}: is not a grey PFM file, or is damaged")
    width, height = int(header[2]), int(header[4])
    need, begin   = 4*width*height, header.end()
    if not need or len(data) - begin != need:
        raise ImageError(f"{name}: is not a grey PFM file, or is damaged: {width}x{height} pixels are {need} bytes, it "
                         f"has {len(data) - begin}")
    pixels = np.frombuffer(data, "<f4" if scale < 0 else ">f4", offset=begin).reshape(height, width)
    return (pixels if is_photoshop(data) else pixels[::-1]).astype(np.float32)


def is_photoshop(data: bytes) -> bool:
    """Return whether a PFM file is one of Photoshop: width and height are on separate lines."""
    header = _PFM_HEADER.match(data)
    return header is not None and b"\n" in header[3]


def _short(value: object) -> str:
    """Return a value of a file in one line of at most 60 characters."""
    text = " ".join(str(value).split())
    return ascii(text if len(text) <= 60 else f"{text[:57]}...").strip("'\"")
