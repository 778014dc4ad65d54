#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Fuzz targets: images, maps, truths, masks and folders of pairs."""

from __future__ import annotations

import io
import itertools
import tempfile
import zlib
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np

from litestereo.host_tools.core import arrays
from litestereo.host_tools.core.images import encode_pfm, read_colour, read_grey, read_picture
from litestereo.host_tools.data.layouts import find_samples
from litestereo.host_tools.data.map_files import read_map, read_truth
from support.images import image_files

_FOLDER = tempfile.TemporaryDirectory(prefix="litestereo-fuzz-")

#: A pair for the folder that gets one file of the input.
_PAIR = np.random.default_rng(3).integers(0, 256, (10, 24), np.uint8)

_MASK = np.where(_PAIR > 99, 255, 0).astype(np.uint8)


def _file(name: str, read: Callable[[Path], object]) -> Callable[[bytes], None]:
    """Return a target that reads the bytes as a file of that name."""
    def target(data: bytes) -> None:
        path = Path(_FOLDER.name) / name
        path.write_bytes(data)
        read(path)

    return target


def _map(path: Path) -> None:
    # Each file with one of the options, so that an error of one does not hide the others.
    options            = [*itertools.product((0, 16), (None, 16.0), ((), (0.0, float("nan"))))]
    least, scale, none = options[zlib.crc32(path.read_bytes()) % len(options)]
    read = read_map(path, least, scale, none)
    assert read.pixels.dtype == np.float32 and read.pixels.ndim == 2 and not np.isinf(read.pixels).any()
    assert read.note.isprintable()


def _truth(path: Path) -> None:
    for scale in (None, 3.0) if zlib.crc32(path.read_bytes()) % 2 else (1e-3, 1e30):
        read = read_truth(path, scale)
        assert not (read.pixels <= 0).any() and not np.isinf(read.pixels).any() and read.note.isprintable()


def _pair(name: str) -> Callable[[Path], None]:
    """Return a reader of a pair of which the file is the one called `name`."""
    def read(path: Path) -> None:
        folder = path.parent / f"pair-{name}"
        if not folder.is_dir():
            folder.mkdir()
            for other in ("view1.png", "view5.png", "disp1.png", "nonocc.png"):
                cv2.imwrite(str(folder / other), _PAIR if other != "nonocc.png" else _MASK)
        (folder / name).write_bytes(path.read_bytes())
        for sample in find_samples([folder], 3.0):
            sample.load()

    return read


def _saved(array: np.ndarray, save: Callable[..., None] = np.save) -> bytes:
    buffer = io.BytesIO()
    save(buffer, array)
    return buffer.getvalue()


_MAP    = np.array([[-16, -16, -16, -16], [-16, 0, 24, -16], [-16, -16, -16, -16]], np.int16)
_ARRAYS = [_MAP, _MAP.astype(np.float32)/16, _MAP.astype(np.float64), _MAP.astype(np.uint16), _MAP.astype(">i2"),
           np.asfortranarray(_MAP), np.zeros((0, 4), np.int16), np.array(3), np.array([["a"]]),
           np.zeros((2, 3), "i2,f4"), np.array([[None]]), np.full((2, 2), np.nan, np.float16), np.full((3, 3), 1e300)]
_NPY    = [_saved(array) for array in _ARRAYS]
_NPZ    = [_saved(array, save) for array in _ARRAYS[:2] for save in (np.savez, np.savez_compressed)]
_PFM    = [encode_pfm(_MAP), encode_pfm(_MAP).replace(b"4 3", b"4\n3"), b"PF\n1 1\n1\n" + bytes(12)]
_FILES  = image_files()
_IMAGES = [*_FILES.values()]
_FEW    = [_FILES[name] for name in ("grey.png", "grey.pgm", "grey_1.jpg", "colour.jpg", "deep_grey.png",
                                     "grey_4_bits.png")]
_MASKS  = [cv2.imencode(".png", image)[1].tobytes() for image in (_MASK, _MASK//255, _MASK//2, _PAIR)]

TARGETS: dict[str, Callable[[bytes], None]] = {
    "grey":      _file("grey.png", read_grey),
    "colour":    _file("colour.jpg", read_colour),
    "picture":   _file("picture.tif", read_picture),
    "map-npy":   _file("map.npy", _map),
    "map-npz":   _file("map.npz", _map),
    "map-pfm":   _file("map.pfm", _map),
    "map-image": _file("map.png", _map),
    "npy":       lambda data: _checked(arrays.decode_npy(data, "a.npy")),
    "truth-npy": _file("truth.npy", _truth),
    "truth-pfm": _file("truth.pfm", _truth),
    "truth-image": _file("truth.png", _truth),
    "pair-left": _file("left.png", _pair("view1.png")),
    "pair-truth": _file("disp.png", _pair("disp1.png")),
    "pair-mask": _file("mask.png", _pair("nonocc.png")),
}

SEEDS: dict[str, list[bytes]] = {
    **dict.fromkeys(("grey", "colour", "picture"), _IMAGES),
    **dict.fromkeys(("map-npy", "npy", "truth-npy"), _NPY + _NPZ[:1]),
    "map-npz": _NPZ,
    **dict.fromkeys(("map-pfm", "truth-pfm"), _PFM),
    **dict.fromkeys(("map-image", "truth-image"), _IMAGES + _PFM[:1]),
    **dict.fromkeys(("pair-left", "pair-truth"), _FEW),
    "pair-mask": _MASKS,
}


def _checked(array: np.ndarray) -> None:
    assert array.dtype.kind in "biufc"
