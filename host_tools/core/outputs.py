#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What a command writes: checked against what it reads before the first write, and written all or nothing.

Every command that writes files makes one `Outputs`, names its inputs and each result, and only then begins to write.
Without `--force` no result replaces

- a file that the command reads, by any of its names: symbolic and hard links, `..`, other cases of letters;
- a file of another kind: a photo where a map is to be, a calibration where the cameras of rectified images are to be.

Two results of one command never have one name, not even with `--force`. Its earlier results are of the same kind, and
are replaced.
"""

from __future__ import annotations

import contextlib
import errno
import os
import secrets
import stat
import struct
import unicodedata
import zlib
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from .errors import ImageError

#: Bytes at the beginning of a file that tell its kind.
_HEAD_BYTES = 1 << 16

_PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"


@dataclass(frozen=True)
class Kind:
    """A kind of result: its name in messages, and whether the first bytes of a file are of this kind."""

    name:  str
    is_of: Callable[[bytes], bool]


def png_kind(name: str) -> Kind:
    """Return the kind of our PNG files that `encode_png` marks with `name`."""
    mark = png_mark(name)
    return Kind(name, lambda head: head.startswith(_PNG_SIGNATURE) and mark in head[:len(_PNG_SIGNATURE) + 128])


def png_mark(name: str) -> bytes:
    """Return the text chunk of our PNG files: it names the software, and what the picture is."""
    chunk = b"tEXtSoftware\0LiteStereo: " + name.encode("ascii")
    return struct.pack(">I", len(chunk) - 4) + chunk + struct.pack(">I", zlib.crc32(chunk))


def npy_kind(name: str, dtype: str) -> Kind:
    """Return the kind of .npy files of numbers of one type, `dtype` as in the header."""
    text = f"'descr': '{dtype}'".encode("ascii")
    return Kind(name, lambda head: head.startswith(b"\x93NUMPY") and text in head[:256])


DISPARITY_PNG   = png_kind("disparity map")
COLOURS_PNG     = png_kind("disparity map in colours")
DEPTH_PNG       = png_kind("depth")
RECTIFIED_PNG   = png_kind("rectified image")
MONTAGE_PNG     = png_kind("montage")
DISPARITY_NPY   = npy_kind("disparity map", "<i2")
DEPTH_NPY       = npy_kind("depth", "<f4")
DISPARITY_PFM   = Kind("disparity map", lambda head: head.startswith(b"Pf"))
CLOUD_PLY       = Kind("cloud", lambda head: head.startswith(b"ply") and b"\ncomment metres, x to the right" in head)
RECORDING       = Kind("recording of Rerun", lambda head: head.startswith(b"RRF"))
METRICS_CSV     = Kind("table of metrics", lambda head: head.startswith(b"pair,matcher,region,"))

#: The kinds of a map, by the formats of `core.images.FORMATS`.
MAP_KINDS = {"png": DISPARITY_PNG, "pfm": DISPARITY_PFM, "npy": DISPARITY_NPY}

_HINT = "name another place, or give --force to replace it"


class Outputs:
    """The results of one command.

    Parameters
    ----------
    inputs
        Files that the command reads; those that do not exist do not count.
    force
        Whether results may replace inputs and files of another kind.
    """

    def __init__(self, inputs: Iterable[Path] = (), force: bool = False) -> None:
        self._force   = force
        self._inputs  = set[tuple[object, ...]]()
        self._results = dict[tuple[object, ...], Path]()
        for path in inputs:
            with contextlib.suppress(OSError):
                status = path.stat()
                self._inputs |= {(status.st_dev, status.st_ino), _name(path)}

    def add(self, path: Path, kind: Kind) -> Path:
        """Plan a result, and return its path.

        Raises
        ------
        ImageError
            Another result has this name, or it would replace what it must not.
        """
        self.check(path, kind)
        name = _name(path)
        if name in self._results:
            other = self._results[name]
            raise ImageError(f"{path}: two results would be in this file" + (f" and {other}, which is the same file"
                                                                          if other != path else ""))
        self._results[name] = path
        return path

    def check(self, path: Path, kind: Kind) -> None:
        """Check a result against the inputs and what is there; raise ImageError as `add`."""
        if _is_stream(path):
            return
        target = Path(os.path.realpath(path))
        try:
            status = target.stat()
        except OSError as error:
            if error.errno not in (errno.ENOENT, errno.ENOTDIR):
                raise ImageError(f"{path}: cannot be written: {error.strerror or error}") from None
            above = next(parent for parent in target.parents if os.path.exists(parent))
            if not above.is_dir():
                raise ImageError(f"{path}: cannot be written: {above} is no folder") from None
            return
        if stat.S_ISDIR(status.st_mode):
            raise ImageError(f"{path}: cannot be written: it is a folder")
        if self._force:
            return
        if {(status.st_dev, status.st_ino), _name(path)} & self._inputs:
            raise ImageError(f"{path}: is an input of this command, and a result would replace it: {_HINT}")
        if status.st_size and not kind.is_of(_head(target)):
            raise ImageError(f"{path}: is there already, and is no {kind.name} that this command has written: {_HINT}")


def _is_stream(path: Path) -> bool:
    """Return whether a path is of a device or a pipe, as /dev/stdout: nothing is replaced, and nothing renamed."""
    # Of /dev/stdout the real name may be that of a file, into which a shell has the output written.
    return (os.path.abspath(path).startswith(("/dev/", "/proc/"))
            or os.path.exists(path) and not os.path.isfile(path) and not os.path.isdir(path))


def _head(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(_HEAD_BYTES)
    except OSError:
        return b"" # Cannot be read: of no known kind.


def _name(path: Path) -> tuple[object, ...]:
    """Return what two paths of one file have in common, whether it exists or not."""
    target = Path(os.path.realpath(path))
    above  = next((parent for parent in target.parents if os.path.isdir(parent)), Path(target.anchor))
    status = above.stat()
    parts  = target.relative_to(above).parts
    if folds_case(above):
        parts = tuple(unicodedata.normalize("NFC", part).casefold() for part in parts)
    return status.st_dev, status.st_ino, parts


def folds_case(folder: Path) -> bool:
    """Return whether names in a folder that differ only in the case of letters are of one file."""
    with contextlib.suppress(OSError), os.scandir(folder) as entries:
        for probe in (*(folder/entry.name for entry in entries), folder, *folder.parents):
            swapped = probe.with_name(probe.name.swapcase()) if probe.name else probe
            if swapped != probe:
                return os.path.exists(swapped) and os.path.samefile(probe, swapped)
    return False


def write_file(path: Path, data: bytes) -> None:
    """Write a file all or nothing, and create its folder if needed.

    The old file is there, whole, until the new one is. A link stays a link: its target is replaced.

    Raises
    ------
    ImageError
        The file cannot be written.
    """
    target = path if _is_stream(path) else Path(os.path.realpath(path))
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        _write(target, data)
    except OSError as error:
        raise ImageError(f"{path}: cannot be written: {error.strerror or error}") from None


def _write(target: Path, data: bytes) -> None:
    partial = partial_of(target)
    if partial == target:
        target.write_bytes(data)
        return
    there = target.exists()
    if there and not os.access(target, os.W_OK): # A rename would replace it all the same.
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    try:
        file = os.open(partial, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o666)
    except PermissionError:
        if not there:
            raise
        target.write_bytes(data) # The folder takes no new file, but this one may be written.
        return
    try:
        with open(file, "wb") as stream:
            stream.write(data)
        finish(partial, target)
    except BaseException:
        partial.unlink(missing_ok=True)
        raise


def partial_of(path: Path) -> Path:
    """Return where to write a file before it gets its name, with `finish`: itself if it is a device or a pipe."""
    if _is_stream(path):
        return path
    target = Path(os.path.realpath(path))
    # Hidden, so that no other command finds it in a folder of images.
    return target.with_name(f".litestereo-{secrets.token_hex(8)}.part")


def finish(partial: Path, path: Path) -> None:
    """Give a file of `partial_of` its name; raise OSError if that is impossible."""
    if partial == path:
        return
    target = Path(os.path.realpath(path))
    with contextlib.suppress(OSError):
        os.chmod(partial, stat.S_IMODE(target.stat().st_mode))
    os.replace(partial, target)
