#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Arrays from files: as NumPy and OpenCV read them, and damaged ones in one line."""

import io
import pickle
import struct
import tracemalloc
import zipfile

import cv2
import numpy as np
import pytest
from hypothesis import given, seed, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as drawn

from litestereo.host_tools.core.arrays import decode_npy, decode_npz, decode_pfm, is_photoshop
from litestereo.host_tools.core.errors import ImageError
from support.pairs import SEED


def thorough(test):
    return seed(SEED)(settings(max_examples=300, deadline=None, database=None)(test))


def npy(array, **options):
    buffer = io.BytesIO()
    np.save(buffer, array, **options)
    return buffer.getvalue()


def header(text, version=(1, 0), body=b""):
    """A .npy file with that header."""
    text = text.encode("latin1") + b"\n"
    size = struct.pack("<H" if version == (1, 0) else "<I", len(text))
    return b"\x93NUMPY" + bytes(version) + size + text + body


KINDS = st.one_of(drawn.integer_dtypes(endianness="?"), drawn.unsigned_integer_dtypes(endianness="?"),
                  drawn.floating_dtypes(endianness="?"), drawn.boolean_dtypes(), drawn.complex_number_dtypes())


@thorough
@given(drawn.arrays(KINDS, drawn.array_shapes(min_dims=0, max_dims=4, min_side=0, max_side=5)), st.booleans())
def test_arrays_of_numbers_come_back(array, column_major):
    array = np.asfortranarray(array) if column_major else array
    found = decode_npy(npy(array), "a.npy")
    np.testing.assert_array_equal(found, array)
    assert found.dtype == array.dtype.newbyteorder("=") and found.shape == array.shape
    for save in (np.savez, np.savez_compressed):
        buffer = io.BytesIO()
        save(buffer, array)
        np.testing.assert_array_equal(decode_npz(buffer.getvalue(), "a.npz"), array)


@thorough
@given(st.binary(max_size=200), st.integers(0, 200), st.integers(0, 3))
def test_any_bytes_are_read_or_refused(data, place, how):
    valid = [npy(np.ones((3, 4), np.float32)), b"PK\3\4", b"Pf\n3 4\n-1.0\n" + bytes(48), b"\x93NUMPY\1\0"][how]
    for decode in (decode_npy, decode_npz, decode_pfm):
        for one in (data, valid[:place] + data, valid[:place] + data + valid[place:]):
            try:
                decode(one, "a")
            except ImageError as error:
                assert str(error).startswith("a: ") and str(error).isprintable()


class Harmful:
    def __reduce__(self):
        return pytest.fail, ("a pickle was run",)


@pytest.mark.parametrize("data", [
    b"", b"\x93NUMPY", b"\x93NUMPY\1\0\xff\xff",
    npy(np.array([[Harmful()]]), allow_pickle=True), pickle.dumps(Harmful()), npy(np.array([["a"]])),
    npy(np.zeros((2, 2), "i2,f4")), npy(np.zeros(3, "M8[s]")), npy(np.ones((2, 2)))[:-1], npy(np.ones((2, 2))) + b"\0",
    header("{'descr': '<f4', 'fortran_order': False, 'shape': (1000000, 1000000)}"),
    header("{'descr': '<f4', 'fortran_order': False, 'shape': (1000000000000000000000, 1)}"),
    header("{'descr': '<f4', 'fortran_order': False, 'shape': (-1, -4)}", body=bytes(16)),
    header("{'descr': '<f4', 'fortran_order': False, 'shape': (2, True)}", body=bytes(9)),
    header("{'descr': '<f4', 'fortran_order': False, 'shape': (1, 1, 1, 1, 1)}", body=bytes(4)),
    header("{'descr': '<V400000', 'fortran_order': False, 'shape': (1,)}"),
    header("{'descr': '<f4', 'fortran_order': False}"), header("{'descr'"), header("("*9000), header("-"*9000 + "1"),
    header("[" * 90 + "]"*90), header("{'descr': '<f4', 'fortran_order': False, 'shape': (2, 2)}", (3, 0), bytes(16)),
    header("{'descr': '<f4', 'fortran_order': False, 'shape': (2, 2)}" + " "*20000, (2, 0), bytes(16)),
    header("{'descr': ',,', 'fortran_order': False, 'shape': (2, 2)}"), header("\0"), header("{1: 2}"),
])
def test_damaged_npy(data):
    with pytest.raises(ImageError) as caught:
        decode_npy(data, "a.npy")
    assert str(caught.value).startswith("a.npy: ") and str(caught.value).isprintable()
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w") as file:
        file.writestr("one.npy", data)
    with pytest.raises(ImageError) as caught:
        decode_npz(archive.getvalue(), "a.npz")
    assert str(caught.value).isprintable()


def test_no_more_memory_than_the_file():
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as file, file.open("a.npy", "w") as member:
        member.write(header("{'descr': '<f4', 'fortran_order': False, 'shape': (100000, 1000000)}"))
        for _ in range(4):
            member.write(bytes(1 << 20))
    for decode, data in ((decode_npz, archive.getvalue()), (decode_pfm, b"Pf\n30000 30000\n-1\n" + bytes(9)),
                         (decode_npy, header("{'descr': '<f8', 'fortran_order': False, 'shape': (30000, 30000)}"))):
        tracemalloc.start()
        with pytest.raises(ImageError, match="is damaged"):
            decode(data, "a")
        most = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert most < 20 << 20


def test_archives_of_several_arrays():
    def archive(**arrays):
        buffer = io.BytesIO()
        np.savez(buffer, **arrays)
        return buffer.getvalue()

    assert decode_npz(archive(a=np.ones(3), map=np.ones((2, 2)), b=np.array(1)), "a").shape == (2, 2)
    for number, arrays in ((2, {"a": np.ones((2, 2)), "b": np.ones((2, 2))}), ("no", {})):
        with pytest.raises(ImageError, match=f"has {number} arrays of two dimensions"):
            decode_npz(archive(**arrays), "a")


#: Headers of a PFM of 4 x 3 pixels, little-endian.
HEADERS = [b"Pf\n4 3\n-1.0\n", b"Pf\n4 3\n-1\n", b"Pf 4 3 -1.0\n", b"Pf\r\n4 3\r\n-1.0\r\n", b"Pf\n4 3\n-0.003922\n",
           b"Pf\n4 3\n-1e0\n", b"Pf\n4  3\n-.5\n", b"Pf\t4\t3\t-1.000000\n"]


@pytest.mark.parametrize("head", HEADERS)
@pytest.mark.parametrize("first", [1.0, np.frombuffer(b"\n\n\n\n", "<f4")[0], np.frombuffer(b"   \r", "<f4")[0]])
def test_headers_of_pfm(head, first):
    rows    = np.arange(12, dtype=np.float32).reshape(3, 4)
    rows[2, 0] = first
    found   = decode_pfm(head + rows[::-1].astype("<f4").tobytes(), "a")
    assert np.array_equal(found, rows)
    big     = decode_pfm(head.replace(b"-", b"", 1) + rows[::-1].astype(">f4").tobytes(), "a")
    assert np.array_equal(big, rows)
    assert not is_photoshop(head)


def test_photoshop_has_the_top_row_first():
    rows = np.arange(12, dtype=np.float32).reshape(3, 4)
    for head in (b"Pf\n4\n3\n-1.0\n", b"Pf\r\n4\r\n3\r\n-1.0\r\n"):
        data = head + rows.astype("<f4").tobytes()
        assert is_photoshop(data) and np.array_equal(decode_pfm(data, "a"), rows)
    plain = cv2.imdecode(np.frombuffer(b"Pf\n4\n3\n-1.0\n" + rows.astype("<f4").tobytes(), np.uint8), -1)
    assert plain.shape == (3, 4)


@pytest.mark.parametrize("data", [
    b"Pf\n4 3\nnan\n", b"Pf\n4 3\n0\n", b"Pf\n4 3\n-0.0\n", b"Pf\n4 3\ninf\n", b"Pf\n4 3\n-1e999\n",
    b"Pf\n4 3\n1e-999\n",
    b"Pf\n4 3\n.\n", b"Pf\n4 3\n1.2.3\n", b"Pf\n4 3\n--1\n", b"Pf\n4 3\n-1.0", b"Pf\n4 3\n", b"Pf\n4 -3\n-1\n",
    b"Pf\n99999999999 99999999999\n-1.0\n", b"Pf\n999999999 999999999\n-1.0\n", b"Pf\n4294967296 4294967296\n-1.0\n",
    b"Pf\n0 3\n-1\n", b"Pf\n4 0\n-1\n", b"Pf\n4 3 1\n-1.0\n", b"Pf\n4_0 3\n-1.0\n", b"# a\nPf\n4 3\n-1.0\n",
    b"P5\n4 3\n255\n", b"Pf4 3\n-1.0\n",
])
def test_damaged_pfm(data):
    for body in (b"", bytes(48), bytes(47), bytes(49), bytes(96)):
        with pytest.raises(ImageError, match="is not a grey PFM") as caught:
            decode_pfm(data + body, "a")
        assert str(caught.value).isprintable()


def test_bytes_too_many_and_too_few():
    for head in HEADERS:
        for size in (0, 1, 44, 47, 49, 52, 96):
            with pytest.raises(ImageError, match=f"4x3 pixels are 48 bytes, it has {size}"):
                decode_pfm(head + b"\x41"*size, "a")
    with pytest.raises(ImageError, match="colour PFM"):
        decode_pfm(b"PF\n1 1\n-1\n" + bytes(12), "a")
