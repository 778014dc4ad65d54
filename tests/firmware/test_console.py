#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The pattern that the console's bench matches can be made anew from its description."""

import re
import socket
import time
import zlib

import numpy as np
import pytest

from litestereo.sim import model
from support.native_device import native_device


def pattern(width, height, seed):
    """Words of xorshift32, little-endian, the first one after one step from the seed."""
    words = np.empty((width * height + 3) // 4, "<u4")
    state = seed
    for index in range(len(words)):
        state ^= state << 13 & 0xffffffff
        state ^= state >> 17
        state ^= state << 5 & 0xffffffff
        words[index] = state
    return words.view(np.uint8)[:width * height].reshape(height, width)


def command(port, line, until):
    with socket.create_connection(("127.0.0.1", port), timeout=10) as connection:
        connection.sendall(line.encode() + b"\r")
        text  = ""
        limit = time.monotonic() + 20
        while not (found := re.search(until, text)) and time.monotonic() < limit:
            text += connection.recv(4096).decode("ascii")
        assert found, text
        return found


@pytest.mark.parametrize(("width", "height", "disparities", "block_size"), [
    (61, 33, 16, 5),
    (160, 120, 64, 9),
])
def test_bench_matches_the_documented_pattern(width, height, disparities, block_size):
    with native_device() as port:
        found = command(port, f"bench {width} {height} {disparities} {block_size}",
                        r"bench: width=(\d+) height=(\d+) disparities=(\d+) block_size=(\d+) clocks=(\d+) "
                        r"first_row_clocks=(\d+) crc32=0x([0-9a-f]{8})\r\n")
    assert [int(value) for value in found.groups()[:4]] == [width, height, disparities, block_size]
    expected = model.match(pattern(width, height, 1), pattern(width, height, 2), disparities, block_size)
    assert int(found[7], 16) == zlib.crc32(expected.astype("<i2").tobytes())


def test_selftest_on_the_console():
    with native_device() as port:
        assert command(port, "selftest", r"selftest: passed, (\d+) frames")[1] == "3"
    with native_device("--bus-error") as port:
        command(port, "selftest", r"selftest: FAILED: the matcher ended with error 2")
    with native_device("--hang-matcher") as port:
        command(port, "selftest", r"selftest: FAILED: the matcher did not finish in \d+ clocks")
