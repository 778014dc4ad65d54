#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""MCAP files: messages with their times, in chunks that are whole or not there.

The format is that of https://mcap.dev/spec. rosbags, which has the messages, writes MCAP files of whole bags only, and
reads none whose end is missing. Here each chunk goes to the operating system when it is finished: after a crash of the
process all finished chunks are there, and they are read without the index at the end.
"""

from __future__ import annotations

import io
import os
import struct
import tempfile
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

from .errors import ImageError

MAGIC = b"\x89MCAP0\r\n"

_HEADER, _FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _MESSAGE_INDEX, _CHUNK_INDEX = range(1, 9)
_STATISTICS, _METADATA, _DATA_END = 0x0B, 0x0C, 0x0F

#: A chunk is finished at the end of the frame in which it reaches this size, in bytes.
CHUNK_BYTES = 1 << 20

#: Bytes of the index that are kept in memory; what is more is in a temporary file.
_INDEX_BYTES = 1 << 20


def _text(text: str) -> bytes:
    data = text.encode()
    return struct.pack("<I", len(data)) + data


def _map(values: Mapping[str, str]) -> bytes:
    data = b"".join(_text(name) + _text(value) for name, value in values.items())
    return struct.pack("<I", len(data)) + data


def _record(kind: int, data: bytes) -> bytes:
    return struct.pack("<BQ", kind, len(data)) + data


@dataclass
class _OpenChunk:
    """The chunk that is being filled: its records, and of each channel the times and places of its messages."""

    records:  io.BytesIO                        = field(default_factory=io.BytesIO)
    messages: dict[int, list[tuple[int, int]]] = field(default_factory=dict)


class McapWriter:
    """Writes an MCAP file of ROS 2 messages; `close` it at the end.

    Memory is that of a chunk. A process that is killed leaves all finished chunks.

    Parameters
    ----------
    stream
        The file, open for writing bytes without a buffer, at its begin.
    library
        What writes it.
    """

    def __init__(self, stream: BinaryIO, library: str) -> None:
        self._stream   = stream
        self._place    = 0
        self._schemas  = dict[str, bytes]()
        self._channels = list[bytes]()
        self._counts   = dict[int, int]()
        self._ends_ns  = (0, 0)
        self._chunk    = _OpenChunk()
        self._chunks   = 0
        self._metadata = 0
        self._index    = tempfile.SpooledTemporaryFile(_INDEX_BYTES)  # noqa: SIM115 - `close` closes it
        self._write(MAGIC + _record(_HEADER, _text("ros2") + _text(library)))

    def _write(self, data: bytes) -> None:
        self._stream.write(data)
        self._place += len(data)

    def add_metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Add texts by their names, outside of all chunks."""
        self._write(_record(_METADATA, _text(name) + _map(values)))
        self._metadata += 1

    def add_channel(self, topic: str, kind: str, definition: str, values: Mapping[str, str]) -> int:
        """Add a channel of messages of one kind, with the kind's definition; return its number."""
        if kind not in self._schemas:
            number              = len(self._schemas) + 1
            self._schemas[kind] = _record(_SCHEMA, struct.pack("<H", number) + _text(kind) + _text("ros2msg")
                                          + _text(definition))
            self._write(self._schemas[kind])
        channel = len(self._channels) + 1
        schema  = list(self._schemas).index(kind) + 1
        self._channels.append(_record(_CHANNEL, struct.pack("<HH", channel, schema) + _text(topic) + _text("cdr")
                                      + _map(values)))
        self._counts[channel] = 0
        self._write(self._channels[-1])
        return channel

    def write(self, channel: int, stamp_ns: int, data: bytes) -> None:
        """Add a message: its time in nanoseconds since 1970, and its bytes."""
        self._chunk.messages.setdefault(channel, []).append((stamp_ns, self._chunk.records.tell()))
        self._chunk.records.write(_record(_MESSAGE, struct.pack("<HIQQ", channel, self._counts[channel], stamp_ns,
                                                                stamp_ns) + data))
        self._ends_ns = ((min(self._ends_ns[0], stamp_ns), max(self._ends_ns[1], stamp_ns))
                         if sum(self._counts.values()) else (stamp_ns, stamp_ns))
        self._counts[channel] += 1

    def end_frame(self) -> None:
        """Finish the chunk if it is large enough: no frame is in two chunks."""
        if self._chunk.records.tell() >= CHUNK_BYTES:
            self._finish_chunk()

    def _finish_chunk(self) -> None:
        """Write the chunk with its index, and begin the next one."""
        chunk, self._chunk = self._chunk, _OpenChunk()
        if not chunk.messages:
            return
        records = chunk.records.getvalue()
        stamps  = [stamp for messages in chunk.messages.values() for stamp, _ in messages]
        span    = struct.pack("<QQ", min(stamps), max(stamps))
        start   = self._place
        self._write(_record(_CHUNK, span + struct.pack("<QI", len(records), zlib.crc32(records)) + _text("")
                            + struct.pack("<Q", len(records)) + records))
        length, places = self._place - start, b""
        for channel, messages in chunk.messages.items():
            places += struct.pack("<HQ", channel, self._place)
            entries = b"".join(struct.pack("<QQ", *message) for message in messages)
            self._write(_record(_MESSAGE_INDEX, struct.pack("<HI", channel, len(entries)) + entries))
        self._index.write(_record(_CHUNK_INDEX, span + struct.pack("<QQ", start, length)
                                  + struct.pack("<I", len(places)) + places
                                  + struct.pack("<Q", self._place - start - length) + _text("")
                                  + struct.pack("<QQ", len(records), len(records))))
        self._chunks += 1
        self._stream.flush()

    def close(self) -> None:
        """Write what remains, and the index; the file itself stays open."""
        self._finish_chunk()
        self._write(_record(_DATA_END, struct.pack("<I", 0)))
        summary = self._place
        for record in (*self._schemas.values(), *self._channels):
            self._write(record)
        counts = b"".join(struct.pack("<HQ", *item) for item in self._counts.items())
        self._write(_record(_STATISTICS, struct.pack(
            "<QHIIIIQQI", sum(self._counts.values()), len(self._schemas), len(self._channels), 0, self._metadata,
            self._chunks, *self._ends_ns, len(counts)) + counts))
        self._index.seek(0)
        while data := self._index.read(_INDEX_BYTES):
            self._write(data)
        self._index.close()
        self._write(_record(_FOOTER, struct.pack("<QQI", summary, 0, 0)) + MAGIC)
        self._stream.flush()


@dataclass(frozen=True)
class McapMessage:
    """A message: its topic and kind, its time in nanoseconds since 1970, and its bytes."""

    topic:    str
    kind:     str
    stamp_ns: int
    data:     bytes


class _Fields:
    """Reads the fields of a record; raises ValueError at its end."""

    def __init__(self, data: bytes) -> None:
        self._data  = data
        self._place = 0

    def numbers(self, form: str) -> tuple[int, ...]:
        size = struct.calcsize(form)
        return struct.unpack(form, self.take(size))

    def take(self, size: int) -> bytes:
        if not 0 <= size <= len(self._data) - self._place:
            raise ValueError("a field is longer than its record")
        self._place += size
        return self._data[self._place - size:self._place]

    def text(self) -> str:
        return self.take(self.numbers("<I")[0]).decode()

    def map(self) -> dict[str, str]:
        inner, found = _Fields(self.take(self.numbers("<I")[0])), dict[str, str]()
        while not inner.is_empty:
            name        = inner.text()
            found[name] = inner.text()
        return found

    def rest(self) -> bytes:
        return self.take(len(self._data) - self._place)

    @property
    def is_empty(self) -> bool:
        return self._place == len(self._data)


class McapReader:
    """Reads an MCAP file from its begin to its end, or to its last whole chunk, a chunk at a time.

    `metadata` has the texts by the names of their records, as far as the file is read; `cut` says whether its end is
    missing, once all of it is read.
    """

    def __init__(self, path: Path) -> None:
        self.path     = path
        self.metadata = dict[str, dict[str, str]]()
        self.cut      = False
        self._schemas  = dict[int, str]()
        self._channels = dict[int, tuple[str, str]]()

    def messages(self) -> Iterator[McapMessage]:
        """Yield the messages in their order.

        Raises
        ------
        ImageError
            The file cannot be read, is no MCAP file, is damaged, or has compressed chunks.
        """
        try:
            with self.path.open("rb") as stream:
                if stream.read(len(MAGIC)) != MAGIC:
                    raise ImageError(f"{self.path}: is no MCAP file")
                yield from self._messages(stream)
        except OSError as error:
            raise ImageError(f"{self.path}: cannot be read: {error.strerror or error}") from None
        except (ValueError, struct.error):  # ValueError: also of a text that is no UTF-8.
            raise ImageError(f"{self.path}: is damaged") from None

    def _messages(self, stream: BinaryIO) -> Iterator[McapMessage]:
        while (record := self._record(stream)) is not None:
            kind, data = record
            if kind in (_DATA_END, _FOOTER):
                return
            if kind != _CHUNK:
                yield from self._of_record(kind, data)
                continue
            fields             = _Fields(data)
            *_, length, crc = fields.numbers("<QQQI")
            compression     = fields.text()
            if compression:
                raise ImageError(f"{self.path}: has chunks that are compressed with {compression!r}: recordings of "
                                 "`litestereo stream --record` are not")
            records = fields.take(fields.numbers("<Q")[0])
            if len(records) != length or crc not in (0, zlib.crc32(records)):
                raise ValueError("the chunk has other bytes than its header says")
            inner = io.BytesIO(records)
            while (record := self._record(inner)) is not None:
                yield from self._of_record(*record)

    def _record(self, stream: BinaryIO) -> tuple[int, bytes] | None:
        """Read a record: its kind and bytes; None at the end of the stream, or where one is cut short."""
        head = stream.read(9)
        if len(head) < 9:
            # A file that is whole has a record that says so; the records of a chunk simply end.
            self.cut |= not isinstance(stream, io.BytesIO)
            return None
        kind, length = struct.unpack("<BQ", head)
        # A damaged length must not ask for memory.
        place = stream.tell()
        if length > stream.seek(0, os.SEEK_END) - place:
            self.cut = True
            return None
        stream.seek(place)
        return kind, stream.read(length)

    def _of_record(self, kind: int, data: bytes) -> Iterator[McapMessage]:
        """Note what a record says, and yield its message if it is one."""
        fields = _Fields(data)
        if kind == _SCHEMA:
            (schema,)             = fields.numbers("<H")
            self._schemas[schema] = fields.text()
        elif kind == _CHANNEL:
            channel, schema         = fields.numbers("<HH")
            self._channels[channel] = fields.text(), self._schemas.get(schema, "")
        elif kind == _METADATA:
            name                = fields.text()
            self.metadata[name] = fields.map()
        elif kind == _MESSAGE:
            channel, _, stamp_ns, _ = fields.numbers("<HIQQ")
            if channel not in self._channels:
                raise ValueError("a message of an unknown channel")
            yield McapMessage(*self._channels[channel], stamp_ns, fields.rest())
