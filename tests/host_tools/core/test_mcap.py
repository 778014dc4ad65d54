#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""MCAP files: read by the library of their inventors, cut short at every byte, and damaged."""

from __future__ import annotations

import io
import struct

import mcap.reader
import mcap.stream_reader
import pytest

from litestereo.host_tools.core import mcap as ours
from litestereo.host_tools.core.errors import ImageError
from litestereo.host_tools.core.mcap import CHUNK_BYTES, MAGIC, McapReader, McapWriter
from support.pairs import byte_generator

DEFINITION = "uint8[] data"


def written(frames, chunk_bytes=CHUNK_BYTES, monkeypatch=None):
    """Return the bytes of a file with frames, each a list of channel, time and data."""
    if monkeypatch is not None:
        monkeypatch.setattr(ours, "CHUNK_BYTES", chunk_bytes)
    stream   = io.BytesIO()
    writer   = McapWriter(stream, "a test")
    writer.add_metadata("notes", {"one": "1", "täglich": ""})
    channels = [writer.add_channel(f"/topic{number}", f"kinds/msg/Kind{number % 2}", DEFINITION, {"name": "x"})
                for number in range(3)]
    for frame in frames:
        for channel, stamp_ns, data in frame:
            writer.write(channels[channel], stamp_ns, data)
        writer.end_frame()
    writer.close()
    return stream.getvalue()


def draw(salt, count=12, most=60):
    rng = byte_generator(1600, salt)
    return [[(channel, 1000 + number, rng.randbytes(rng.randrange(most))) for channel in range(3)]
            for number in range(count)]


def flat(frames):
    return [(f"/topic{channel}", f"kinds/msg/Kind{channel % 2}", stamp, data)
            for frame in frames for channel, stamp, data in frame]


def read(path):
    reader = McapReader(path)
    return [(one.topic, one.kind, one.stamp_ns, one.data) for one in reader.messages()], reader


@pytest.mark.parametrize("chunk_bytes", [1, 200, CHUNK_BYTES])
def test_the_library_reads_it(chunk_bytes, monkeypatch, tmp_path):
    """With its checks of sums and its index, and from begin to end; and so do we."""
    frames = draw(1)
    data   = written(frames, chunk_bytes, monkeypatch)
    reader = mcap.reader.SeekingReader(io.BytesIO(data), validate_crcs=True)
    found  = [(channel.topic, schema.name, message.log_time, message.data)
              for schema, channel, message in reader.iter_messages(log_time_order=False)]
    assert sorted(found) == sorted(flat(frames))
    summary = reader.get_summary()
    assert summary.statistics.message_count == 36 and summary.statistics.channel_message_counts == {1: 12, 2: 12, 3: 12}
    assert (summary.statistics.message_start_time, summary.statistics.message_end_time) == (1000, 1011)
    assert len(summary.chunk_indexes) == summary.statistics.chunk_count == (1 if chunk_bytes > 1000 else
                                                                           12 if chunk_bytes == 1 else
                                                                           summary.statistics.chunk_count)
    assert reader.get_header().profile == "ros2" and reader.get_header().library == "a test"
    # Of a time its messages alone.
    assert [message.log_time for _, _, message in reader.iter_messages(start_time=1003, end_time=1005)] == [1003]*3 + [
        1004]*3
    stream = mcap.stream_reader.StreamReader(io.BytesIO(data), validate_crcs=True)
    kinds  = [type(record).__name__ for record in stream.records]
    assert kinds[0] == "Header" and kinds[-1] == "Footer" and kinds.count("Message") == 36
    (tmp_path/"a.mcap").write_bytes(data)
    ours_found, reader = read(tmp_path/"a.mcap")
    assert ours_found == flat(frames) and not reader.cut
    assert reader.metadata == {"notes": {"one": "1", "täglich": ""}}


def test_cut_at_every_byte(monkeypatch, tmp_path):
    """What is read is the begin of the messages, a whole number of chunks; only the whole file is not cut."""
    frames = draw(2, 5, 20)
    data   = written(frames, 1, monkeypatch)
    end    = data.index(struct.pack("<BQ", 0x0F, 4))
    counts = set()
    for length in range(len(MAGIC), len(data) + 1):
        path = tmp_path/"a.mcap"
        path.write_bytes(data[:length])
        found, reader = read(path)
        assert found == flat(frames)[:len(found)] and len(found) % 3 == 0
        assert reader.cut == (length < end + 13)
        counts.add(len(found))
    assert counts == {0, 3, 6, 9, 12, 15}


def test_damaged_bytes(monkeypatch, tmp_path):
    """They are refused with the name of the file, or change nothing that is read before them."""
    frames  = draw(3, 5, 20)
    data    = written(frames, 1, monkeypatch)
    rng     = byte_generator(1601)
    refused = 0
    for _ in range(400):
        broken = bytearray(data)
        for _ in range(rng.choice([1, 1, 8])):
            broken[rng.randrange(len(broken))] = rng.randrange(256)
        path = tmp_path/"a.mcap"
        path.write_bytes(bytes(broken))
        try:
            read(path)
        except ImageError as error:
            assert str(error).startswith(f"{path}: ") and "\n" not in str(error)
            refused += 1
    assert refused > 50


@pytest.mark.parametrize(("data", "text"), [
    (b"", "is no MCAP file"), (b"\x89PNG\r\n\x1a\n", "is no MCAP file"),
    # A chunk of another program.
    (MAGIC + struct.pack("<BQ", 6, 28 + 8 + 8) + bytes(28) + struct.pack("<I4sQ", 4, b"zstd", 0), "with 'zstd'"),
    (MAGIC + struct.pack("<BQ", 5, 3) + bytes(3), "is damaged"),
    (MAGIC + struct.pack("<BQ", 5, 22) + bytes(22), "is damaged"),
])
def test_other_files(data, text, tmp_path):
    (tmp_path/"a.mcap").write_bytes(data)
    with pytest.raises(ImageError, match=text):
        read(tmp_path/"a.mcap")
    with pytest.raises(ImageError, match="b.mcap: cannot be read: No such file"):
        read(tmp_path/"b.mcap")


def test_a_length_asks_for_no_memory(tmp_path):
    (tmp_path/"a.mcap").write_bytes(MAGIC + struct.pack("<BQ", 5, 1 << 62))
    found, reader = read(tmp_path/"a.mcap")
    assert found == [] and reader.cut


def test_memory_is_that_of_a_chunk(monkeypatch):
    """After each frame: nothing of the chunks before it, and of the index no more than a part."""
    monkeypatch.setattr(ours, "CHUNK_BYTES", 1000)
    monkeypatch.setattr(ours, "_INDEX_BYTES", 500)
    stream  = io.BytesIO()
    writer  = McapWriter(stream, "a test")
    channel = writer.add_channel("/a", "kinds/msg/A", DEFINITION, {})
    for number in range(50):
        writer.write(channel, number, bytes(400))
        writer.end_frame()
        assert writer._chunk.records.tell() < 1000
    assert writer._index._rolled
    writer.close()
    reader = mcap.reader.SeekingReader(io.BytesIO(stream.getvalue()), validate_crcs=True)
    assert len(list(reader.iter_messages())) == 50 and len(reader.get_summary().chunk_indexes) == 17


def test_a_file_without_messages(tmp_path):
    data = written([])
    assert mcap.reader.SeekingReader(io.BytesIO(data)).get_summary().statistics.message_count == 0
    (tmp_path/"a.mcap").write_bytes(data)
    assert read(tmp_path/"a.mcap")[0] == []
