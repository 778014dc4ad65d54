#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Vocabulary of the cores: layouts, lanes and delays."""

from migen import *

from litex.soc.interconnect import stream

from .parameters import *

# Number Formats -----------------------------------------------------------------------------------

DISPARITY_BITS  = 16 # Disparity in the map, two's complement, sixteenths of a pixel.
DISPARITY_SHIFT = 4  # Fractional bits of that.

# Layouts ------------------------------------------------------------------------------------------

def pixel_pair_layout(bits=PIXEL_BITS):
    """Left and right pixel of the same row and column, raster order, `first`/`last` mark the frame."""
    return [("left", bits), ("right", bits)]

def old_pair_layout(bits):
    """A pixel pair, and the one block_size rows above it, which leaves the block."""
    return pixel_pair_layout(bits) + [("left_old", bits), ("right_old", bits)]

def disparity_layout():
    """One pixel of the disparity map, raster order, `first`/`last` mark the frame."""
    return [("disparity", DISPARITY_BITS)]

def winner_layout(parameters):
    """A disparity of the valid region, relative to the smallest one that is searched."""
    return [
        ("found",     1),                                                    # There is one.
        ("disparity", bits_for((parameters.disparities - 1) << DISPARITY_SHIFT)), # Sixteenths of a pixel.
        ("cost",      parameters.cost_bits),                                 # Its cost.
    ]

def position_layout(parameters):
    """What the cores behind the raster know of a pixel's place: see `Raster` for the meaning."""
    return [
        ("column",      bits_for(parameters.max_slots)),
        ("take",        1),
        ("pixel",       1),
        ("pixel_first", 1),
        ("pixel_last",  1),
        ("row_first",   1),
        ("row_last",    1),
        ("row_flat",    1),
        ("row_old",     1),
        ("late",        1),
        ("move_left",   1),
        ("move_right",  1),
        ("cost",        1),
        ("cost_column", bits_for(parameters.cost_columns)),
        ("cost_first",  1),
        ("cost_old",    1),
        ("complete",    1),
    ]

def lanes_layout(name, bits, parameters):
    """One number per lane, lane 0 in the low bits, and the place of the pixel."""
    return [(name, parameters.lanes*bits)] + position_layout(parameters)

# Lanes and Delays ---------------------------------------------------------------------------------

def lanes_of(signal, lanes):
    """The lanes of a wide signal as a list of slices."""
    bits = len(signal)//lanes
    return [signal[lane*bits:(lane + 1)*bits] for lane in range(lanes)]

def sign_extended(signal, bits):
    """A number in two's complement as `bits` bits. Of signed signals migen and Verilog think differently."""
    return Cat(signal, Replicate(signal[-1], bits - len(signal)))

def delayed(module, signal, clocks):
    """`signal` as it was `clocks` clocks ago; if it is wider than a bit it is data, which a reset leaves alone."""
    for _ in range(clocks):
        stage = Signal.like(signal, reset_less=len(signal) > 1)
        module.sync += stage.eq(signal)
        signal = stage
    return signal

def pass_position(module, sink, source, latency, valid=None):
    """Delay valid and position from `sink` to `source` by `latency` clocks; return both after each clock.

    Element i of the list is the position i clocks behind the sink, so element 0 is the sink itself. `valid`, if
    given, takes the place of the sink's own.
    """
    fields = [name for name, *_ in source.description.payload_layout if name in _POSITION and hasattr(sink, name)]
    stages = [sink]
    for _ in range(latency):
        stage = stream.Endpoint([(name, len(getattr(sink, name))) for name in fields])
        for name in fields:
            # A reset clears `valid`, and with it all that the position says.
            getattr(stage, name).reset_less = True
        before = valid if valid is not None and len(stages) == 1 else stages[-1].valid
        module.sync += stage.valid.eq(before)
        module.sync += [getattr(stage, name).eq(getattr(stages[-1], name)) for name in fields]
        stages.append(stage)
    module.comb += source.valid.eq(stages[-1].valid)
    module.comb += [getattr(source, name).eq(getattr(stages[-1], name)) for name in fields]
    return stages

_POSITION = {name for name, *_ in position_layout(MatcherParameters())}

def connect_pipeline(source, sink):
    """Statements that connect two cores of the pipeline, whose endpoints have no ready."""
    return [sink.valid.eq(source.valid)] + [
        getattr(sink, name).eq(getattr(source, name)) for name, *_ in sink.description.payload_layout]
