#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""FrameGuard: whole frames for any sensor, with the flags and counts of what was wrong."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Iterable

import pytest

from litestereo.gateware.cameras.frame_guard import DAMAGES, FrameGuard
from litestereo.gateware.cameras.layouts import FRAME_BEGIN, FRAME_END, PIXEL, ROW_END
from litestereo.gateware.cameras.parameters import CameraParameters
from support.dvp import Rows, damaged, drawn_rows, flags_of, guarded
from support.packed_core import PackedCore
from support.pairs import byte_generator

PARAMETERS = CameraParameters(max_width=20, max_height=9, silence_bits=8)

#: Longest silence in most tests: more than a row, so that a short row is filled meanwhile.
SILENCE = 120

#: An item: its kind, its value, whether items in front of it were lost.
Item = tuple[int, int, int]


def items_of(rows: Rows, implied: bool = False) -> list[Item]:
    """Return the items of a sensor's frame; without the marks that the next one may imply if `implied`."""
    items: list[Item] = [(FRAME_BEGIN, 0, 0)]
    for row in rows:
        items += [(PIXEL, pixel, 0) for pixel in row] + [(ROW_END, 0, 0)]
    return items[:-1] if implied and rows else [*items, (FRAME_END, 0, 0)]


class Reference:
    """What must come out, from what the core has taken: by the definition of a frame."""

    def __init__(self) -> None:
        self.frames: list[tuple[list[int], int]] = [] #: pixels and flags of those that have ended
        self.counts: Counter[str] = Counter()         #: events
        self.forget()

    def forget(self) -> None:
        """Forget the frame, as at a reset."""
        self.size:   tuple[int, int] | None = None    #: of the frame that is under way
        self.rows:   Rows = []                        #: of the sensor, those of its frame
        self.fresh   = True                           #: its next pixel begins a row
        self.open    = False                          #: the sensor's frame has not ended
        self.extra   = {"stuck": 0, "overrun": 0}
        self.pixels: list[int] = []                   #: that have left
        self.quiet   = 0

    def take(self, item: Item, accept: int, size: tuple[int, int]) -> None:
        """Take an item."""
        kind, value, lost = item
        self.counts["overrun"] += lost
        if self.size and lost:
            self.extra["overrun"] += 1
        if kind == FRAME_BEGIN:
            if self.size or not accept:
                self.counts["dropped"] += 1
                self.open = False
                return
            self.forget()
            self.size, self.open = size, True
            self.counts["begun"] += 1
        elif self.open and kind == PIXEL:
            if self.fresh:
                self.rows.append([])
            self.rows[-1].append(value)
            self.fresh = False
        elif self.open and kind == ROW_END:
            if self.fresh:
                self.rows.append([])
            self.fresh = True
        elif kind == FRAME_END:
            self.open = False

    def end(self, flags: int) -> None:
        """End the frame, and check it."""
        assert self.size
        wanted  = guarded(self.rows, *self.size)
        damages = wanted.damages | self.extra
        assert self.pixels == wanted.pixels
        assert flags == flags_of(damages)
        self.counts.update({name: count for name, count in damages.items() if name != "overrun"})
        self.frames.append((self.pixels, flags))
        self.size = None


class Bench:
    """The guard in Verilator, every clock of which is compared with the reference."""

    def __init__(self) -> None:
        module = FrameGuard(PARAMETERS)
        sink, source = module.sink, module.source
        inputs  = {"valid": sink.valid, "kind": sink.kind, "pixel": sink.pixel, "lost": sink.lost,
                   "take": source.ready} | {name: getattr(module, name) for name in
                                            ("width", "height", "silence", "accept")}
        outputs = {"ready": sink.ready, "offered": source.valid, "out": source.pixel, "first": source.first,
                   "last": source.last} | {name: getattr(module, name) for name in
                                           ("begun", "dropped", "ended", "flags", "busy")} | module.events
        self.core = PackedCore(module, inputs, outputs)

    def begin(self, width: int, height: int, silence: int = SILENCE) -> Reference:
        """Reset the core, set a size, and return a new reference."""
        self.core.reset()
        self.core.set(width=width, height=height, silence=silence, accept=1, valid=0)
        self.size, self.silence = (width, height), silence
        self.seen = Counter()
        return Reference()

    def run(self, reference: Reference, items: Iterable[Item | int], rng: random.Random, valid: float = 1.0,
            ready: float = 1.0, accept: float = 1.0, clocks: int = 10**6) -> None:
        """Offer items, wait a number of clocks for each number among them; stop after some clocks."""
        queue   = list(items)
        waiting = 0
        offered = stalled = False
        while clocks and (queue or waiting or reference.size):
            clocks -= 1
            if not waiting and queue and isinstance(queue[0], int):
                waiting = queue.pop(0)
            if not offered and not waiting and queue:
                offered = rng.random() < valid
            waiting -= waiting > 0
            item = queue[0] if offered else (rng.getrandbits(2), rng.getrandbits(8), rng.getrandbits(1))
            # What is offered waits until it is taken; the size matters at a frame's begin only.
            allowed = int(rng.random() < accept)
            size    = self.size if offered and item[0] == FRAME_BEGIN else (rng.randrange(21), rng.randrange(10))
            self.core.set(valid=offered, kind=item[0], pixel=item[1], lost=item[2], take=rng.random() < ready,
                          accept=allowed, width=size[0], height=size[1])
            out     = self.core.get()
            stalled = self.check(reference, out, item if offered else None, allowed, stalled)
            if offered and out["ready"]:
                reference.take(item, allowed, self.size)
                queue.pop(0)
                offered = False
            self.core.clock()

    def check(self, reference: Reference, out: dict[str, int], item: Item | None, accept: int, stalled: bool) -> bool:
        """Check the outputs of a clock; return whether a pixel waits."""
        taken = item is not None and out["ready"]
        moves = out["offered"] and self.core.input("take")
        self.seen.update({name: out[name] for name in (*DAMAGES, "begun", "dropped")})
        assert out["busy"] == (reference.size is not None)
        assert out["begun"] == bool(taken and item[0] == FRAME_BEGIN and accept and not reference.size)
        assert out["offered"] or not stalled
        if out["stuck"]:
            assert reference.quiet == self.silence
            reference.extra["stuck"] += 1
            reference.open = False
        if moves:
            width, height = reference.size
            assert out["first"] == (not reference.pixels)
            assert out["last"] == (len(reference.pixels) == width*height - 1)
            reference.pixels.append(out["out"])
        if out["ended"]:
            # Ended by the sensor, or by the begin of its next frame, which waits.
            assert not reference.open or item[0] == FRAME_BEGIN
            reference.end(out["flags"])
        waits = bool(out["offered"] and not moves)
        if not reference.size or (taken and item[0] != PIXEL):
            reference.quiet = 0
        elif not waits:
            reference.quiet = min(reference.quiet + 1, self.silence)
        return waits

    def finish(self, reference: Reference) -> None:
        """Check that the events were those of the frames."""
        names = (*DAMAGES, "begun", "dropped")
        assert {name: self.seen[name] for name in names} == {name: reference.counts[name] for name in names}


@pytest.fixture(scope="module")
def bench():
    """Return the guard in Verilator."""
    bench = Bench()
    yield bench
    bench.core.close()


SIZES = [(1, 1), (1, 2), (2, 1), (2, 2), (7, 5), (8, 8), (19, 9), (20, 8), (20, 9)]
FLOWS = [(1.0, 1.0), (0.4, 1.0), (1.0, 0.4), (0.5, 0.6)]


@pytest.mark.parametrize("valid, ready", FLOWS)
@pytest.mark.parametrize("implied", [False, True])
def test_whole_frames(bench, valid, ready, implied):
    """Whole frames of all sizes pass as they are, without flags, also without the marks that others imply."""
    rng = byte_generator(410, valid, ready, implied)
    for width, height in SIZES:
        reference = bench.begin(width, height)
        images    = [drawn_rows(width, height, rng) for _ in range(3)]
        bench.run(reference, [item for rows in images for item in items_of(rows, implied)] + [(FRAME_END, 0, 0)],
                  rng, valid, ready)
        bench.finish(reference)
        assert reference.frames == [([pixel for row in rows for pixel in row], 0) for rows in images]


@pytest.mark.parametrize("valid, ready", FLOWS)
@pytest.mark.parametrize("kind", [name for name in DAMAGES if name.endswith("row")])
def test_damaged_frames(bench, kind, valid, ready):
    """A damaged frame is filled or cut, has its flag and no other, and the one after it is whole."""
    rng = byte_generator(411, kind, valid, ready)
    for width, height in [(2, 2), (7, 5), (20, 9)]:
        reference = bench.begin(width, height)
        for _ in range(4):
            for rows in (damaged(drawn_rows(width, height, rng), kind, rng), drawn_rows(width, height, rng)):
                # The rest of a frame is filled before the next one begins.
                bench.run(reference, items_of(rows, rng.random() < 0.3) + [(FRAME_END, 0, 0)], rng, valid, ready)
        bench.finish(reference)
        flags = 1 << DAMAGES.index(kind)
        assert [one for _, one in reference.frames] == [flags, 0]*4


@pytest.mark.parametrize("seed", range(6))
def test_any_items(bench, seed):
    """Any items in any order, with gaps and losses, give whole frames, and each damage is told."""
    rng       = byte_generator(412, seed)
    reference = bench.begin(rng.choice((1, 2, 6)), rng.choice((1, 2, 4)))
    kinds     = [PIXEL]*rng.choice((4, 12)) + [ROW_END]*2 + [FRAME_BEGIN] + [FRAME_END]
    items     = [(rng.choice(kinds), rng.getrandbits(8), int(rng.random() < 0.05)) for _ in range(2500)]
    bench.run(reference, items, rng, valid=rng.choice((0.5, 1.0)), ready=rng.choice((0.5, 1.0)), accept=0.8)
    bench.finish(reference)
    assert len(reference.frames) > 40
    assert all(reference.counts[name] for name in ("short_row", "long_row", "missing_row", "overrun", "dropped"))


@pytest.mark.parametrize("ready", [1.0, 0.3])
def test_a_sensor_that_falls_silent(bench, ready):
    """At any place of a frame: it is filled and flagged, what comes late is ignored, and the next one is whole."""
    rng = byte_generator(413, ready)
    for place in range(1, len(items_of(drawn_rows(3, 3, rng)))):
        reference = bench.begin(3, 3, rng.choice((20, 120, 255)))
        rows      = drawn_rows(3, 3, rng)
        items     = items_of(rows)
        bench.run(reference, [*items[:place], 900, *items[place:], *items_of(rows)], rng, ready=ready)
        bench.finish(reference)
        flags = [flags for _, flags in reference.frames]
        assert len(flags) == 2 and flags[0] >> DAMAGES.index("stuck") & 1 and flags[1] == 0


@pytest.mark.parametrize("kind", [PIXEL, None])
def test_silence_is_counted_exactly(bench, kind):
    """A mark that comes in the last clock is in time, also if pixels come all the while."""
    rng = byte_generator(414)
    for silence in (3, 4, 127, 128, 255):
        for late in (0, 1):
            reference = bench.begin(1, 2, silence)
            # The item in front of the wait, and the mark itself, have a clock each.
            wait = silence - 2 + late
            filler = [(PIXEL, 9, 0)]*wait if kind == PIXEL else [wait]
            bench.run(reference, [(FRAME_BEGIN, 0, 0), (PIXEL, 1, 0), *filler, (ROW_END, 0, 0), (PIXEL, 2, 0),
                                  (ROW_END, 0, 0), (FRAME_END, 0, 0)], rng)
            bench.finish(reference)
            assert bench.seen["stuck"] == late, (silence, late)


def test_a_slow_successor_makes_no_frame_stuck(bench):
    """Clocks in which a pixel waits are not silence."""
    rng       = byte_generator(415)
    reference = bench.begin(8, 8, 12)
    rows      = drawn_rows(8, 8, rng)
    bench.run(reference, items_of(rows), rng, ready=0.02)
    bench.finish(reference)
    assert reference.frames == [([pixel for row in rows for pixel in row], 0)]


def test_frames_that_are_not_accepted(bench):
    """A frame is dropped whole, and none is begun in its middle."""
    rng       = byte_generator(416)
    reference = bench.begin(5, 4)
    for _ in range(60):
        bench.run(reference, items_of(drawn_rows(5, 4, rng)), rng, 0.8, 0.8, accept=0.5)
    bench.finish(reference)
    assert reference.counts["begun"] + reference.counts["dropped"] == 60
    assert 10 < reference.counts["dropped"] < 50 and all(flags == 0 for _, flags in reference.frames)


@pytest.mark.parametrize("clocks", [1, 2, 3, 6, 7, 8, 13, 21, 30])
def test_reset_in_mid_frame(bench, clocks):
    """A reset forgets the frame; the rest of the sensor's is ignored, and the next one is whole."""
    rng       = byte_generator(417, clocks)
    reference = bench.begin(4, 5)
    rows      = drawn_rows(4, 5, rng)
    bench.run(reference, items_of(damaged(rows, "short_row", rng)), rng, 0.8, 0.8, clocks=clocks)
    reference = bench.begin(4, 5)
    bench.run(reference, items_of(rows)[3:] + items_of(rows), rng, 0.8, 0.8)
    bench.finish(reference)
    assert reference.frames == [([pixel for row in rows for pixel in row], 0)]


@pytest.mark.parametrize("parameters, message", [
    ({"max_width": 1},     "max_width"),
    ({"max_width": 4097},  "max_width"),
    ({"max_height": 1},    "max_height"),
    ({"max_height": 4096}, "max_height"),
    ({"silence_bits": 0},  "silence_bits"),
    ({"silence_bits": 33}, "silence_bits"),
    ({"skew_pixels": 8},       "skew_pixels"),
    ({"skew_pixels": 2**17},   "skew_pixels"),
    ({"skew_pixels": 1000},    "skew_pixels"),
])
def test_bad_parameters(parameters, message):
    """Bad parameters are refused by name, and those at the limits are not."""
    with pytest.raises(ValueError, match=message):
        CameraParameters(**parameters)
    CameraParameters(2, 2, 1, 16)
    CameraParameters(4096, 4095, 32, 2**16)
