#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from types import SimpleNamespace

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ..common                     import *
from ..common.settings            import SETTINGS
from ..engines.costs              import check_engine
from ..engines.sad.sad_engine     import SADEngine
from ..post.border                import Border
from ..post.left_right.left_right import LeftRight
from ..post.median                import Median
from ..post.selection.selection   import Selection
from .alignment                   import Alignment
from .line_buffer                 import LineBuffer
from .prefilter                   import Prefilter
from .raster                      import Raster

# Steps that the count of results does not show yet: one each in the two registers of the raster, in the count and in
# the credit.
UNCOUNTED_STEPS = 2 + 1 + 1

# From the first pixel pair of a frame to its begin: the held settings, a threshold that is derived from another one
# (`right_last` of `Raster`), and three to spare.
SETTLE_CLOCKS = 1 + 2 + 3

# Settings -----------------------------------------------------------------------------------------

def matcher_settings(parameters):
    """Settings of a frame: (name, bits, value after reset, whether the matcher is built for it, fixed value if not)."""
    features = parameters.features
    choice   = {"xsobel", "raw"} <= features # Of the prefilter.
    lowest   = "min_disparity" in features
    usual    = {one.register: one.default for one in SETTINGS}
    return [
        ("width",             bits_for(parameters.max_width),      parameters.max_width,      True, 0),
        ("height",            bits_for(parameters.max_height),     parameters.max_height,     True, 0),
        ("disparities",       bits_for(parameters.disparities),    parameters.disparities,    True, 0),
        ("block_size",        bits_for(parameters.max_block_size), parameters.max_block_size, True, 0),
        ("min_disparity",     bits_for(MAX_MIN_DISPARITY),    usual["min_disparity"],     lowest, 0),
        ("xsobel",            1,                              usual["xsobel"],            choice, "xsobel" in features),
        ("prefilter_cap",     bits_for(MAX_PREFILTER_CAP),    usual["prefilter_cap"],     "xsobel"     in features, 0),
        ("texture_threshold", TEXTURE_BITS,                   usual["texture_threshold"], "texture"    in features, 0),
        ("uniqueness_ratio",  bits_for(MAX_UNIQUENESS_RATIO), usual["uniqueness_ratio"],  "uniqueness" in features, 0),
        ("subpixel",          1,                              usual["subpixel"],          "subpixel"   in features, 0),
        ("left_right",        1,                              0,                          "left_right" in features, 0),
        ("disp12_max_diff",   bits_for(MAX_DISP12_MAX_DIFF),  1,                          "left_right" in features, 0),
        ("median",            1,                              usual["median"],            "median"     in features, 0),
    ]

# Matcher ------------------------------------------------------------------------------------------

@ResetInserter()
class Matcher(LiteXModule):
    """Stereo matcher after cv2.StereoBM: a stream of pixel pairs in, a disparity map out, one pixel per clock.

    It consists of

    - the front: `Raster` admits pixel pairs and gives them a position, then prefilter, line buffer and alignment;
    - the engine: positioned pairs in, costs of all disparities out (`add_engine`);
    - the post: `Selection` of a winner into a FIFO; left-right check, border and median make the map;
    - the shell around them: credit, settings and the frame.

    Between admission and the winners' FIFO nothing stalls; the FIFO has room for every result that is under way.

    A frame begins with the first pixel pair that is valid while the matcher is idle and ends when the last pixel of the
    map has left. Settings are taken over at its begin and stay until its end. They must be legal: disparities a
    multiple of 16, block_size odd, width and height at least min_disparity + disparities + block_size - 1 and
    block_size.

    The settings are Signals named as in `matcher_settings`; those that the matcher is not built for are ignored.

    Parameters
    ----------
    parameters : MatcherParameters
        What is built.
    """
    def __init__(self, parameters):
        self.parameters = parameters
        self.sink       = stream.Endpoint(pixel_pair_layout()) # Rectified pixel pairs, width x height per frame.
        self.source     = stream.Endpoint(disparity_layout())  # Disparity map, width x height pixels per frame.

        for name, bits, reset, *_ in matcher_settings(parameters):
            setattr(self, name, Signal(bits, reset=reset, name=name))
        self.busy      = Signal() # A frame is under way.
        self.first_row = Signal() # First row with disparities out (pulse).
        self.latency   = None     # Depends on the settings: a row is out some rows after its pixels came in.

        # # #

        self.add_front()
        self.add_engine(self.make_engine())
        self.add_post()
        self.add_credit()
        taken_over, held = self.add_settings()
        self.add_frame(taken_over, held)

    def pipeline(self):
        """Return the cores between admission and FIFO, none of which ever stalls."""
        return [self.raster, self.prefilter, self.line_buffer, self.alignment, self.engine, self.selection]

    # Datapath -------------------------------------------------------------------------------------

    def add_front(self):
        """Build raster, prefilter, line buffer and alignment: pixel pairs in, positioned pairs out."""
        self.raster      = Raster(self.parameters)
        self.prefilter   = Prefilter(self.parameters)
        self.line_buffer = LineBuffer(self.parameters)
        self.alignment   = Alignment(self.parameters)
        self.comb += [
            self.sink.connect(self.raster.sink),
            connect_pipeline(self.raster.source, self.prefilter.sink),
            connect_pipeline(self.prefilter.source, self.line_buffer.sink),
            connect_pipeline(self.line_buffer.source, self.alignment.sink),
        ]

    def make_engine(self):
        """Return the engine. A matcher with another one overrides this."""
        return SADEngine(self.parameters)

    def add_engine(self, engine):
        """Put the engine between front and post: positioned pairs in, cost lanes out.

        Parameters
        ----------
        engine : LiteXModule
            A core of the pipeline: valid without ready, one step per clock, in order, gaps allowed. It has

            - ``sink``, `positioned_pair_layout`: per step a filtered pixel pair, the pair block_size rows above it, and
              the position. Pixels of a step meet at the smallest disparity: disparity d of the left pixel is d columns
              back in the right image, where ``move_left`` and ``move_right`` say which image moves on.
            - ``source``, `cost_layout`: for each step with ``cost``, and for no other, the position as it came in and
              ``costs``, a lane per disparity and then that of the texture. Costs must be right where ``complete`` is 1.
              The smallest cost wins; all ones is more than any cost.
            - ``latency``, an int: clocks from ``sink`` to ``source``. The winners' FIFO gets room for as many results.
            - Settings, Signals that are stable during a frame: ``block_size``, and ``cap``, the value of a filtered
              pixel without texture.

            Reset clears it as any core of the pipeline. What memories hold need not matter: ``row_first``, ``row_old``,
            ``cost_first`` and ``cost_old`` say what counts.

        Raises
        ------
        ValueError
            If an endpoint or the latency is not as above.
        """
        check_engine(engine, self.parameters)
        self.engine = engine
        self.comb  += connect_pipeline(self.alignment.source, engine.sink)

    def add_post(self):
        """Build selection, winners' FIFO, left-right check, border and median: cost lanes in, the map out."""
        self.selection        = Selection(self.parameters)
        self.fifo             = stream.SyncFIFO(winner_layout(self.parameters), depth=self.fifo_depth())
        self.left_right_stage = LeftRight(self.parameters)
        self.border           = Border(self.parameters)
        self.median_stage     = Median(self.parameters)
        self.comb += [
            connect_pipeline(self.engine.source, self.selection.sink),
            self.selection.source.connect(self.fifo.sink, omit={"ready"}),
            self.fifo.source.connect(self.left_right_stage.sink),
            self.left_right_stage.source.connect(self.border.sink),
            self.border.source.connect(self.median_stage.sink),
            self.median_stage.source.connect(self.source),
        ]

    # Shell ----------------------------------------------------------------------------------------

    def fifo_depth(self):
        """Return a depth with room for all results under way."""
        return 2**bits_for(sum(core.latency for core in self.pipeline()) + UNCOUNTED_STEPS)

    def add_credit(self):
        """Give credit for as many results as the FIFO holds."""
        fifo       = self.fifo
        used       = Signal(max=fifo.depth + 1)
        take, give = Signal(), Signal()
        self.comb += [
            take.eq(self.raster.source.valid & self.raster.source.complete),
            give.eq(fifo.source.valid & fifo.source.ready),
        ]
        self.sync += [
            used.eq(used + take - give),
            self.raster.credit.eq(used < fifo.depth - UNCOUNTED_STEPS),
        ]

    def add_settings(self):
        """Hold the settings for a frame and hand them to the cores.

        Return the Signal with which they are taken over, and the held settings by name.
        """
        taken_over = Signal()
        held       = {}
        for name, bits, _, built, fixed in matcher_settings(self.parameters):
            held[name] = setting = Signal(bits, name=f"held_{name}")
            if built:
                self.sync += If(taken_over, setting.eq(getattr(self, name)))
            else:
                self.comb += setting.eq(int(fixed))
        self.comb += self.connect_settings(SimpleNamespace(**held))
        return taken_over, held

    def connect_settings(self, held):
        """Return the statements that connect the held settings to the cores."""
        raster, prefilter, line_buffer, alignment, engine, selection = self.pipeline()
        left_right, border, median = self.left_right_stage, self.border, self.median_stage
        outer   = Mux(held.left_right, held.block_size[1:], 0)
        texture = Mux(held.xsobel, held.texture_threshold, 0)
        return [
            # Front.
            raster.width.eq(held.width),
            raster.height.eq(held.height),
            raster.disparities.eq(held.disparities),
            raster.block_size.eq(held.block_size),
            raster.min_disparity.eq(held.min_disparity),
            raster.outer.eq(outer),
            prefilter.width.eq(held.width),
            prefilter.xsobel.eq(held.xsobel),
            prefilter.cap.eq(held.prefilter_cap),
            line_buffer.block_size.eq(held.block_size),
            alignment.min_disparity.eq(held.min_disparity),
            alignment.outer.eq(outer),
            # Engine.
            engine.block_size.eq(held.block_size),
            engine.cap.eq(held.prefilter_cap),
            # Post.
            selection.disparities.eq(held.disparities),
            selection.texture_threshold.eq(texture),
            selection.uniqueness_ratio.eq(held.uniqueness_ratio),
            selection.subpixel.eq(held.subpixel),
            left_right.width.eq(held.width),
            left_right.disparities.eq(held.disparities),
            left_right.min_disparity.eq(held.min_disparity),
            left_right.left_right.eq(held.left_right),
            left_right.disp12_max_diff.eq(held.disp12_max_diff),
            left_right.outer.eq(outer),
            border.width.eq(held.width),
            border.height.eq(held.height),
            border.disparities.eq(held.disparities),
            border.block_size.eq(held.block_size),
            border.min_disparity.eq(held.min_disparity),
            median.width.eq(held.width),
            median.height.eq(held.height),
            median.median.eq(held.median),
        ]

    def add_frame(self, taken_over, held):
        """Take the settings over, let the thresholds derived from them settle, then begin; end with the map."""
        settle   = Signal(max=SETTLE_CLOCKS)
        starting = [core.begin for core in (self.raster, self.left_right_stage, self.border, self.median_stage)]
        self.fsm = fsm = FSM(reset_state="IDLE")
        self.comb += self.busy.eq(~fsm.ongoing("IDLE"))
        fsm.act("IDLE",
            If(self.sink.valid,
                taken_over.eq(1),
                NextValue(settle, 0),
                NextState("SETTLE")
            )
        )
        fsm.act("SETTLE",
            NextValue(settle, settle + 1),
            If(settle == SETTLE_CLOCKS - 1,
                [begin.eq(1) for begin in starting],
                NextState("BEGIN")
            )
        )
        fsm.act("BEGIN",
            NextState("FRAME")
        )
        fsm.act("FRAME",
            If(~(self.border.busy | self.median_stage.busy),
                NextState("IDLE")
            )
        )
        self.add_first_row(held["width"], held["block_size"][1:], starting[0])

    def add_first_row(self, width, row_with_disparities, begin):
        """Say when the first row that has disparities is out."""
        column = Signal.like(width)
        row    = Signal.like(row_with_disparities)
        over   = Signal() # It was out.
        out    = self.source.valid & self.source.ready
        self.comb += self.first_row.eq(out & ~over & (column == width - 1) & (row == row_with_disparities))
        self.sync += [
            If(out,
                column.eq(column + 1),
                If(column == width - 1,
                    column.eq(0),
                    row.eq(row + 1),
                    If(row == row_with_disparities,
                        over.eq(1)
                    )
                )
            ),
            If(begin,
                column.eq(0),
                row.eq(0),
                over.eq(0)
            ),
        ]
