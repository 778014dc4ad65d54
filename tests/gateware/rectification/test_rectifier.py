#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The assembled rectifier's emitted Verilog against the model and cv2.remap, on every pixel of both images."""

from __future__ import annotations

import numpy as np
import pytest

from litestereo.gateware.rectification.parameters import RectifierParameters
from litestereo.sim.models import rectification as model
from support.limits import BLOCK, Draws, Range
from support.pairs import generator
from support.rectification_maps import as_grid, check_pair, drawn_grids, drawn_pair, lens, maps_of, noise, shifted
from support.rectifier_bench import Flow, RectifierBench, images_of, pixel_words

BUILT = RectifierParameters(max_width=64, max_height=48, rows=24)

FLOWS = [Flow(), Flow(0.4, 1.0), Flow(1.0, 0.4), Flow(0.6, 0.6)]

#: Clocks of a frame on top of those of its pixels: settings, first nodes, pipeline.
FIXED_CLOCKS = 60


@pytest.fixture(scope="module")
def bench():
    """Return the small rectifier in Verilator."""
    return RectifierBench(BUILT)


def rectified(bench, raw, grids, lead, flow=FLOWS[0], number=0):
    """Rectify a frame, compare it with the model and OpenCV; return its clocks and whether rows were gone."""
    height, width = raw[0].shape
    maps = maps_of(grids, width, height)
    assert bench.load(number, grids) == 0
    bench.set(width, height, lead, number)
    result = bench.run([raw], width*height + 1, flow)
    assert len(result.words) == width*height and result.accepted == width*height
    assert result.first.nonzero()[0].tolist() == [0] and result.last.nonzero()[0].tolist() == [width*height - 1]
    assert not bench.core.get("busy")
    gone = bench.core.get("row_gone")
    if not gone:
        check_pair(images_of(result.words, width, height)[0], raw, maps)
    folds = [model.folded(grid, width, height).any() for grid in grids]
    assert bench.core.get("folded") == any(folds)
    return result.clocks, bool(gone)


@pytest.mark.parametrize("flow", FLOWS, ids=str)
def test_drawn_maps(bench, flow):
    """Drawn maps, all sizes, gaps and back-pressure: with enough rows none is gone, and the time is bounded."""
    rng    = generator(310)
    draws  = Draws(rng, {"width": Range(2, BUILT.max_width), "height": Range(2, BUILT.max_height),
                         "lead": Range(0, BUILT.rows - 1)}, {"lead": range(5)})
    enough = 0
    for number in range(2*BLOCK):
        width, height, lead = draws("width"), draws("height"), draws("lead")
        grids = drawn_grids(width, height, rng)
        maps  = maps_of(grids, width, height)
        clocks, gone = rectified(bench, drawn_pair(width, height, rng), grids, lead, flow, number % 2)
        if model.rows_needed(maps, lead) > BUILT.rows:
            continue
        enough += 1
        assert not gone, (number, width, height)
        if flow == FLOWS[0] and width >= 24 and lead >= max(model.delay_rows(maps), 2):
            assert clocks <= 1.03*width*(height + lead) + FIXED_CLOCKS
    draws.check()
    assert enough >= BLOCK


def test_extreme_maps(bench):
    """The identity, whole and half pixels, positions outside on every side, and a mirror are exact."""
    rng   = generator(311)
    raw   = drawn_pair(50, 30, rng)
    level = shifted(50, 30, 0, 0)
    ends  = [(1, 0), (0, 1), (-1, -1), (0.5, 0.5), (-0.5, -0.5), (-50, 0), (-51, 0), (49, 0), (50, 0), (255.9, 0),
             (-256, 0), (0, -30), (0, -31), (0, 29), (0, 30), (0, -256), (0, 255.9), (1/64, -1/64), (31/32, 31/32)]
    for columns, rows in ends:
        right   = level if rows <= 0 else shifted(50, 30, 0, rows)
        _, gone = rectified(bench, raw, (shifted(50, 30, columns, rows), right), 2)
        # There the last row of the left image needs the first raw one, that of the right image the last one.
        assert gone == (rows == -30)
    mirror = as_grid(49 - 2*model.STEP*np.arange(5)[None] + np.zeros((3, 1)), np.zeros((3, 5)))
    _, gone = rectified(bench, raw, (mirror, mirror), 2)
    assert not gone and bench.core.get("folded")


def test_all_fractions(bench):
    """Each of the 1024 pairs of fractions occurs in a frame, and is exact."""
    # Both displacements grow by a 32nd of a pixel per pixel.
    x, y  = np.meshgrid(np.arange(5), np.arange(4))
    grid  = as_grid(x/2, y/2)
    u, v  = model.expand(grid, 64, 48)
    assert len({*zip((u & 31).ravel().tolist(), (v & 31).ravel().tolist(), strict=True)}) == 1024
    _, gone = rectified(bench, drawn_pair(64, 48, generator(312)), (grid, grid), 1)
    assert not gone


@pytest.mark.parametrize("flow", FLOWS, ids=str)
def test_frames_back_to_back(bench, flow):
    """Rows of the next frame come in while positions of the one before leave; the grid changes between frames alone."""
    rng   = generator(313)
    width, height = 60, 40
    grids = [(lens(width, height, rng, 1), lens(width, height, rng, 1)) for _ in range(2)]
    maps  = [maps_of(pair, width, height) for pair in grids]
    lead  = max(model.steady_lead(both) for both in maps)
    assert max(model.rows_needed(both, lead) for both in maps) <= BUILT.rows
    raws  = [drawn_pair(width, height, rng) for _ in range(6)]
    for number, pair in enumerate(grids):
        bench.load(number, pair)
    bench.set(width, height, lead, 0)
    result = bench.run(raws, 6*width*height + 1, flow)
    assert len(result.words) == 6*width*height and not bench.core.get("row_gone")
    for got, raw in zip(images_of(result.words, width, height), raws, strict=True):
        check_pair(got, raw, maps[0])
    assert result.last.nonzero()[0].tolist() == [(n + 1)*width*height - 1 for n in range(6)]
    if flow == FLOWS[0]:
        # All frames but the first take 1.05 clocks per pixel at most.
        assert result.clocks <= 1.03*width*(height + lead) + FIXED_CLOCKS + 5*1.05*width*height
    # The setting changes in the middle of frames: each frame has one grid, that of its begin.
    done, sent, words = 0, 0, []
    for part in range(1, 13):
        bench.set(width, height, lead, part//2 % 2)
        result = bench.run(raws, part*width*height//2 - done, flow, skipped=sent)
        done, sent = done + len(result.words), sent + result.accepted
        words.append(result.words)
    assert done == 6*width*height
    used = set()
    for got, raw in zip(images_of(np.concatenate(words), width, height), raws, strict=True):
        number = int(np.array_equal(got[0], model.remap(raw[0], maps[1][0])))
        check_pair(got, raw, maps[number])
        used.add(number)
    assert used == {0, 1}


def test_another_size_waits(bench):
    """A frame of another size that follows at once begins when the one before has left."""
    rng   = generator(314)
    sizes = [(40, 12), (31, 20), (64, 9)]
    raws  = [drawn_pair(*size, rng) for size in sizes]
    grids = [(lens(*size, rng), noise(*size, rng)) for size in sizes]
    bench.load(0, grids[0])
    bench.set(*sizes[0], 4)
    for number, (width, height) in enumerate(sizes):
        # Half of the frame is out when the settings become those of the next one.
        half  = width*height//2
        begun = bench.run([raws[number]], half, Flow(0.7, 0.7))
        words, then = [begun.words], raws[number:number + 2]
        if number < 2:
            bench.load((number + 1) % 2, grids[number + 1])
            bench.set(*sizes[number + 1], 4, (number + 1) % 2)
        # The next frame is offered, and not accepted before this one has left.
        rest = bench.run(then, width*height - half, Flow(0.7, 0.7), skipped=begun.accepted)
        words.append(rest.words)
        assert begun.accepted + rest.accepted <= width*height
        check_pair(images_of(np.concatenate(words), width, height)[0], raws[number],
                   maps_of(grids[number], width, height))
        bench.run(then[:1], 1, skipped=begun.accepted + rest.accepted)
        bench.idle(8)
        assert not bench.core.get("busy")


def test_reset_in_mid_frame(bench):
    """After a reset at any clock the next frame is exact."""
    rng = generator(315)
    width, height = 45, 20
    for _ in range(8):
        grids = drawn_grids(width, height, rng)
        bench.load(0, grids)
        bench.set(width, height, 3)
        bench.run([drawn_pair(width, height, rng)]*3, 3*width*height, Flow(0.8, 0.8),
                  reset_clock=int(rng.integers(2, 3*width*height)))
        bench.core.reset()
        assert not bench.core.get("busy")
        rectified(bench, drawn_pair(width, height, rng), grids, 3)


def test_too_few_rows(bench):
    """A ring that is two rows too small is flagged, for that frame alone; the frame is completed, black where gone."""
    rng   = generator(316)
    width, height = 64, 48
    level = shifted(width, height, 0, 0)
    for lead in (1, 4):
        # The right camera needs a row so far below that of the left one that the ring just holds both.
        apart = BUILT.rows - lead - 3
        for below in (apart, apart + 2, apart):
            grids = (level, shifted(width, height, 0, below))
            maps  = maps_of(grids, width, height)
            small = model.rows_needed(maps, lead) == BUILT.rows + 2
            assert small == (below != apart)
            raw   = drawn_pair(width, height, rng)
            # While the source of the frame waits, rows come in as far as they may.
            assert rectified(bench, raw, grids, lead, Flow(1.0, 0.3))[1] == small
            result = bench.run([raw], width*height + 1, Flow(1.0, 0.3))
            wrong  = [image[image != model.remap(raw_image, positions)] for image, raw_image, positions
                      in zip(images_of(result.words, width, height)[0], raw, maps, strict=True)]
            assert (len(wrong[0]) > 0) == small and len(wrong[1]) == 0 and not wrong[0].any()


def test_bypass(bench):
    """Raw pairs leave in the clock in which they come in, with their marks; a change waits until no frame is inside."""
    rng   = generator(317)
    width, height = 33, 10
    grids = (lens(width, height, rng), lens(width, height, rng))
    raw   = drawn_pair(width, height, rng)
    words = pixel_words(raw)
    marks = rng.random((2, len(words))) < 0.5
    for flow in FLOWS:
        bench.set(width, height, 3, bypass=1)
        bench.idle(8)
        result = bench.core.run(words, len(words), first=marks[0], last=marks[1], valid=flow.valid, ready=flow.ready)
        assert np.array_equal(result.words.ravel(), words)
        assert np.array_equal(result.first, marks[0]) and np.array_equal(result.last, marks[1])
        if flow == FLOWS[0]:
            assert result.clocks == len(words)
        assert rectified(bench, raw, grids, 3, flow)[1] is False
        # The setting changes in mid-frame.
        begun = bench.core.run(words[:100], 50, valid=flow.valid, ready=flow.ready)
        bench.set(width, height, 3, bypass=1)
        rest  = bench.core.run(np.concatenate([words[begun.accepted:], words]), 2*len(words) - 50, valid=flow.valid,
                               ready=flow.ready)
        both  = images_of(np.concatenate([begun.words, rest.words]), width, height)
        check_pair(both[0], raw, maps_of(grids, width, height))
        assert np.array_equal(both[1], raw)


def test_nodes_of_the_grid_in_use(bench):
    """They are refused from a frame's begin to its last position; those of the other grid are accepted."""
    rng   = generator(318)
    width, height = 40, 30
    first, second = ([noise(width, height, rng), noise(width, height, rng)] for _ in range(2))
    raw   = drawn_pair(width, height, rng)
    bench.load(0, first)
    bench.set(width, height, 3)
    begun = bench.run([raw], 200)
    assert bench.load(0, second) == 2*first[0].size//2 and bench.load(1, second) == 0
    rest  = bench.run([raw], width*height - 200, skipped=begun.accepted)
    check_pair(images_of(np.concatenate([begun.words, rest.words]), width, height)[0], raw,
               maps_of(first, width, height))
    rectified(bench, raw, second, 3, number=1)
