#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The calibration record: its bytes are those of docs/rectification.md, and what is damaged is refused."""

from __future__ import annotations

import dataclasses
import re
import struct
import zlib

import numpy as np
import pytest

from litestereo.host_tools.cameras.camera_info import ideal_cameras
from litestereo.host_tools.cameras.record import MOST_BYTES, CalibrationRecord
from litestereo.host_tools.cameras.rectify import Rectifier
from litestereo.host_tools.core.errors import GeometryError
from litestereo.host_tools.core.geometry import StereoGeometry
from litestereo.host_tools.core.grid import Grid, row_budget
from support.pairs import generator
from support.paths import CHECKOUT
from support.rectification_maps import lens
from support.rigs import lens_cameras

WIDTH, HEIGHT = 160, 120


def drawn(width=WIDTH, height=HEIGHT, salt=0, **changes):
    """Return the record of drawn grids, with cameras of which those of the left one are changed."""
    rng         = generator(355, salt)
    left, right = lens_cameras(rng, 60, 2, width, height)
    first, second = (Grid(width, height, lens(width, height, rng)) for _ in range(2))
    return CalibrationRecord((dataclasses.replace(left, **changes), right), (first, second))


def resealed(data):
    """Return bytes with the CRC that belongs to them."""
    return data[:-4] + struct.pack("<I", zlib.crc32(data[:-4]))


@pytest.mark.parametrize(("model", "count"), [
    ("plumb_bob", 0), ("plumb_bob", 4), ("plumb_bob", 5), ("rational_polynomial", 8), ("rational_polynomial", 14),
    ("equidistant", 4), ("none", 5), ("", 12),
])
def test_what_is_written_is_read(model, count):
    """Every number of cameras and grids comes back, bit for bit."""
    for salt, size in enumerate(((WIDTH, HEIGHT), (640, 480), (33, 17))):
        coefficients = np.zeros(count) if model == "none" else generator(356, count).normal(0, 0.01, count)
        record       = drawn(*size, salt, distortion_model=model, distortion=coefficients, name="rig é")
        data         = record.encode()
        again        = CalibrationRecord.decode(data)
        assert len(data) == record.length and again.encode() == data
        for before, after in zip(record.cameras, again.cameras, strict=True):
            for name, value in vars(before).items():
                assert np.array_equal(value, getattr(after, name)), name
        for before, after in zip(record.grids, again.grids, strict=True):
            assert np.array_equal(before.nodes, after.nodes)
            assert (before.width, before.height, after.nodes.dtype) == (after.width, after.height, np.int16)


def test_bytes():
    """The offsets of the page, written out."""
    record   = drawn(640, 480, name="rig/left")
    data     = record.encode()
    geometry = record.geometry
    budget   = row_budget(record.grids)
    nodes    = 31*41*4
    assert len(data) == 848 + 2*nodes + 4 == 11020
    assert data[:4] == b"LSCA"
    assert struct.unpack_from("<HHIHHHHHH", data, 4) == (1, 848, 11020, 640, 480, 16, budget.span, budget.delay,
                                                         budget.steady_lead)
    assert struct.unpack_from("<I", data, 24)[0] == zlib.crc32(data[848:-4])
    assert struct.unpack_from("<6f", data, 28) == pytest.approx(
        (geometry.focal_px, geometry.focal_y_px, geometry.cx_left_px, geometry.cy_px,
         geometry.cx_right_px - geometry.cx_left_px, geometry.baseline_m), rel=1e-6, abs=1e-9)
    assert data[52:64] == bytes(12)
    for offset, camera in zip((64, 456), record.cameras, strict=True):
        count = len(camera.distortion)
        assert data[offset:offset + 32].rstrip(b"\0").decode() == camera.name
        assert (data[offset + 32], data[offset + 33], data[offset + 34:offset + 40]) == (0, count, bytes(6))
        for at, values in ((40, camera.camera_matrix), (112, camera.distortion), (224, camera.rectification),
                           (296, camera.projection)):
            assert struct.unpack_from(f"<{values.size}d", data, offset + at) == tuple(values.flat)
    # Second row, third column of the right camera's nodes.
    assert struct.unpack_from("<hh", data, 848 + nodes + 4*(41 + 2)) == tuple(record.grids[1].nodes[1, 2])
    assert struct.unpack_from("<I", data, len(data) - 4)[0] == zlib.crc32(data[:-4])


def test_room_of_a_device():
    """The room is that of the firmware's store, and the page has the sizes."""
    headers = CHECKOUT/"firmware"/"include"/"litestereo"
    sizes   = {name: int(value) for name, value in re.findall(r"#define FLASH_(\w+)_BYTES +(\d+)u",
                                                               (headers/"flash.h").read_text(encoding="utf-8"))}
    assert "RECORD_COPY_BYTES (5 * FLASH_SECTOR_BYTES)" in (headers/"records.h").read_text(encoding="utf-8")
    assert 5*sizes["SECTOR"] - sizes["PAGE"] == MOST_BYTES
    assert drawn(752, 480).length == 12756 and len(drawn(1024, 576).encode()) == 20092
    large = drawn(1280, 480)
    with pytest.raises(GeometryError, match=f"1280x480 pixels has {large.length} bytes, a device has room for 20224"):
        large.encode()
    with pytest.raises(GeometryError, match="has at most 20224 bytes, not 20225"):
        CalibrationRecord.decode(b"LSCA" + bytes(20221))


def test_damage_of_any_byte():
    """Each byte changed, and each length cut off."""
    data = drawn(48, 32).encode()
    rng  = generator(357)
    for position in range(len(data)):
        changed            = bytearray(data)
        changed[position] ^= 1 << rng.integers(8)
        with pytest.raises(GeometryError):
            CalibrationRecord.decode(bytes(changed))
    for length in range(len(data)):
        with pytest.raises(GeometryError):
            CalibrationRecord.decode(data[:length])
    with pytest.raises(GeometryError):
        CalibrationRecord.decode(data + b"\0")


@pytest.mark.parametrize(("offset", "layout", "values", "text"), [
    (0, "<4s", (b"LSRC",), "is no calibration record"),
    (4, "<H", (2,), "of version 2, these host tools know 1"),
    (6, "<H", (844,), "844 of them before the nodes"),
    (8, "<I", (1000,), "of 1000 bytes has"),
    (12, "<H", (0,), "for 0x120 pixels cannot have"),
    (12, "<H", (400,), "for 400x120 pixels cannot have"),
    (12, "<HH", (0xffff, 0xffff), "for 65535x65535 pixels cannot have"),
    (16, "<H", (8,), "nodes, which are 8 pixels apart"),
    (18, "<H", (3,), "first numbers of the calibration record are not those"),
    (20, "<H", (99,), "first numbers"),
    (22, "<H", (99,), "first numbers"),
    (24, "<I", (1,), "first numbers"),
    (28, "<f", (float("nan"),), "first numbers"),
    (48, "<f", (1.0,), "first numbers"),
    (64, "<4s", (b"\xff\xfe\xfd\xfc",), "a name that is not text"),
    (64, "<4s", (b"\x1b[2J",), "a name that is not text"),
    (96, "<B", (5,), "distortion model 5"),
    (97, "<B", (15,), "15 coefficients"),
    (97, "<B", (3,), "distortion_coefficients has 3 numbers"),
    (104, "<d", (float("nan"),), "camera_matrix has nan"),
    (456 + 224, "<d", (2.0,), "rectification_matrix is no rotation"),
    (456 + 296 + 24, "<d", (20.0,), "has no baseline"),
    (848, "<hh", (32767, 0), "folds over"),
])
def test_numbers_that_contradict_each_other(offset, layout, values, text):
    """The CRC is right, a number is wrong: one line says which."""
    data = bytearray(drawn(salt=3).encode())
    struct.pack_into(layout, data, offset, *values)
    with pytest.raises(GeometryError, match=text) as error:
        CalibrationRecord.decode(resealed(bytes(data)))
    assert "\n" not in str(error.value) and "\x1b" not in str(error.value)


def test_any_bytes():
    rng = generator(358)
    for length in (0, 3, 63, 68, 847, 900, 20224, 20225):
        for start in (b"", b"LSCA", drawn(48, 32).encode()[:64]):
            with pytest.raises(GeometryError):
                CalibrationRecord.decode(start + rng.bytes(max(length - len(start), 0)))


def test_names_of_cameras():
    """A long name is cut between characters."""
    for name, kept in (("x"*40, "x"*32), ("x" + "é"*20, "x" + "é"*15), ("", "")):
        assert CalibrationRecord.decode(drawn(name=name).encode()).cameras[0].name == kept


def test_grids_of_another_size():
    record = drawn()
    with pytest.raises(GeometryError, match="a grid is for images of 80x60 pixels, the cameras have 160x120"):
        CalibrationRecord(record.cameras, drawn(80, 60).grids)


def test_the_record_of_a_rectifier():
    """It has the grids with which the host rectifies; cameras without grids have no record."""
    rectifier = Rectifier(*ideal_cameras(StereoGeometry(WIDTH, HEIGHT, 140.0, 0.06, 79.5, 59.5, 81.0)))
    record    = CalibrationRecord.of(rectifier)
    assert record.grids is rectifier.pair.grids.grids and record.geometry == rectifier.geometry
    left, right = rectifier.cameras
    folded      = Rectifier(dataclasses.replace(left, distortion=np.array([-1.0, 0, 0, 0])), right)
    with pytest.raises(GeometryError, match="no device can rectify for these cameras: parts of the rectified image"):
        CalibrationRecord.of(folded)


def test_absurd_baselines():
    left, right   = drawn().cameras
    shifted       = right.projection.copy()
    shifted[0, 3] = -1e300
    with pytest.raises(GeometryError, match="a baseline of .* m does not fit"):
        CalibrationRecord((left, dataclasses.replace(right, projection=shifted)), drawn().grids).encode()
