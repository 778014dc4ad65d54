#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""PairJoin: pairs of frames, whole and of one number, or none of them, for any two sensors and any successor."""

from __future__ import annotations

from collections import Counter

import pytest
from litex.gen import LiteXModule
from migen import Signal

from litestereo.gateware.cameras.frame_guard import DAMAGES, FrameGuard
from litestereo.gateware.cameras.layouts import SIDES, pair_layout
from litestereo.gateware.cameras.pair_join import PairJoin
from litestereo.gateware.cameras.pair_matcher import PairMatcher
from litestereo.gateware.cameras.parameters import CameraParameters
from support.dvp import Rows, damaged, drawn_rows, flags_of, guarded
from support.packed_core import PackedCore
from support.pairs import byte_generator
from support.sensor_pair import Follower, SensorSide, Shown

PARAMETERS    = CameraParameters(max_width=20, max_height=8, silence_bits=10, skew_pixels=64)
WIDTH, HEIGHT = 16, 6
SILENCE       = 200

#: Clocks of a row and of a frame as `Shown` has them by default.
ROW    = 6 + 2*WIDTH + 1
FRAME  = 1 + HEIGHT*ROW + 7
PERIOD = FRAME + 120

EVENTS = ("begins", "refused", "finished", "given_up", "paired")


class Top(LiteXModule):
    """Guards, the matcher of pairs, and the join."""
    def __init__(self) -> None:
        self.guards     = [FrameGuard(PARAMETERS) for _ in SIDES]
        self.submodules += self.guards
        self.pairs      = pairs = PairMatcher()
        self.join       = join  = PairJoin(PARAMETERS)
        self.now        = now   = Signal(64)
        self.join_reset = Signal()
        self.comb += [
            join.reset.eq(self.join_reset),
            pairs.free_running.eq(1),
            pairs.now.eq(now),
            join.connect_matcher(pairs),
        ]
        for number, guard in enumerate(self.guards):
            self.comb += [
                guard.source.connect(join.sinks[number]),
                guard.width.eq(join.frame_width),
                guard.height.eq(join.frame_height),
                guard.silence.eq(join.silence),
                guard.accept.eq(join.accept[number]),
                join.starts[number].eq(pairs.starts[number]),
                join.begun[number].eq(guard.begun),
                join.dropped[number].eq(guard.dropped),
                join.ended[number].eq(guard.ended),
                join.damages[number].eq(guard.flags),
            ]


class Pair:
    """A pair that has begun."""

    def __init__(self, info: dict[str, int], size: tuple[int, int]) -> None:
        self.info   = info
        self.size   = size
        self.pixels: tuple[list[int], list[int]] = ([], [])
        self.flags: int | None = None
        self.given_up = False


class Bench:
    """The cores in Verilator; every clock is checked for what always holds."""

    def __init__(self, rng) -> None:
        top    = Top()
        join   = top.join
        inputs = {name: getattr(join, name) for name in ("width", "height", "silence", "open")}
        inputs |= {"take": join.source.ready, "now": top.now, "join_reset": top.join_reset}
        inputs |= {name: getattr(top.pairs, name) for name in ("window", "flag_limit", "drop_limit")}
        outputs = {"valid": join.source.valid, "left": join.source.left, "right": join.source.right,
                   "first": join.source.first, "last": join.source.last, "flags": join.flags,
                   "pair_dropped": top.pairs.dropped, "frame_width": join.frame_width,
                   "frame_height": join.frame_height}
        outputs |= {name: getattr(join, name) for name in EVENTS}
        outputs |= {f"info_{name}": getattr(join.info, name) for name, _ in pair_layout()}
        for side, guard, starts in zip(SIDES, top.guards, top.pairs.starts, strict=True):
            inputs |= {f"{side}_{name}": getattr(guard.sink, name) for name in ("valid", "kind", "pixel", "lost")}
            inputs |= {f"{side}_starts": starts}
            outputs |= {f"{side}_ready": guard.sink.ready, f"{side}_out": guard.source.pixel,
                        f"{side}_dropped": guard.dropped}
            outputs |= {f"{side}_{name}": getattr(guard, name) for name in ("begun", "moves", "flags", "ended")}
        self.core = PackedCore(top, inputs, outputs)
        self.rng  = rng
        self.now  = 0

    def restart(self, window: int = PERIOD//2, flag: int = 8, drop: int = 3*ROW) -> None:
        """Reset all, and set the limits."""
        self.core.set(width=WIDTH, height=HEIGHT, silence=SILENCE, open=0, take=0, window=window, flag_limit=flag,
                      drop_limit=drop, join_reset=0, left_valid=0, right_valid=0, left_starts=0, right_starts=0)
        self.core.reset()
        self.forget()
        self.core.clock()

    def forget(self) -> None:
        """Begin to record anew."""
        self.seen: Counter[str] = Counter()
        self.pairs: list[Pair]  = []
        self.under_way: Pair | None = None
        self.guarded: list[dict[int, list[int]]] = [{}, {}] #: what guards gave, by the clock of the start
        self.newest = [-1, -1]
        self.current: list[list[int]] = [[], []]
        self.stalled = None
        self.info_due = False
        self.refusals: list[int] = [] #: clocks

    def run(self, sides: list[SensorSide], follower: Follower, clocks: int = 10**6, rest: int = 3*SILENCE) -> None:
        """Run until both sensors are done, and some clocks more, or for some clocks."""
        while clocks and rest:
            clocks -= 1
            rest   -= all(side.idle for side in sides)
            self.clock(sides, follower)

    def clock(self, sides: list[SensorSide], follower: Follower) -> None:
        """Run for a clock."""
        core   = self.core
        items  = []
        inputs = {}
        for name, side in zip(SIDES, sides, strict=True):
            starts = side.step(self.now)
            item   = side.offer(self.now)
            items.append(item)
            kind, pixel, lost = item or (self.rng.getrandbits(2), self.rng.getrandbits(8), 0)
            inputs |= {f"{name}_valid": item is not None, f"{name}_kind": kind, f"{name}_pixel": pixel,
                       f"{name}_lost": lost, f"{name}_starts": starts}
            if starts:
                self.newest[SIDES.index(name)] = self.now
        take = self.rng.random() < follower.ready
        core.set(open=follower.open, take=take, now=self.now, **inputs)
        out = core.get()
        self.check(out, take, follower)
        for number, (name, side) in enumerate(zip(SIDES, sides, strict=True)):
            if out[f"{name}_begun"]:
                self.current[number] = self.guarded[number][self.newest[number]] = []
            if out[f"{name}_moves"]:
                self.current[number].append(out[f"{name}_out"])
            if items[number] is not None and out[f"{name}_ready"]:
                side.take()
        follower.step()
        core.clock()
        self.now += 1

    def check(self, out: dict[str, int], take: bool, follower: Follower) -> None:
        """Check what always holds."""
        self.seen.update({name: out[name] for name in EVENTS})
        self.seen.update({f"{name}_dropped": out[f"{name}_dropped"] for name in SIDES} | {"apart": out["pair_dropped"]})
        self.refusals += [self.now]*out["refused"]
        if self.info_due:
            self.under_way.info |= {name: out[f"info_{name}"] for name, _ in pair_layout()}
            self.info_due = False
        if out["begins"]:
            assert self.under_way is None and follower.open
            self.under_way = Pair({}, (out["frame_width"], out["frame_height"]))
            self.pairs.append(self.under_way)
            self.info_due = True
        pair = self.under_way
        if self.stalled is not None and follower.open:
            assert out["valid"] and {name: out[name] for name in self.stalled} == self.stalled
        self.stalled = None
        if out["valid"]:
            total = pair.size[0]*pair.size[1]
            assert len(pair.pixels[0]) < total
            assert out["first"] == (not pair.pixels[0]) and out["last"] == (len(pair.pixels[0]) == total - 1)
            if take:
                pair.pixels[0].append(out["left"])
                pair.pixels[1].append(out["right"])
                if out["last"]:
                    follower.close()
            else:
                self.stalled = {name: out[name] for name in ("left", "right", "first", "last")}
        if out["finished"] or out["given_up"]:
            self.under_way.given_up = bool(out["given_up"])
            if out["finished"]:
                assert len(pair.pixels[0]) == pair.size[0]*pair.size[1]
                pair.flags = out["left_flags"] | out["right_flags"] << len(DAMAGES)
                self.flags_due = pair.flags
            self.under_way = None
            self.stalled   = None

    def finish(self, sides: list[SensorSide]) -> list[Pair]:
        """Check all pairs against what the guards gave and what the sensors showed; return those that have ended."""
        seen = self.seen
        assert self.under_way is None
        assert seen["paired"] == seen["begins"] + seen["refused"]
        assert seen["begins"] == seen["finished"] + seen["given_up"]
        for pair in self.pairs:
            stamps = [pair.info[f"{name}_stamp"] for name in SIDES]
            assert pair.info["skew"] == (stamps[1] - stamps[0]) % 2**32
            for number, (stamp, side) in enumerate(zip(stamps, sides, strict=True)):
                pixels = pair.pixels[number]
                assert pixels == self.guarded[number][stamp][:len(pixels)]
                assert pair.given_up or len(pixels) == len(self.guarded[number][stamp])
                flags = None if pair.flags is None else pair.flags >> number*len(DAMAGES) & 2**len(DAMAGES) - 1
                if flags == 0:
                    assert pixels == [pixel for row in side.starts[stamp].rows for pixel in row]
        ended = [pair for pair in self.pairs if not pair.given_up]
        if ended:
            assert self.core.get()["flags"] == ended[-1].flags
        return ended


@pytest.fixture(scope="module")
def bench():
    """Return the cores in Verilator."""
    bench = Bench(byte_generator(460))
    yield bench
    bench.core.close()


def frames(rng, count: int, **options) -> list[Shown]:
    """Return frames of noise."""
    return [Shown(drawn_rows(WIDTH, HEIGHT, rng), **({"period": PERIOD} | options)) for _ in range(count)]


def skewed(bench: Bench, skew: int, left, right) -> list[SensorSide]:
    """Return sensors, the right one late by `skew` clocks."""
    return [SensorSide(left, 20 + max(-skew, 0)), SensorSide(right, 20 + max(skew, 0))]


def play(bench: Bench, sides: list[SensorSide], follower: Follower | None = None, **options) -> list[Pair]:
    """Run frames, and return the pairs that have ended."""
    bench.forget()
    bench.run(sides, follower or Follower(bench.rng), **options)
    return bench.finish(sides)


#: Pixels of three rows are in the queue of a sensor that is ahead by them, of 64.
SKEWS = [0, 1, -1, 2, 5, -6, 7, 8, -9, ROW, -ROW, ROW + 3, 2*ROW, -2*ROW - 5, 3*ROW, -3*ROW]


@pytest.mark.parametrize("ready", [1.0, 0.7])
@pytest.mark.parametrize("skew", SKEWS)
def test_pairs(bench, skew, ready):
    """All frames come out as pairs, whole, with number, stamps, skew and flag, up to three rows apart."""
    bench.restart()
    sides = skewed(bench, skew, frames(bench.rng, 5), frames(bench.rng, 5))
    pairs = play(bench, sides, Follower(bench.rng, ready))
    assert [pair.info["number"] for pair in pairs] == [1, 2, 3, 4, 5]
    assert [pair.flags for pair in pairs] == [0]*5
    assert {pair.info["skew"] for pair in pairs} == {skew % 2**32}
    assert {pair.info["flagged"] for pair in pairs} == {int(abs(skew) > 8)}
    assert bench.seen["refused"] == 0


def test_a_skew_that_is_too_large(bench):
    """Such pairs do not begin, with either sensor ahead; the next ones that are near do."""
    for skew in (3*ROW + 1, -3*ROW - 1):
        bench.restart()
        far   = frames(bench.rng, 3)
        near  = frames(bench.rng, 2)
        late  = abs(skew)
        sides = skewed(bench, skew, [*far, *([late] if skew > 0 else []), *near],
                       [*frames(bench.rng, 3), *([late] if skew < 0 else []), *frames(bench.rng, 2)])
        pairs = play(bench, sides)
        assert [pair.info["number"] for pair in pairs] == [4, 5] and bench.seen["apart"] == 3
        assert [pair.info["skew"] for pair in pairs] == [0, 0]


@pytest.mark.parametrize("side", [0, 1])
def test_frames_that_are_alone(bench, side):
    """They are dropped whole; pairs before and after come."""
    bench.restart()
    both  = [frames(bench.rng, 5), frames(bench.rng, 5)]
    both[side][1:3] = [2*PERIOD]
    sides = skewed(bench, 3, *both)
    pairs = play(bench, sides)
    assert [pair.info["number"] for pair in pairs] == [1, 4, 5] and [pair.flags for pair in pairs] == [0]*3


@pytest.mark.parametrize("skew", [0, 4, -ROW])
def test_what_follows_does_not_take(bench, skew):
    """A pair at whose start it is closed is refused, both frames of it; the next one is whole. One at a time."""
    bench.restart()
    sides    = skewed(bench, skew, frames(bench.rng, 6), frames(bench.rng, 6))
    follower = Follower(bench.rng, pause=(PERIOD, PERIOD + 40))
    pairs    = play(bench, sides, follower)
    assert [pair.info["number"] for pair in pairs] == [1, 3, 5] and [pair.flags for pair in pairs] == [0]*3
    assert bench.seen["refused"] == 3


def test_it_opens_between_two_starts(bench):
    """A pair whose earlier frame was refused is refused, and so is one whose later frame would be."""
    for opens in (True, False):
        bench.restart()
        sides    = skewed(bench, ROW, frames(bench.rng, 2), frames(bench.rng, 2))
        follower = Follower(bench.rng, pause=(20 + ROW//2, 20 + ROW//2))
        if opens:
            follower.close()
        bench.forget()
        bench.run(sides, follower, 20 + ROW//2 + 1)
        if not opens:
            follower.close()
        bench.run(sides, follower)
        pairs = bench.finish(sides)
        assert [pair.info["number"] for pair in pairs] == [2]
        # It is refused when it is found, not after a wait.
        (refused,) = bench.refusals
        assert refused == max(min(side.starts) for side in sides) + 1


def test_one_frame_each_time_that_it_is_open(bench):
    """While it stays open after a frame, nothing more begins."""
    bench.restart()
    sides    = skewed(bench, 0, frames(bench.rng, 4), frames(bench.rng, 4))
    follower = Follower(bench.rng)
    follower.close = lambda: None
    pairs    = play(bench, sides, follower)
    assert [pair.info["number"] for pair in pairs] == [1] and bench.seen["refused"] == 3


@pytest.mark.parametrize("place", [1, 5, 40, WIDTH*HEIGHT - 1])
def test_given_up(bench, place):
    """When what follows closes in the middle of a frame, the rest is discarded, and the next pair is whole."""
    bench.restart()
    sides    = skewed(bench, 3, frames(bench.rng, 3), frames(bench.rng, 3))
    follower = Follower(bench.rng)
    bench.forget()
    while not (bench.pairs and len(bench.pairs[0].pixels[0]) == place):
        bench.clock(sides, follower)
    follower.close()
    bench.run(sides, follower)
    pairs = bench.finish(sides)
    assert bench.seen["given_up"] == 1 and [pair.info["number"] for pair in pairs] == [2, 3]
    assert [pair.flags for pair in pairs] == [0, 0]


@pytest.mark.parametrize("kind", [name for name in DAMAGES if name.endswith("row")])
@pytest.mark.parametrize("side", [0, 1])
def test_damages(bench, side, kind):
    """A damaged frame is one of a pair, filled and flagged; the other one is as it was sent."""
    bench.restart()
    both = [frames(bench.rng, 4, period=2*PERIOD), frames(bench.rng, 4, period=2*PERIOD)]
    rows: Rows = damaged(both[side][1].rows, kind, bench.rng)
    both[side][1] = Shown(rows, 2*PERIOD, blanking=24 if kind == "short_row" else 6)
    sides = skewed(bench, 2, *both)
    pairs = play(bench, sides)
    wanted = guarded(rows, WIDTH, HEIGHT)
    assert pairs[1].pixels[side] == wanted.pixels
    assert [pair.flags for pair in pairs] == [0, flags_of(wanted.damages) << side*len(DAMAGES), 0, 0]


@pytest.mark.parametrize("side", [0, 1])
def test_a_begin_that_is_lost(bench, side):
    """A frame whose first item was lost does not begin: after a bounded wait its pair is refused."""
    for skew in (0, 5, -5, ROW):
        bench.restart()
        both = [frames(bench.rng, 3), frames(bench.rng, 3)]
        both[side][1].hidden = True
        sides = skewed(bench, skew, *both)
        pairs = play(bench, sides)
        assert [pair.info["number"] for pair in pairs] == [1, 3] and bench.seen["refused"] == 1


@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize("stop", [1, 30, ROW, 3*ROW + 11, FRAME - 2])
def test_a_sensor_that_falls_silent(bench, side, stop):
    """Its pair is filled and flagged, and pairs come again when it is back."""
    bench.restart()
    both = [frames(bench.rng, 4, period=FRAME + 3*SILENCE), frames(bench.rng, 4, period=FRAME + 3*SILENCE)]
    both[side][1].stop = stop
    sides = skewed(bench, -2, *both)
    pairs = play(bench, sides)
    assert [pair.info["number"] for pair in pairs] == [1, 2, 3, 4]
    stuck = 1 << DAMAGES.index("stuck") + side*len(DAMAGES)
    assert [bool(pair.flags & stuck) for pair in pairs] == [False, True, False, False]
    assert [pair.flags for pair in pairs[:1] + pairs[2:]] == [0]*3


def test_both_fall_silent(bench):
    """The pair under way is finished without them."""
    bench.restart()
    both = [frames(bench.rng, 1, stop=2*ROW), frames(bench.rng, 1, stop=3*ROW + 5)]
    sides = skewed(bench, 0, *both)
    pairs = play(bench, sides, rest=5*SILENCE)
    assert len(pairs) == 1 and all(pairs[0].flags >> bit & 1 for bit in (DAMAGES.index("stuck"),
                                                                         DAMAGES.index("stuck") + len(DAMAGES)))


def test_the_size_changes_between_frames(bench):
    """A pair has the size that was set when nothing was inside, both frames of it; a size of 0 begins none."""
    bench.restart()
    for width, height in ((WIDTH, HEIGHT), (20, 8), (1, 1), (2, 3)):
        bench.core.set(width=width, height=height)
        images = [[Shown(drawn_rows(width, height, bench.rng), 2*PERIOD)] for _ in SIDES]
        sides  = skewed(bench, 4, *images)
        bench.forget()
        bench.run(sides, follower := Follower(bench.rng), 45)
        # Both have begun: from now on other sizes do not matter.
        bench.core.set(width=7, height=2)
        bench.run(sides, follower)
        pairs = bench.finish(sides)
        assert [(pair.size, pair.flags) for pair in pairs] == [((width, height), 0)]
    for width, height in ((0, 5), (5, 0)):
        bench.core.set(width=width, height=height)
        assert play(bench, skewed(bench, 0, frames(bench.rng, 2), frames(bench.rng, 2))) == []
        assert bench.seen["refused"] == 2


def test_a_size_that_changes_all_the_time(bench):
    """Both frames of a pair have the same one."""
    bench.restart()
    for skew in (0, 1, -2, ROW):
        sides    = skewed(bench, skew, frames(bench.rng, 8), frames(bench.rng, 8))
        follower = Follower(bench.rng)
        bench.forget()
        while not all(side.idle for side in sides):
            bench.core.set(width=bench.rng.randint(10, 20), height=bench.rng.randint(4, 8))
            bench.clock(sides, follower)
        bench.run(sides, follower)
        pairs = bench.finish(sides)
        assert len({pair.size for pair in pairs}) >= 3


def any_frames(rng, periods: list[int]) -> list[Shown | int]:
    """Return frames of a sensor with any faults; the starts are near those of a sensor of these periods."""
    result: list[Shown | int] = []
    places = [rng.choice((0, 0, 3, rng.randrange(ROW))) for _ in range(len(periods) + 1)]
    for period, place, following in zip(periods, places, places[1:], strict=False):
        period += following - place
        rows    = drawn_rows(WIDTH, HEIGHT, rng)
        if rng.random() < 0.3:
            rows = damaged(rows, rng.choice([name for name in DAMAGES if name.endswith("row")]), rng)
        shown = Shown(rows, period, rng.choice((1, 6, 24)), rng.choice((1, 2, 2, 3)), rng.random() < 0.05)
        if rng.random() < 0.1:
            shown.stop = rng.randrange(1, FRAME)
        result.append(shown if rng.random() < 0.9 else period)
    return result


@pytest.mark.parametrize("seed", range(8))
def test_any_sensors(bench, seed):
    """Faults of all kinds, closings at any time: pairs are whole and of one start each; afterwards all is well."""
    rng = bench.rng = byte_generator(461, seed)
    bench.restart(window=rng.choice((ROW, PERIOD//2, PERIOD)))
    periods  = [rng.choice((460, 500, 500, 517, 800)) for _ in range(30)] # The longest of frames takes 460.
    sides    = skewed(bench, rng.choice((0, 3, ROW)), any_frames(rng, periods), any_frames(rng, periods))
    follower = Follower(rng, rng.choice((0.3, 0.6, 1.0)), (1, rng.choice((3, PERIOD))))
    bench.forget()
    closings = rng.choice((0.0, 0.001))
    while not all(side.idle for side in sides):
        if follower.open and rng.random() < closings:
            follower.close()
        bench.clock(sides, follower)
    bench.run(sides, follower)
    pairs = bench.finish(sides)
    assert len(pairs) >= 3
    bench.core.set(window=PERIOD//2)
    pairs = play(bench, skewed(bench, 3, frames(rng, 3), frames(rng, 3)))
    assert [pair.flags for pair in pairs] == [0]*3


@pytest.mark.parametrize("alone", [False, True])
def test_reset_in_mid_frame(bench, alone):
    """After a reset of all, or of the join alone, what was under way is gone, and the next pair is whole."""
    for _ in range(12):
        bench.restart()
        sides    = skewed(bench, bench.rng.choice((0, -3, ROW)), frames(bench.rng, 2), frames(bench.rng, 2))
        follower = Follower(bench.rng, 0.8)
        bench.forget()
        bench.run(sides, follower, bench.rng.randrange(20, FRAME + 80))
        if alone:
            bench.core.set(join_reset=1)
            bench.core.clock()
            bench.core.set(join_reset=0)
        else:
            bench.core.reset()
        bench.forget()
        follower.close()
        # The rest of the first frame, and the second one.
        bench.run(sides, follower)
        bench.finish(sides)
        pairs = play(bench, skewed(bench, 1, frames(bench.rng, 2), frames(bench.rng, 2)))
        assert len(pairs) == 2 and [pair.flags for pair in pairs] == [0, 0]
