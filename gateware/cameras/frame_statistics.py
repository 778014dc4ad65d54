#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ..common      import PIXEL_BITS
from .event_totals import TOTAL_BITS
from .layouts      import *

LEAST_USABLE = 6   # A pixel below this is dark: it may be the sensor's black.
MOST_USABLE  = 249 # One above this is bright: it may be cut off.
BIN_BITS     = 4   # Bins of equal width, by the highest bits of a pixel.
BINS         = 2**BIN_BITS

# Frame Statistics ---------------------------------------------------------------------------------

@ResetInserter()
class FrameStatistics(LiteXModule):
    """How bright the frames of a sensor are: sum of a window's pixels, dark and bright ones, a histogram.

    It sees the sensor's items as the guard takes them, so it measures frames that do not begin, too. The window is
    taken over when a frame begins. Pixels that have not come are not counted, and those beyond the largest frame
    neither: the sum of all bins says how many there were.

    The results are those of one frame, the newest that has ended, by its mark or by the begin of the next one; they
    change in the clock after `measured`. One that falls silent has ended when the next one begins.

    The bins are two banks of a memory: one counts while the other one is read.
    """
    def __init__(self, parameters):
        self.sink         = stream.Endpoint(sensor_layout())      # Pipeline: items that the guard takes.
        self.column_begin = Signal(max=parameters.max_width + 1)  # Window: first column,
        self.column_end   = Signal(max=parameters.max_width + 1)  # the one after the last,
        self.row_begin    = Signal(max=parameters.max_height + 1) # first row,
        self.row_end      = Signal(max=parameters.max_height + 1) # and the one after the last.
        count_bits        = len(self.column_end) + len(self.row_end)
        self.measured     = Signal()                              # A frame has ended (pulse).
        self.frames       = Signal(TOTAL_BITS)                    # Those that have, modulo 2**TOTAL_BITS.
        self.sum          = Signal(count_bits + PIXEL_BITS)       # Of the window's pixels.
        self.dark         = Signal(count_bits)                    # Its pixels below LEAST_USABLE,
        self.bright       = Signal(count_bits)                    # and above MOST_USABLE.
        self.bin_index    = Signal(BIN_BITS)                      # Bin to read.
        self.bin          = Signal(count_bits)                    # Its pixels, in the same clock.
        self.latency      = None                                  # Results are of whole frames.

        # # #

        self.add_window()
        self.add_sums()
        self.add_bins(count_bits)

    def add_window(self):
        """Find the pixels of the window, and the end of the frame, a clock after their items."""
        sink   = self.sink
        names  = ("column_begin", "column_end", "row_begin", "row_end")
        window = {name: Signal.like(getattr(self, name), name=f"held_{name}") for name in names}
        column = Signal.like(self.column_end)
        row    = Signal.like(self.row_end)
        active = Signal() # A frame is under way.
        begins = Signal()
        ends   = Signal()
        self.pixel = Signal(PIXEL_BITS)
        self.hit   = Signal() # That pixel is in the window.
        self.close = Signal() # The frame has ended.
        self.comb += [
            begins.eq(sink.valid & (sink.kind == FRAME_BEGIN)),
            ends.eq(sink.valid & (sink.kind == FRAME_END)),
        ]
        self.sync += [
            self.pixel.eq(sink.pixel),
            self.hit.eq(active & sink.valid & (sink.kind == PIXEL)
                & (column >= window["column_begin"]) & (column < window["column_end"])
                & (row >= window["row_begin"]) & (row < window["row_end"])),
            self.close.eq(active & (begins | ends)),
            # Counts stop at their largest values, which are in no window.
            If(sink.valid & (sink.kind == PIXEL) & (column != 2**len(column) - 1),
                column.eq(column + 1)
            ),
            If(sink.valid & (sink.kind == ROW_END),
                column.eq(0),
                If(row != 2**len(row) - 1,
                    row.eq(row + 1)
                )
            ),
            If(begins,
                active.eq(1),
                column.eq(0),
                row.eq(0),
                [window[name].eq(getattr(self, name)) for name in names]
            ),
            If(ends,
                active.eq(0)
            ),
        ]

    def add_sums(self):
        """Add up the pixels of a frame, and keep what came out."""
        counts = {name: Signal.like(getattr(self, name), name=f"counted_{name}") for name in ("sum", "dark", "bright")}
        adds   = {
            "sum":    self.pixel,
            "dark":   self.pixel < LEAST_USABLE,
            "bright": self.pixel > MOST_USABLE,
        }
        self.comb += self.measured.eq(self.close)
        for name, count in counts.items():
            self.sync += [
                If(self.hit,
                    count.eq(count + adds[name])
                ),
                If(self.close,
                    count.eq(0),
                    getattr(self, name).eq(count)
                ),
            ]
        self.sync += If(self.close,
            self.frames.eq(self.frames + 1)
        )

    def add_bins(self, count_bits):
        """Count the pixels of each bin. Memory is not cleared: a bin counts from 0 if it is not in use yet."""
        memory = Memory(count_bits, 2*BINS, name="bins")
        old    = memory.get_port(async_read=True)
        new    = memory.get_port(write_capable=True)
        read   = memory.get_port(async_read=True)
        self.specials += memory, old, new, read
        bank   = Signal()     # That counts.
        used   = Signal(BINS) # Bins of it that have pixels,
        kept   = Signal(BINS) # and of the other one.
        index  = Signal(BIN_BITS)
        before = Signal(count_bits)
        self.comb += [
            index.eq(self.pixel[PIXEL_BITS - BIN_BITS:]),
            old.adr.eq(Cat(index, bank)),
            new.adr.eq(Cat(index, bank)),
            before.eq(Mux((used >> index)[0], old.dat_r, 0)),
            new.dat_w.eq(before + 1),
            new.we.eq(self.hit),
            read.adr.eq(Cat(self.bin_index, ~bank)),
            self.bin.eq(Mux((kept >> self.bin_index)[0], read.dat_r, 0)),
        ]
        self.sync += [
            If(self.hit,
                used.eq(used | (1 << index))
            ),
            If(self.close,
                bank.eq(~bank),
                kept.eq(used),
                used.eq(0)
            ),
        ]
