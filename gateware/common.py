#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Vocabulary of the cores: layouts, number formats and the check of build-time parameters."""

from migen import *

from litex.soc.interconnect import stream

# Number Formats -----------------------------------------------------------------------------------

PIXEL_BITS      = 8  # Grey value of a rectified camera image.
DISPARITY_BITS  = 16 # Disparity in the map, two's complement, sixteenths of a pixel.
DISPARITY_SHIFT = 4  # Fractional bits of that.
MIN_BLOCK_SIZE  = 5  # As cv2.StereoBM. Below that the delay lines would also be shorter than their pipeline.

# -16 (no disparity) as its 16 bits: a negative constant would be emitted as an unsigned literal.
INVALID_DISPARITY = 2**DISPARITY_BITS - 2**DISPARITY_SHIFT

# Checks -------------------------------------------------------------------------------------------

def check(condition, message):
    """Raise ValueError with `message` unless `condition`: for parameters, so that it survives `python -O`."""
    if not condition:
        raise ValueError(message)

def check_matcher_parameters(max_width, disparities, max_block_size):
    """Check the build-time parameters that the matcher and its cores share."""
    check(disparities % 16 == 0 and 16 <= disparities <= 128,
        f"disparities must be a multiple of 16 from 16 to 128, not {disparities}.")
    check(max_block_size % 2 == 1 and MIN_BLOCK_SIZE <= max_block_size <= 31,
        f"max_block_size must be odd and from {MIN_BLOCK_SIZE} to 31, not {max_block_size}.")
    check(disparities + max_block_size <= max_width <= 4096,
        f"max_width must be from disparities + max_block_size ({disparities + max_block_size}) to 4096, "
        f"not {max_width}.")

# Widths -------------------------------------------------------------------------------------------

def column_bits(max_block_size):
    """Bits of the sum of one block column's absolute differences."""
    return bits_for(max_block_size*(2**PIXEL_BITS - 1))

def cost_bits(max_block_size):
    """Bits of the cost of a whole block. Its largest value is never all ones: that marks a lane out of use."""
    return bits_for(max_block_size**2*(2**PIXEL_BITS - 1))

# Layouts ------------------------------------------------------------------------------------------

def pixel_pair_layout():
    """Left and right pixel of the same row and column, raster order, `first`/`last` mark the frame."""
    return [("left", PIXEL_BITS), ("right", PIXEL_BITS)]

def disparity_layout():
    """One pixel of the disparity map, raster order, `first`/`last` mark the frame."""
    return [("disparity", DISPARITY_BITS)]

def position_layout(max_width):
    """What the cores behind the raster know of a pixel's place: see `Raster` for the meaning."""
    return [
        ("column",     bits_for(max_width - 1)),
        ("row_first",  1),
        ("row_old",    1),
        ("column_first", 1),
        ("column_old", 1),
        ("complete",   1),
    ]

def lanes_layout(name, lanes, bits, max_width):
    """One number per disparity, lane 0 in the low bits, and the place of the pixel."""
    return [(name, lanes*bits)] + position_layout(max_width)

def lanes_of(signal, lanes):
    """The lanes of a wide signal as a list of slices."""
    bits = len(signal)//lanes
    return [signal[lane*bits:(lane + 1)*bits] for lane in range(lanes)]

def pass_position(module, sink, source, latency):
    """Delay valid and position from `sink` to `source` by `latency` clocks; return valid after each clock.

    Element i of the list is `valid` i clocks behind the sink, so element 0 is `sink.valid` itself.
    """
    fields = [name for name, *_ in position_layout(1) if hasattr(source, name)]
    stages = [sink]
    for _ in range(latency):
        stage = stream.Endpoint([(name, len(getattr(sink, name))) for name in fields])
        module.sync += [stage.valid.eq(stages[-1].valid)]
        module.sync += [getattr(stage, name).eq(getattr(stages[-1], name)) for name in fields]
        stages.append(stage)
    module.comb += [source.valid.eq(stages[-1].valid)]
    module.comb += [getattr(source, name).eq(getattr(stages[-1], name)) for name in fields]
    return stages
