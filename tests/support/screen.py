#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The picture that a screen should show of a map, and the one that the simulated screen shows."""

from __future__ import annotations

import re
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

#: Width and height of the screen in pixels.
SIZE = (640, 480)

#: Pads of the simulated PHY.
PADS = [("clk", 1), ("de", 1), ("hsync", 1), ("vsync", 1), ("r", 8), ("g", 8), ("b", 8)]

#: What a monitor measures: pixel clocks and lines of a picture, both with blanking.
CLOCKS, LINES = 800*525, 525


@dataclass(frozen=True)
class Shown:
    """A picture of the simulated screen: its number, from 1, clocks and lines, and rows x columns x RGB, uint8."""
    number: int
    clocks: int
    lines:  int
    rgb:    NDArray[np.uint8]


def expected_picture(disparity: NDArray[np.int16], disparities: int, min_disparity: int = 0,
                     size: tuple[int, int] = SIZE) -> NDArray[np.uint8]:
    """Return the grey picture of a map, rows x columns, centred on the screen; halves are rounded down.

    Parameters
    ----------
    disparity
        Sixteenths of a pixel, rows x columns.
    disparities, min_disparity
        As in the settings, pixels; the largest searched disparity becomes 255.
    size
        Width and height of the picture, pixels.
    """
    largest = 16*(min_disparity + disparities - 1)
    scale   = 255*65536//largest
    grey    = np.clip((disparity.astype(np.int64)*scale + 32768) >> 16, 0, 255)
    grey[disparity == 16*(min_disparity - 1)] = 0
    for axis, wanted in enumerate(reversed(size)):
        missing = wanted - grey.shape[axis]
        if missing < 0:
            grey = np.take(grey, range(-missing//2, -missing//2 + wanted), axis)
        else:
            around       = [(0, 0), (0, 0)]
            around[axis] = (missing//2, missing - missing//2)
            grey         = np.pad(grey, around)
    return grey.astype(np.uint8)


def drawn_picture(programs: Path, disparity: NDArray[np.int16], disparities: int, min_disparity: int = 0,
                  size: tuple[int, int] = SIZE) -> NDArray[np.uint8]:
    """Return the same picture as the firmware draws it, compiled for this computer."""
    numbers = [*size, disparity.shape[1], disparity.shape[0], disparities, min_disparity]
    done    = subprocess.run([programs / "draw_map"], capture_output=True, check=False,
                             input=" ".join(map(str, numbers)).encode() + b"\n" + disparity.tobytes())
    assert done.returncode == 0, done.stderr.decode()
    return np.frombuffer(done.stdout, np.uint8).reshape(size[1], size[0])


def shown_picture(path: Path) -> Shown:
    """Return the picture that the litex_sim module video2file has written last."""
    head, comment, width, height, pixels = re.fullmatch(
        rb"(P6)\n# (picture \d+, \d+ clocks, \d+ lines)\n(\d+) (\d+)\n255\n(.*)", path.read_bytes(), re.DOTALL).groups()
    assert head == b"P6"
    number, clocks, lines = map(int, re.findall(rb"\d+", comment))
    return Shown(number, clocks, lines, np.frombuffer(pixels, np.uint8).reshape(int(height), int(width), 3))
