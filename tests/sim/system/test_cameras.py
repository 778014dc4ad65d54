#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The SoC with cameras in litex_sim: a program matches frames of their test pattern, and the maps are OpenCV's."""

from __future__ import annotations

import re
import socket
import zlib

import numpy as np
import pytest

from litestereo.firmware import FIRMWARE_DIR
from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.sim.system.simulation import start_simulation
from support.dvp import noise_rows
from support.expected import expected_map
from support.opencv import same_as_opencv

pytestmark = [pytest.mark.system, pytest.mark.long]

PROGRAM       = FIRMWARE_DIR / "tests" / "programs" / "cameras.c"
WIDTH, HEIGHT = 112, 60

#: The largest number of disparities of the SoC, and otherwise the defaults.
SETTINGS = MatcherSettings(16, 9)

LINE = re.compile(r"cameras: disparity=(\d+) number=(\d+) flags=(\d+) skew=(-?\d+) sum=(\d+) map=0x(\w+) left=0x(\w+) "
                  r"right=0x(\w+)")


def checksum(image: np.ndarray) -> int:
    """Return the CRC-32 of an image in memory."""
    return zlib.crc32(np.ascontiguousarray(image).tobytes())


def test_test_pattern():
    """Map and images in memory are those of the noise, of three disparities; number, flags and skew are told."""
    with (start_simulation("cameras", program=PROGRAM) as simulation,
          socket.create_connection(("127.0.0.1", simulation.port), timeout=300) as console,
          console.makefile(encoding="ascii", errors="replace", newline="\n") as lines):
        found = [LINE.fullmatch(next(lines).strip()) for _ in range(3)]
        assert next(lines).strip() == "cameras: end"
    numbers = [int(one[2]) for one in found]
    assert numbers == sorted(set(numbers)) and numbers[0] >= 1
    for one, disparity in zip(found, (3, 8, 13), strict=True):
        left, right = noise_rows(WIDTH, HEIGHT, 0), noise_rows(WIDTH, HEIGHT, disparity)
        expected    = expected_map(left, right, SETTINGS)
        same_as_opencv(expected, left, right, SETTINGS)
        assert int(one[1]) == disparity
        assert int(one[3]) == 0 and abs(int(one[4])) <= 8
        assert int(one[5]) == left.sum()
        assert [int(text, 16) for text in one.groups()[5:]] == [checksum(expected.astype("<i2")), checksum(left),
                                                                checksum(right)]
