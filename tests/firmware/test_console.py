#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The pattern that the console's bench matches can be generated from its description."""

import dataclasses
import re
import socket
import time
import zlib

import pytest

from litestereo.sim.bench.clocks import ALL_STAGES
from litestereo.sim.models import block_matching as model
from litestereo.sim.models.stereo_bm import stereo_bm
from support.native_device import native_device
from support.pattern import pattern


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
    (160, 40, 64, 9),
])
@pytest.mark.parametrize("name", ["bench", "cpu_bench"])
@pytest.mark.parametrize("stages", ["sad", "all"])
def test_bench_matches_the_documented_pattern(width, height, disparities, block_size, name, stages):
    """On the accelerator and on the CPU, with no stage and with all, the checksum is that of the documented pattern."""
    with native_device() as port:
        found = command(port, f"{name} {width} {height} {disparities} {block_size} {stages}",
                        name + r": width=(\d+) height=(\d+) disparities=(\d+) block_size=(\d+) clocks=(\d+) "
                        r"first_row_clocks=(\d+) crc32=0x([0-9a-f]{8})\r\n")
    assert [int(value) for value in found.groups()[:4]] == [width, height, disparities, block_size]
    pair = pattern(width, height, 1), pattern(width, height, 2)
    if stages == "sad":
        expected = model.match(*pair, disparities, block_size)
    else:
        expected = stereo_bm(*pair, dataclasses.replace(ALL_STAGES, disparities=disparities, block_size=block_size))
    assert int(found[7], 16) == zlib.crc32(expected.astype("<i2").tobytes())


def test_selftest_on_the_console():
    with native_device() as port:
        assert command(port, "selftest", r"selftest: passed, (\d+) frames")[1] == "4"
    with native_device("--bus-error") as port:
        command(port, "selftest", r"selftest: FAILED: the matcher ended with error 2")
    with native_device("--hang-matcher") as port:
        command(port, "selftest", r"selftest: FAILED: the matcher did not finish in \d+ clocks")
