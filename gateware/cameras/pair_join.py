#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ..common     import pixel_pair_layout
from .frame_guard import DAMAGES
from .frame_queue import FrameQueue
from .layouts     import *

# Pair Join ----------------------------------------------------------------------------------------

@ResetInserter()
class PairJoin(LiteXModule):
    """The frames of two sensors as one stream of pixel pairs: of frames that are a pair, and of nothing else.

        FrameGuard ══> FrameQueue ══.
                                    >══ pairs
        FrameGuard ══> FrameQueue ══'
             ^ accept       ^ hold, release, discard
             '---------- PairJoin <── PairMatcher

    A pair begins when `PairMatcher` has found it, both guards have begun their frames, and `open` is 1: what follows
    takes a frame. Then exactly width x height pixel pairs leave. It takes one pair each time that `open` is 1: before
    the next one that has to be 0 for a clock.

    A pair that was found is either begun or refused. It is refused if what follows is not open, or still has another
    one; if a guard drops its frame; if a sensor starts again; if one of the frames has not begun for `silence` clocks.
    So it may be late by that time, and no longer. A pair that has begun has ended when all of it has left and both
    guards have ended their frames, which is bounded by their silence; then it has the damages of both, and what is
    missing is filled. It is given up if `open` falls before that: the rest is discarded.

    Frames that are alone, and those of pairs that are refused, are discarded whole. Guards get `accept` only if
    the newest start of their sensor is one of a pair or may become that, and what follows takes it: so the newest frame
    is what begins next.

    The size of a frame is taken over while none is inside; a size of 0 begins none. `info` is of the pair that has
    begun last, `flags` and `apart` of the one that has ended last.
    """
    def __init__(self, parameters):
        self.sinks        = [stream.Endpoint(pixel_layout()) for _ in SIDES] # Frames of the guards.
        self.source       = stream.Endpoint(pixel_pair_layout()) # Pairs, raster order; first and last.
        self.open         = Signal()                             # What follows takes a frame.
        # Size, for the guards too.
        self.width        = Signal(max=parameters.max_width + 1)  # Columns of a frame,
        self.height       = Signal(max=parameters.max_height + 1) # and rows.
        self.frame_width  = Signal.like(self.width)               # The same, of the frames inside.
        self.frame_height = Signal.like(self.height)
        self.silence      = Signal(parameters.silence_bits)       # Of the guards, in clocks.
        # From captures and guards; a Signal per side.
        self.starts  = [Signal(name=f"{side}_starts")  for side in SIDES] # The sensor starts a frame (pulses).
        self.begun   = [Signal(name=f"{side}_begun")   for side in SIDES] # The guard begins it (pulses),
        self.dropped = [Signal(name=f"{side}_dropped") for side in SIDES] # or drops it (pulses).
        self.ended   = [Signal(name=f"{side}_ended")   for side in SIDES] # It has ended its frame (pulses).
        self.damages = [Signal(len(DAMAGES), name=f"{side}_damages") for side in SIDES] # Its flags.
        self.accept  = [Signal(name=f"{side}_accept")  for side in SIDES] # To the guard: a frame may begin.
        # From the matcher of pairs.
        self.waits   = Signal()              # A start waits for the other sensor's,
        self.side    = Signal()              # that of this side.
        self.paired  = Signal()              # A pair is found (pulse),
        self.found   = Record(pair_layout()) # this one.
        # Status.
        self.info     = Record(pair_layout())     # The pair that has begun last.
        self.flags    = Signal(2*len(DAMAGES))    # Damages of the one that has ended last, those of the left first.
        self.apart    = Signal()                  # That one was flagged for its skew.
        self.busy     = Signal()                  # A pair is under way.
        self.begins   = Signal()                  # A pair begins (pulse),
        self.refused  = Signal()                  # or does not (pulse).
        self.finished = Signal()                  # It has ended (pulse),
        self.given_up = Signal()                  # or was given up (pulse).
        self.latency  = None                      # Frames wait for each other.

        # # #

        self.queues = [FrameQueue(parameters) for _ in SIDES]
        self.submodules += self.queues
        self.add_queues()
        self.add_match()
        self.add_size()
        self.add_fsm()
        self.add_pairs()

    def connect_matcher(self, pairs):
        """Return the statements that connect a `PairMatcher`."""
        found = self.found
        return [
            self.waits.eq(pairs.waits),
            self.side.eq(pairs.side),
            self.paired.eq(pairs.paired),
            found.number.eq(pairs.pair_number),
            found.exposed.eq(pairs.exposed),
            found.left_stamp.eq(pairs.stamps[0]),
            found.right_stamp.eq(pairs.stamps[1]),
            found.skew.eq(pairs.skew),
            found.flagged.eq(pairs.flagged),
        ]

    def add_queues(self):
        """Connect the queues, and tell each whether its frame may become one of a pair."""
        self.takes   = Signal() # What follows takes a pair, and none is under way.
        self.discard = Signal() # Discard what is inside (pulse).
        self.live    = Signal() # A pair is found, and has not begun.
        for number, queue in enumerate(self.queues):
            self.comb += [
                self.sinks[number].connect(queue.sink),
                queue.starts.eq(self.starts[number]),
                queue.begun.eq(self.begun[number]),
                queue.dropped.eq(self.dropped[number]),
                queue.ended.eq(self.ended[number]),
                queue.hopeful.eq(self.live | (self.waits & (self.side == number))),
                queue.release.eq(self.begins),
                queue.discard.eq(self.discard),
                self.accept[number].eq(self.takes & queue.hopeful & queue.empty),
            ]

    def add_match(self):
        """Keep a pair that was found until it begins or is refused."""
        left, right  = self.queues
        self.matched = matched = Signal()
        waited       = Signal.like(self.silence) # Clocks since it was found.
        starts       = Signal()
        hindered     = Signal()
        self.comb += [
            self.live.eq(matched | self.paired),
            starts.eq(self.starts[0] | self.starts[1]),
            hindered.eq(starts | left.absent | right.absent | ~self.takes | (waited == self.silence)),
            self.begins.eq(matched & ~hindered & left.held & right.held),
            self.refused.eq(self.live & hindered),
        ]
        self.sync += [
            matched.eq(self.live & ~hindered & ~self.begins),
            If(matched,
                waited.eq(waited + 1)
            ).Else(
                waited.eq(0)
            ),
            If(self.begins,
                self.info.eq(self.found)
            ),
        ]

    def add_size(self):
        """Take the size over while no frame is inside: both frames of a pair have the same."""
        left, right = self.queues
        quiet       = Signal()
        self.sized  = Signal()
        self.comb += [
            quiet.eq(left.empty & right.empty & ~self.begun[0] & ~self.begun[1]),
            self.sized.eq((self.frame_width != 0) & (self.frame_height != 0)),
        ]
        self.sync += If(quiet,
            self.frame_width.eq(self.width),
            self.frame_height.eq(self.height)
        )

    def add_fsm(self):
        """Follow a pair: none, its pixels, its end."""
        left, right = self.queues
        armed    = Signal() # What follows was closed since the last pair began.
        self.fsm = fsm = FSM(reset_state="WAIT")
        self.comb += [
            self.busy.eq(~fsm.ongoing("WAIT")),
            self.takes.eq(~self.busy & self.open & armed & self.sized),
        ]
        self.sync += [
            If(self.begins,
                armed.eq(0)
            ),
            If(~self.open,
                armed.eq(1)
            ),
        ]
        fsm.act("WAIT",
            If(self.begins,
                NextState("PAIR")
            )
        )
        fsm.act("PAIR",
            If(self.source.valid & self.source.ready & self.source.last,
                NextState("END")
            ).Elif(~self.open,
                self.discard.eq(1),
                self.given_up.eq(1),
                NextState("WAIT")
            )
        )
        fsm.act("END",
            If(left.complete & right.complete,
                self.finished.eq(1),
                NextValue(self.flags, Cat(*self.damages)),
                NextValue(self.apart, self.info.flagged),
                NextState("WAIT")
            )
        )

    def add_pairs(self):
        """Give out what has come of both frames."""
        left, right = [queue.source for queue in self.queues]
        source      = self.source
        first       = Signal()
        self.comb += [
            source.valid.eq(left.valid & right.valid),
            source.left.eq(left.pixel),
            source.right.eq(right.pixel),
            source.first.eq(first),
            source.last.eq(left.last),
            left.ready.eq(right.valid & source.ready),
            right.ready.eq(left.valid & source.ready),
        ]
        self.sync += [
            If(source.valid & source.ready,
                first.eq(0)
            ),
            If(self.begins,
                first.eq(1)
            ),
        ]
