#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""FrameStatistics: sums and histogram of the window of each frame, for any frames, against NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from litestereo.gateware.cameras.frame_statistics import BINS, LEAST_USABLE, MOST_USABLE, FrameStatistics
from litestereo.gateware.cameras.layouts import FRAME_BEGIN, FRAME_END, PIXEL, ROW_END
from litestereo.gateware.cameras.parameters import CameraParameters
from support.dvp import Rows, damaged, drawn_rows
from support.packed_core import PackedCore
from support.pairs import byte_generator

WIDTH, HEIGHT = 14, 7
PARAMETERS    = CameraParameters(max_width=WIDTH, max_height=HEIGHT)
WINDOW        = ("column_begin", "column_end", "row_begin", "row_end")
WHOLE         = (0, WIDTH, 0, HEIGHT)


@pytest.fixture(scope="module")
def core():
    """Return the core in Verilator."""
    module = FrameStatistics(PARAMETERS)
    sink   = module.sink
    inputs = {"valid": sink.valid, "kind": sink.kind, "pixel": sink.pixel, "bin_index": module.bin_index}
    inputs |= {name: getattr(module, name) for name in WINDOW}
    core = PackedCore(module, inputs, {name: getattr(module, name) for name in ("measured", "frames", "sum", "dark",
                                                                                "bright", "bin")})
    yield core
    core.close()


def wanted(rows: Rows, window: tuple[int, int, int, int]) -> dict[str, object]:
    """Return the statistics of a frame by their definition."""
    left, right, top, bottom = window
    pixels = np.array([pixel for row in rows[top:bottom] for pixel in row[left:right]], np.int64)
    return {"sum": pixels.sum(), "dark": (pixels < LEAST_USABLE).sum(), "bright": (pixels > MOST_USABLE).sum(),
            "bins": np.bincount(pixels >> 4, minlength=BINS).tolist()}


def items(rows: Rows, end: bool = True) -> list[tuple[int, int]]:
    """Return the items of a frame, as (kind, pixel)."""
    result = [(FRAME_BEGIN, 0)]
    for row in rows:
        result += [(PIXEL, pixel) for pixel in row] + [(ROW_END, 0)]
    return [*result, (FRAME_END, 0)] if end else result


def play(core: PackedCore, rng, script, gaps: float = 0.3) -> int:
    """Show items, with gaps in which nothing is valid; return how often a frame was measured."""
    measured = 0
    for kind, pixel in script:
        while rng.random() < gaps:
            core.set(valid=0, kind=rng.getrandbits(2), pixel=rng.getrandbits(8))
            measured += core.get()["measured"]
            core.clock()
        core.set(valid=1, kind=kind, pixel=pixel)
        measured += core.get()["measured"]
        core.clock()
    core.set(valid=0)
    for _ in range(3):
        measured += core.get()["measured"]
        core.clock()
    return measured


def results(core: PackedCore) -> dict[str, object]:
    """Return what the core shows."""
    bins = []
    for index in range(BINS):
        core.set(bin_index=index)
        bins.append(core.get()["bin"])
    return {name: core.get()[name] for name in ("sum", "dark", "bright")} | {"bins": bins}


def set_window(core: PackedCore, window: tuple[int, int, int, int]) -> None:
    """Set a window."""
    core.set(**dict(zip(WINDOW, window, strict=True)))


@pytest.mark.parametrize("gaps", [0.0, 0.4])
@pytest.mark.parametrize("window", [WHOLE, (0, 1, 0, 1), (WIDTH - 1, WIDTH, HEIGHT - 1, HEIGHT), (3, 9, 2, 5),
                                    (5, 5, 0, 7), (9, 3, 0, 7), (0, 15, 0, 7)], ids=str)
def test_frames(core, window, gaps):
    """Each frame has its results, from its end to the end of the next one, with all limits of pixels and window."""
    rng = byte_generator(470, window, gaps)
    core.reset()
    set_window(core, window)
    limits = [0, 5, 6, 7, 15, 16, 17, 248, 249, 250, 255, 239, 240, 128]
    for number, rows in enumerate([drawn_rows(WIDTH, HEIGHT, rng), [limits]*HEIGHT, [[255]*WIDTH]*HEIGHT,
                                   drawn_rows(WIDTH, HEIGHT, rng)], 1):
        assert play(core, rng, items(rows), gaps) == 1
        assert results(core) == wanted(rows, window) and core.get()["frames"] == number


@pytest.mark.parametrize("kind", ["short_row", "long_row", "missing_row", "extra_row"])
def test_damaged_frames(core, kind):
    """What has come of a window is counted, and what is beyond the largest frame is not."""
    rng = byte_generator(471, kind)
    core.reset()
    set_window(core, WHOLE)
    for _ in range(4):
        rows = damaged(drawn_rows(WIDTH, HEIGHT, rng), kind, rng)
        rows = [row*(3 if kind == "long_row" else 1) for row in rows]*(4 if kind == "extra_row" else 1)
        assert play(core, rng, items(rows)) == 1
        assert results(core) == wanted(rows, WHOLE)


def test_ends_and_begins(core):
    """The begin of the next frame ends one too; outside of frames nothing counts, and an end is no frame."""
    rng = byte_generator(472)
    core.reset()
    set_window(core, WHOLE)
    first, second = drawn_rows(WIDTH, HEIGHT, rng), drawn_rows(WIDTH, HEIGHT, rng)
    stray = [(PIXEL, 255), (ROW_END, 0), (PIXEL, 3), (FRAME_END, 0)]
    assert play(core, rng, stray) == 0 and results(core) == wanted([], WHOLE)
    assert play(core, rng, [*items(first, end=False), *items(second, end=False)]) == 1
    assert results(core) == wanted(first, WHOLE)
    assert play(core, rng, [(FRAME_END, 0), *stray]) == 1
    assert results(core) == wanted(second, WHOLE) and core.get()["frames"] == 2


def test_a_window_is_taken_over_at_the_begin(core):
    """One that changes in mid-frame is that of the next frame."""
    rng = byte_generator(473)
    core.reset()
    set_window(core, (1, 8, 1, 6))
    rows   = drawn_rows(WIDTH, HEIGHT, rng)
    script = items(rows)
    play(core, rng, script[:20])
    set_window(core, (0, 3, 0, 7))
    play(core, rng, script[20:])
    assert results(core) == wanted(rows, (1, 8, 1, 6))
    play(core, rng, script)
    assert results(core) == wanted(rows, (0, 3, 0, 7))


@pytest.mark.parametrize("place", [1, 9, 40, 100])
def test_reset_in_mid_frame(core, place):
    """A reset forgets results and frame; the rest of that is ignored, and the next one is right."""
    rng = byte_generator(474, place)
    core.reset()
    set_window(core, WHOLE)
    rows   = drawn_rows(WIDTH, HEIGHT, rng)
    script = items(rows)
    play(core, rng, [*script, *script[:place]])
    core.reset()
    assert results(core) == wanted([], WHOLE) and core.get()["frames"] == 0
    assert play(core, rng, script[place:]) == 0
    assert play(core, rng, script) == 1 and results(core) == wanted(rows, WHOLE)
