#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Images from files, disparity maps in pixels, and disparity maps into files."""

from __future__ import annotations

import contextlib
import io
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from .errors import ImageError
from .outputs import (
    COLOURS_PNG,
    DISPARITY_NPY,
    DISPARITY_PFM,
    DISPARITY_PNG,
    Kind,
    Outputs,
    png_mark,
    write_file,
)
from .settings import DISPARITY_SCALE, MatcherSettings

#: Value of a pixel without a disparity if the smallest disparity is 0, in sixteenths of a pixel.
INVALID = -DISPARITY_SCALE

#: Disparity files in the convention of the KITTI benchmark hold 256 times the disparity in pixels.
KITTI_SCALE = 256

#: Where the first chunk of a PNG file ends: 8 bytes of signature, 25 of IHDR.
_IHDR_END = 33

#: Formats that `write_map` writes, by the endings of the files.
FORMATS = ("png", "pfm", "npy")


@contextlib.contextmanager
def quiet_stderr() -> Iterator[None]:
    """Discard what the image libraries print to stderr in this context: the exception says it already."""
    try:
        saved = os.dup(2)
    except OSError: # It is closed.
        yield
        return
    try:
        with open(os.devnull, "wb") as sink:
            os.dup2(sink.fileno(), 2)
        yield
    finally:
        os.dup2(saved, 2)
        os.close(saved)


def read_file(path: Path) -> bytes:
    """Return the bytes of a file; raise ImageError if it cannot be read."""
    try:
        return path.read_bytes()
    except FileNotFoundError:
        raise ImageError(f"{path}: there is no such file") from None
    except OSError as error:
        raise ImageError(f"{path}: cannot be read: {error.strerror or error}") from None


def read_image(path: Path) -> NDArray[Any]:
    """Return the image in a file as OpenCV decodes it, channels and depth unchanged.

    Raises
    ------
    ImageError
        The file cannot be read, or is not an image.
    """
    content = read_file(path)
    if _is_cut(content):
        raise ImageError(f"{path}: is not an image that is whole: its end is missing")
    try:
        with quiet_stderr():
            data  = np.frombuffer(content, np.uint8)
            image = cv2.imdecode(data, cv2.IMREAD_UNCHANGED) if len(data) else None
    except cv2.error:
        image = None
    if image is None:
        raise ImageError(f"{path}: is not an image that OpenCV can read, or is damaged")
    return image


def _is_cut(data: bytes) -> bool:
    """Return whether the end of a PNG or JPEG file is missing: OpenCV 4 fills up with grey what it does not find."""
    if data.startswith(b"\x89PNG"):
        return b"IEND" not in data[_IHDR_END:]
    if data.startswith(b"\xff\xd8"):
        place = 2
        # Segments with their lengths, up to the scan: a thumbnail in one of them has an end too.
        while data[place:place + 1] == b"\xff" and data[place + 1:place + 2] != b"\xda" and place + 4 <= len(data):
            place += 1 if data[place + 1] == 0xff else 2 + int.from_bytes(data[place + 2:place + 4], "big")
        return b"\xff\xd9" not in data[place:]
    return False


def read_grey(path: Path) -> tuple[NDArray[np.uint8], list[str]]:
    """Read an image file as grey.

    Parameters
    ----------
    path
        An image file of any format that OpenCV reads. Colour is converted to luma, 16 bits to their upper 8.

    Returns
    -------
    The image, uint8, H x W, and a notice of one line for each conversion.

    Raises
    ------
    ImageError
        The file is missing, is not an image, or has other pixels than 8 or 16 bits.
    """
    image   = read_image(path)
    notices = []
    if image.dtype == np.uint16:
        image = (image >> 8).astype(np.uint8)
        notices.append(f"{path}: 16-bit image, converted to 8 bits")
    if image.dtype != np.uint8:
        raise ImageError(f"{path}: has pixels of type {image.dtype}, an 8- or 16-bit image is needed")
    if image.ndim == 3 and image.shape[2] == 1:
        image = image[:, :, 0]
    if image.ndim == 3:
        image = cv2.cvtColor(image, cv2.COLOR_BGRA2GRAY if image.shape[2] == 4 else cv2.COLOR_BGR2GRAY)
        notices.append(f"{path}: colour image, converted to grey")
    return np.ascontiguousarray(image, np.uint8), notices


def read_colour(path: Path) -> NDArray[np.uint8]:
    """Read an image file in colour: uint8, H x W x 3, BGR; of 16 bits the upper 8. Raise ImageError as `read_grey`."""
    image = read_image(path)
    if image.dtype == np.uint16:
        image = (image >> 8).astype(np.uint8)
    if image.dtype != np.uint8:
        raise ImageError(f"{path}: has pixels of type {image.dtype}, an 8- or 16-bit image is needed")
    grey = image.ndim == 2 or image.shape[2] == 1
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR) if grey else image[:, :, :3], np.uint8)


def disparity_pixels(disparity: NDArray[np.int16], invalid: int = INVALID) -> NDArray[np.float32]:
    """Convert a map (int16, H x W, sixteenths of a pixel) to pixels: float32, nan where it is `invalid` or less."""
    pixels: NDArray[np.float32] = disparity.astype(np.float32)/np.float32(DISPARITY_SCALE)
    pixels[disparity <= invalid] = np.nan
    return pixels


def valid_percent(disparity: NDArray[np.int16], invalid: int = INVALID) -> float:
    """Return how many pixels of a map (int16, H x W, sixteenths) have a disparity, in percent of all its pixels.

    It is not the density of `evaluation.metrics`, which counts the pixels with a known true disparity only.
    """
    return 100*float(np.mean(disparity > invalid))


def pfm_of(disparity_px: NDArray[np.float32]) -> bytes:
    """Encode a map in pixels (float32, H x W, nan if invalid) as a PFM file of Middlebury.

    The file is little-endian, its bottom row comes first, and an invalid pixel is inf.
    """
    height, width = disparity_px.shape
    pixels        = np.where(np.isnan(disparity_px), np.float32(np.inf), disparity_px)
    return f"Pf\n{width} {height}\n-1.0\n".encode("ascii") + pixels[::-1].astype("<f4").tobytes()


def encode_pfm(disparity: NDArray[np.int16], invalid: int = INVALID) -> bytes:
    """Encode a map (int16, H x W, sixteenths of a pixel) as a PFM file of Middlebury, see `pfm_of`."""
    return pfm_of(disparity_pixels(disparity, invalid))


def kitti_image(disparity: NDArray[np.int16], invalid: int = INVALID) -> NDArray[np.uint16]:
    """Convert a map to KITTI's convention: uint16, 256 times the disparity in pixels, 0 where there is none.

    A disparity of 0 becomes 1, the smallest value that is valid; 256 pixels and more become 65535.
    """
    scaled = np.clip(disparity.astype(np.int32)*(KITTI_SCALE//DISPARITY_SCALE), 1, 65535)
    scaled[disparity <= invalid] = 0
    return scaled.astype(np.uint16)


def color_image(disparity: NDArray[np.int16], settings: MatcherSettings) -> NDArray[np.uint8]:
    """Colour a map for viewing: uint8, H x W x 3 (BGR), from blue (smallest disparity) to red, black if invalid."""
    above  = disparity.astype(np.float32) - DISPARITY_SCALE*settings.min_disparity
    scaled = np.clip(above*255/(DISPARITY_SCALE*settings.disparities), 0, 255).astype(np.uint8)
    color  = np.array(cv2.applyColorMap(scaled, cv2.COLORMAP_TURBO), np.uint8)
    color[disparity <= settings.invalid] = 0
    return color


def disparity_files(folder: Path) -> list[Path]:
    """Return the files that `write_disparity` writes."""
    return [folder / f"disparity{ending}" for ending in (".npy", ".pfm", ".png", "_color.png")]


def plan_disparity(folder: Path, outputs: Outputs) -> None:
    """Plan the files that `write_disparity` writes; raise ImageError as `Outputs.add`."""
    kinds = (DISPARITY_NPY, DISPARITY_PFM, DISPARITY_PNG, COLOURS_PNG)
    for path, kind in zip(disparity_files(folder), kinds, strict=True):
        outputs.add(path, kind)


def write_disparity(folder: Path, disparity: NDArray[np.int16], settings: MatcherSettings) -> list[Path]:
    """Write a map (int16, H x W, sixteenths) matched with `settings` in four formats; create the folder if needed.

    `disparity.npy` as it is; `disparity.pfm` see `encode_pfm`; `disparity.png` see `kitti_image`;
    `disparity_color.png` see `color_image`.

    Returns
    -------
    The files written.

    Raises
    ------
    ImageError
        A file cannot be written.
    """
    paths = disparity_files(folder)
    for path in paths[:3]:
        write_map(path, disparity, settings)
    write_png(paths[3], color_image(disparity, settings), COLOURS_PNG)
    return paths


def write_map(path: Path, disparity: NDArray[np.int16], settings: MatcherSettings) -> None:
    """Write one map (int16, H x W, sixteenths) in the format of the file's ending; create the folder if needed.

    The formats are those of `write_disparity`.

    Raises
    ------
    ImageError
        The file cannot be written.
    """
    if path.suffix == ".npy":
        buffer = io.BytesIO()
        np.save(buffer, disparity)
        write_file(path, buffer.getvalue())
    elif path.suffix == ".pfm":
        write_file(path, encode_pfm(disparity, settings.invalid))
    else:
        write_png(path, kitti_image(disparity, settings.invalid), DISPARITY_PNG)


def encode_png(image: NDArray[Any], kind: Kind) -> bytes:
    """Encode an image (H x W, or H x W x 3 in BGR) as PNG; its text chunk says that it is a result, and which one."""
    data = cv2.imencode(".png", image)[1].tobytes()
    return data[:_IHDR_END] + png_mark(kind.name) + data[_IHDR_END:]


def write_png(path: Path, image: NDArray[Any], kind: Kind) -> None:
    """Write an image (H x W, or H x W x 3 in BGR) as PNG, as `write_file` does."""
    write_file(path, encode_png(image, kind))
