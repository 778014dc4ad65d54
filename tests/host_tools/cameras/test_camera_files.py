#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Readers of cameras' files on bytes that Hypothesis thinks of, and on files that are made to harm."""

import time

import pytest
from hypothesis import given, seed, settings
from hypothesis import strategies as st

from campaigns.fuzz.host_cameras import CALIB_TXT, CAMERA_INFO, ROS2_ECHO, SEEDS, TARGETS
from litestereo.host_tools.cameras.calib_txt import parse_calib, read_calib
from litestereo.host_tools.cameras.camera_info import parse_camera_info, read_camera_info
from litestereo.host_tools.core.errors import GeometryError
from support.pairs import SEED

#: What a parser of text, numbers or YAML may trip over.
PIECES = st.sampled_from([
    b"[", b"]", b"{", b"}", b": ", b"- ", b"&a ", b"*a", b"<<: *a\n", b"---\n", b"...\n", b"? ", b"!!binary ",
    b"!!timestamp ", b"2024-13-45", b"9"*5000, b"1e999", b"-.inf", b".nan", b"nan", b"0x10", b"1_0", b"1:30",
    b"%YAML 9999999.1\n", b'"\\UFFFFFFFF"', b"\xef\xbb\xbf", b"\xff\xfe", b"\0", b"\r", b"=", b"#", b"\t", b"true",
    b"~", b"|\n", b">\n", b"'", b'"', b"-0", b"1e-320", b"\xc2\x85", b"\n",
])


@st.composite
def damaged(draw, name):
    """A valid file with a piece of it replaced, up to four times."""
    data = draw(st.sampled_from(SEEDS[name]))
    for _ in range(draw(st.integers(1, 4))):
        at     = draw(st.integers(0, len(data)))
        length = draw(st.integers(0, 30))
        data   = data[:at] + draw(PIECES | st.binary(max_size=8)) + data[at + length:]
    return data


@pytest.mark.parametrize("name", list(TARGETS))
def test_any_bytes(name):
    """Only the documented errors, and each of one line."""
    @seed(SEED)
    @settings(max_examples=400, deadline=None, database=None)
    @given(st.binary(max_size=200) | st.lists(PIECES, max_size=30).map(b"".join) | damaged(name))
    def read(data):
        TARGETS[name](data)
        try:
            parse_calib(data) if name == "calib_txt" else parse_camera_info(data, "left")
        except GeometryError as error:
            assert str(error).isprintable() and len(str(error)) < 500

    read()


#: References that expand to 9^39 values, and to as many merged mappings.
LEVELS = [b"a0: &a0 [1, 2]\n"] + [b"a%d: &a%d [%s]\n" % (n, n, b", ".join([b"*a%d" % (n - 1)]*9)) for n in range(1, 40)]
MERGES = [b"a0: &a0 {x: 1}\n"] + [b"a%d: &a%d {<<: [%s]}\n" % (n, n, b", ".join([b"*a%d" % (n - 1)]*9))
                                  for n in range(1, 40)]


@pytest.mark.parametrize("data", [
    b"["*100_000, b"["*60_000, b"["*500, b"{a: "*15_000, b"- "*30_000, b"a: &a [*a]", b"image_width: *none",
    b"".join(LEVELS), b"".join(LEVELS) + b"image_width: *a39\n",
    b"".join(LEVELS) + CAMERA_INFO.replace(b"640", b"*a39"),
    b"".join(MERGES), b"x"*3_000_000, b"- x\n"*1_000_000, b"- x\n"*16_000, b"image_width: " + b"9"*60_000,
    b"image_width: 640\nimage_height: " + b"9"*300, b"%YAML 1." + b"9"*5000 + b"\n---\na: 1",
    b"a: 2024-13-45", b'a: "\\UFFFFFFFF"', b"", b"---\n---\n", b"\xff\xfe\x00", b"!!python/object/apply:os.system [ls]",
], ids=lambda data: repr(data[:20]))
def test_files_that_harm(data):
    """One line, soon."""
    start = time.monotonic()
    with pytest.raises(GeometryError) as error:
        parse_camera_info(data, "left")
    assert "\n" not in str(error.value) and len(str(error.value)) < 300
    assert time.monotonic() - start < 10


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-32"])
@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_encodings_of_notepad(tmp_path, encoding, newline):
    for data, read in ((CAMERA_INFO, read_camera_info), (ROS2_ECHO, read_camera_info), (CALIB_TXT, read_calib)):
        plain, other = tmp_path / "left.yaml", tmp_path / "other" / "left.yaml"
        other.parent.mkdir(exist_ok=True)
        plain.write_bytes(data)
        other.write_bytes(data.decode().replace("\n", newline).encode(encoding))
        assert str(read(plain)) == str(read(other))


def test_messages_of_ros():
    """`ros2 topic echo`, and the capitals of `rostopic echo`: the first message."""
    file  = parse_camera_info(CAMERA_INFO.replace(b"camera_name: rig/right\n", b""), "left")
    lines = [line[0].upper() + line[1:] if line[:1] in "dkrp" and ":" in line[:2] else line
             for line in ROS2_ECHO.decode().splitlines()]
    for message in (ROS2_ECHO, "\n".join(lines).encode(), b"---\n" + ROS2_ECHO, ROS2_ECHO*30):
        assert str(parse_camera_info(message, "left")) == str(file)
    for old, new in ((b"binning_x: 0", b"binning_x: 1"), (b"  width: 0", b"  width: 640")):
        assert str(parse_camera_info(ROS2_ECHO.replace(old, new), "left")) == str(file)
    for old, new, text in ((b"binning_x: 0", b"binning_x: 2", "binning_x is '2'"),
                           (b"  width: 0", b"  width: 320", "roi width is '320'"),
                           (b"x_offset: 0", b"x_offset: 8", "roi x_offset is '8'")):
        with pytest.raises(GeometryError, match=text):
            parse_camera_info(ROS2_ECHO.replace(old, new), "left")
