#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Image sensors with a parallel port: their signals clock by clock, and what a capture has to make of them."""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from litestereo.gateware.cameras.frame_guard import DAMAGES

Rows = list[list[int]]


@dataclass(frozen=True)
class Format:
    """How a sensor uses its signals: see `DVPFormat`."""
    two_bytes:   int = 0
    grey_second: int = 0
    href_low:    int = 0
    vsync_low:   int = 0

    def pins(self) -> dict[str, int]:
        """Return the values of the format's Signals."""
        return dict(vars(self))


#: All formats.
FORMATS = [Format(*(number >> bit & 1 for bit in range(4))) for number in range(16)]


@dataclass(frozen=True)
class Clock:
    """What a sensor shows in a clock, without polarity."""
    frame: bool = False
    row:   bool = False
    data:  int  = 0

    def pins(self, form: Format) -> dict[str, int]:
        """Return the signals."""
        return {"data": self.data, "href": int(self.row) ^ form.href_low, "vsync": int(self.frame) ^ form.vsync_low}


@dataclass
class Sensor:
    """Frames as clocks of a sensor.

    Parameters
    ----------
    form
        How it uses its signals.
    rng
        Draws the bytes that are not grey values, and the blankings.
    blanking
        Least and most clocks of a blanking between rows.
    between
        Least and most clocks between frames.
    """
    form:     Format
    rng:      random.Random
    blanking: tuple[int, int] = (1, 9)
    between:  tuple[int, int] = (2, 20)

    def idle(self, clocks: int, frame: bool = False) -> Iterator[Clock]:
        """Yield clocks of a blanking."""
        for _ in range(clocks):
            yield Clock(frame, False, self.rng.getrandbits(8))

    def row(self, pixels: Sequence[int]) -> Iterator[Clock]:
        """Yield the clocks of a row."""
        for pixel in pixels:
            if self.form.two_bytes and self.form.grey_second:
                yield Clock(True, True, self.rng.getrandbits(8))
            yield Clock(True, True, pixel)
            if self.form.two_bytes and not self.form.grey_second:
                yield Clock(True, True, self.rng.getrandbits(8))

    def frame(self, rows: Rows) -> Iterator[Clock]:
        """Yield the clocks of a frame, and those in front of it."""
        yield from self.idle(self.rng.randint(*self.between))
        for row in rows:
            yield from self.idle(self.rng.randint(*self.blanking), True)
            yield from self.row(row)
        yield from self.idle(self.rng.randint(0, self.blanking[1]), True)


def drawn_rows(width: int, height: int, rng: random.Random) -> Rows:
    """Return an image of noise with its limits, as rows."""
    return [[rng.choice((0, 255, rng.randrange(256))) for _ in range(width)] for _ in range(height)]


def damaged(rows: Rows, kind: str, rng: random.Random) -> Rows:
    """Return an image with a damage of the sensor's, by its name of `DAMAGES`; the number of damages is drawn."""
    width, height = len(rows[0]), len(rows)
    result = [list(row) for row in rows]
    if kind == "missing_row":
        return result[:rng.choice((1, height//2 or 1, height - 1))]
    if kind == "extra_row":
        return result + drawn_rows(rng.choice((1, width, width + 1)), rng.choice((1, 2, height)), rng)
    for number in rng.sample(range(height), rng.choice((1, height))):
        row = result[number]
        if kind == "short_row":
            del row[rng.choice((1, width//2 or 1, width - 1)):]
        elif kind == "long_row":
            row += drawn_rows(rng.choice((1, 2, width)), 1, rng)[0]
    return result


@dataclass
class Guarded:
    """A frame as `FrameGuard` has to give it, and the counts of its damages."""
    pixels:  list[int]
    damages: dict[str, int] = field(default_factory=dict)


def guarded(rows: Rows, width: int, height: int) -> Guarded:
    """Return what a frame of the sensor's has to become: rows cut and filled, damages counted.

    Parameters
    ----------
    rows
        What the sensor has sent until its frame ended, row by row.
    width, height
        Size of the frame.
    """
    first  = rows[:height]
    filled = [[*row[:width], *[0]*(width - len(row))] for row in first] + [[0]*width]*(height - len(first))
    return Guarded([pixel for row in filled for pixel in row], dict.fromkeys(DAMAGES, 0) | {
        "short_row":   sum(len(row) < width for row in first),
        "long_row":    sum(len(row) > width for row in first),
        "missing_row": height - len(first),
        "extra_row":   len(rows) - len(first),
    })


def flags_of(damages: dict[str, int]) -> int:
    """Return the flags of a frame with these damages."""
    return sum(1 << bit for bit, name in enumerate(DAMAGES) if damages[name])


def noise_rows(width: int, height: int, shift: int) -> NDArray[np.uint8]:
    """Return the image of `TestPattern`: uint8, height x width.

    A row is a sequence of bits, each the sum of those 16, 14, 13 and 11 in front of it. It begins with the sixteen of
    the row's seed, from the highest down; a pixel is the newest eight after each eight bits.
    """
    image = np.zeros((height, width), np.uint8)
    for y in range(height):
        bits = [(0xa000 | y) >> bit & 1 for bit in range(15, -1, -1)]
        while len(bits) < 16 + 8*(width + shift):
            bits.append(bits[-16] ^ bits[-14] ^ bits[-13] ^ bits[-11])
        pixels   = np.packbits(np.array(bits[8:], np.uint8))
        image[y] = pixels[shift:shift + width]
    return image
