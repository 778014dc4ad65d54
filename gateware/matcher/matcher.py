#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ..common                          import *
from ..common.settings                 import SETTINGS
from ..engines.sad.absolute_difference import AbsoluteDifference
from ..engines.sad.block_sum           import BlockSum
from ..engines.sad.column_sum          import ColumnSum
from ..post.border                     import Border
from ..post.left_right.left_right      import LeftRight
from ..post.median                     import Median
from ..post.selection.selection        import Verdict
from .alignment                        import Alignment
from .line_buffer                      import LineBuffer
from .prefilter                        import Prefilter
from .raster                           import Raster

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
    """Block matcher after cv2.StereoBM: a stream of pixel pairs in, a disparity map out, one pixel per clock.

    All disparities are computed in parallel. Between admission (`Raster`) and the winners' FIFO nothing stalls; the FIFO
    has room for every result that is under way.

    A frame begins with the first pixel pair that is valid while the matcher is idle and ends when the last pixel of the
    map has left. Settings are taken over at its begin and stay until its end. They must be legal: disparities a multiple of
    16, block_size odd, width and height at least min_disparity + disparities + block_size - 1 and block_size.

    The settings are Signals named as in `matcher_settings`; those that the matcher is not built for are ignored.

    Parameters
    ----------
    parameters : MatcherParameters
        What is built.
    """
    def __init__(self, parameters):
        self.parameters = parameters
        self.sink       = stream.Endpoint(pixel_pair_layout()) # Rectified pixel pairs, width x height of them a frame.
        self.source     = stream.Endpoint(disparity_layout())  # Disparity map, width x height pixels a frame.

        for name, bits, reset, *_ in matcher_settings(parameters):
            setattr(self, name, Signal(bits, reset=reset, name=name))
        self.busy      = Signal() # A frame is under way.
        self.first_row = Signal() # First row with disparities out (pulse).
        self.latency   = None     # Depends on the settings: a row is out some rows after its pixels came in.

        # # #

        # Cores.
        # ------
        self.raster      = Raster(parameters)
        self.prefilter   = Prefilter(parameters)
        self.line_buffer = LineBuffer(parameters)
        self.alignment   = Alignment(parameters)
        self.difference  = AbsoluteDifference(parameters)
        self.column_sum  = ColumnSum(parameters)
        self.block_sum   = BlockSum(parameters)
        self.verdict     = Verdict(parameters)
        self.fifo        = fifo = stream.SyncFIFO(winner_layout(parameters), depth=self.fifo_depth())
        self.checker     = LeftRight(parameters)
        self.border      = Border(parameters)
        self.filter      = Median(parameters)

        # Pipeline and streams.
        # ---------------------
        for before, after in zip(self.pipeline(), self.pipeline()[1:]):
            self.comb += connect_pipeline(before.source, after.sink)
        self.comb += [
            self.sink.connect(self.raster.sink),
            self.verdict.source.connect(fifo.sink, omit={"ready"}),
            fifo.source.connect(self.checker.sink),
            self.checker.source.connect(self.border.sink),
            self.border.source.connect(self.filter.sink),
            self.filter.source.connect(self.source),
        ]
        self.add_credit()
        self.add_frame()

    def pipeline(self):
        """The cores between admission and FIFO, none of which ever stalls."""
        return [self.raster, self.prefilter, self.line_buffer, self.alignment, self.difference, self.column_sum,
            self.block_sum, self.verdict]

    def fifo_depth(self):
        """Room for all results under way."""
        return 2**bits_for(sum(core.latency for core in self.pipeline()) + 4)

    def add_credit(self):
        """Credit for as many results as the FIFO holds."""
        fifo       = self.fifo
        used       = Signal(max=fifo.depth + 1)
        take, give = Signal(), Signal()
        self.comb += [
            take.eq(self.raster.source.valid & self.raster.source.complete),
            give.eq(fifo.source.valid & fifo.source.ready),
        ]
        # Three registers lie between admission and credit, so up to four steps are not counted yet.
        self.sync += [
            used.eq(used + take - give),
            self.raster.credit.eq(used < fifo.depth - 4),
        ]

    def add_frame(self):
        """Hold the settings for the whole frame; let the thresholds derived from them settle before it begins."""
        begin = Signal()
        held  = {}
        for name, bits, _, built, fixed in matcher_settings(self.parameters):
            held[name] = signal = Signal(bits, name=f"held_{name}")
            if built:
                self.sync += If(begin, signal.eq(getattr(self, name)))
            else:
                self.comb += signal.eq(int(fixed))
        cores = [*self.pipeline(), self.checker, self.border, self.filter]
        drive = {
            **held,
            "cap":               held["prefilter_cap"],
            "texture_threshold": Mux(held["xsobel"], held["texture_threshold"], 0),
            "outer":             Mux(held["left_right"], held["block_size"][1:], 0),
        }
        for core in cores:
            self.comb += [getattr(core, name).eq(value) for name, value in drive.items()
                if isinstance(getattr(core, name, None), Signal)]

        settle   = Signal(max=8)
        starting = [core.begin for core in (self.raster, self.checker, self.border, self.filter)]
        self.fsm = fsm = FSM(reset_state="IDLE")
        self.comb += self.busy.eq(~fsm.ongoing("IDLE"))
        fsm.act("IDLE",
            If(self.sink.valid,
                begin.eq(1),
                NextValue(settle, 0),
                NextState("SETTLE")
            )
        )
        fsm.act("SETTLE",
            NextValue(settle, settle + 1),
            If(settle == 5,
                [core_begin.eq(1) for core_begin in starting],
                NextState("BEGIN")
            )
        )
        fsm.act("BEGIN",
            NextState("FRAME")
        )
        fsm.act("FRAME",
            If(~(self.border.busy | self.filter.busy),
                NextState("IDLE")
            )
        )
        self.add_first_row(held["width"], held["block_size"][1:], starting[0])

    def add_first_row(self, width, row_with_disparities, begin):
        """Say when the first row that has disparities is out."""
        column = Signal.like(width)
        row    = Signal.like(row_with_disparities)
        over   = Signal()
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
