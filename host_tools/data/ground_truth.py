#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Reads true disparities from files of the usual data sets."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.errors import ImageError
from ..core.images import KITTI_SCALE, read_file, read_image


def read_ground_truth(path: Path, scale: float | None = None) -> NDArray[np.float32]:
    """Read true disparities from a file.

    Parameters
    ----------
    path
        A grey PNG of 8 or 16 bits, a PFM, or an array in .npy or .npz (its first one).
    scale
        Divisor from the file's values to pixels, above 0. None is 256 for 16-bit images, else 1.

    Returns
    -------
    float32, H x W, in pixels, nan where the disparity is unknown: 0 or less, infinite or nan in the file.

    Raises
    ------
    ImageError
        The file is missing or has another format, or the scale is not above 0.
    """
    if scale is not None and not 0 < scale < float("inf"):
        raise ImageError(f"the scale of the ground truth must be above 0, not {scale:g}")
    values: NDArray[Any]
    suffix = path.suffix.lower()
    if suffix in (".npy", ".npz"):
        values = _read_array(path)
    elif suffix == ".pfm":
        values = decode_pfm(read_file(path), str(path))
    else:
        values = read_image(path)
        if scale is None and values.dtype == np.uint16:
            scale = KITTI_SCALE
    if values.ndim != 2 or values.dtype.kind not in "iuf":
        raise ImageError(f"{path}: a disparity map is one number per pixel, not {values.dtype} "
                         f"{values.shape}")
    pixels: NDArray[np.float32] = values.astype(np.float32)/np.float32(scale or 1)
    pixels[~(np.isfinite(pixels) & (pixels > 0))] = np.nan
    return pixels


def _read_array(path: Path) -> NDArray[Any]:
    try:
        loaded = np.load(io.BytesIO(read_file(path)), allow_pickle=False)
        array  = loaded[loaded.files[0]] if isinstance(loaded, np.lib.npyio.NpzFile) else loaded
    except (ValueError, EOFError, IndexError, OSError, zipfile.BadZipFile):
        raise ImageError(f"{path}: is not an array that NumPy can read") from None
    return np.asarray(array)


def decode_pfm(data: bytes, name: str) -> NDArray[np.float32]:
    """Decode a grey PFM file: float32, H x W, top row first; raise ImageError, with `name`, if it is not one."""
    try:
        kind, size, order, values = data.split(b"\n", 3)
        width, height             = (int(number) for number in size.split())
        if kind.strip() != b"Pf" or width < 1 or height < 1 or float(order) == 0:
            raise ValueError
        pixels = np.frombuffer(values, "<f4" if float(order) < 0 else ">f4", width*height)
    except ValueError:
        raise ImageError(f"{name}: is not a grey PFM file, or is damaged") from None
    return pixels.reshape(height, width)[::-1].astype(np.float32)
