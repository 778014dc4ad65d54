#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The seam of an engine: positioned pairs in, cost lanes out.

    front ── positioned_pair_layout ──> engine ── cost_layout ──> post

Front (`gateware/matcher`) and post (`gateware/post`) know of an engine only these two layouts and its `latency`. Both
ends are pipelines: `valid` without `ready`. The position tells a core what its step is for, so it is passed on with the
pixels, the sums and the costs.
"""

from migen import *

from litex.soc.interconnect import stream

from ..common import *

# Layouts ------------------------------------------------------------------------------------------

def position_layout(parameters):
    """Return the position of a step of the pipeline; `Raster` draws a frame of steps."""
    return [
        # Step of the raster, and what comes in with it.
        ("column",      bits_for(parameters.max_slots)),    # Number of the step in its row.
        ("take",        1),                                 # A pixel pair comes in, of column `column`.
        # Pixel of the filtered image.
        ("pixel",       1),                                 # The step is one,
        ("pixel_first", 1),                                 # the first of its row,
        ("pixel_last",  1),                                 # the last of its row,
        ("row_first",   1),                                 # in the first row,
        ("row_last",    1),                                 # in the last row,
        ("row_flat",    1),                                 # in a row that OpenCV does not filter.
        ("row_old",     1),                                 # The row block_size above exists: it leaves the sums.
        # Cost: which pixels meet, and which sums they go into.
        ("late",        1),                                 # The right image is delayed by `outer` columns more.
        ("move_left",   1),                                 # The left image moves on by a column.
        ("move_right",  1),                                 # The right image moves on by a column.
        ("cost",        1),                                 # All disparities lie in the right image: there is a cost,
        ("cost_column", bits_for(parameters.cost_columns)), # in this column of those that have one,
        ("cost_first",  1),                                 # which is the first: sums along the row begin anew.
        ("cost_old",    1),                                 # The column block_size back exists: it leaves the sums.
        ("complete",    1),                                 # The block that ends here lies in both images: a result.
    ]

def positioned_pair_layout(parameters):
    """Return what an engine gets: a filtered pixel pair, the one that leaves the block, and their position."""
    return old_pair_layout(parameters.filtered_bits) + position_layout(parameters)

def lanes_layout(name, bits, parameters):
    """Return one number per lane, lane 0 in the low bits, and the position."""
    return [(name, parameters.lanes*bits)] + position_layout(parameters)

def cost_layout(parameters):
    """Return what an engine gives: `costs`, a lane per disparity and then that of the texture, and the position."""
    return lanes_layout("costs", parameters.cost_bits, parameters)

# Position -----------------------------------------------------------------------------------------

_POSITION = {name for name, *_ in position_layout(MatcherParameters())}

def pass_position(module, sink, source, latency, valid=None):
    """Delay valid and position from `sink` to `source` by `latency` clocks.

    Parameters
    ----------
    module : LiteXModule
        Core that gets the registers.
    sink, source : stream.Endpoint
        Both with a position, or some of its fields.
    latency : int
        Clocks of delay.
    valid : Signal or expression
        Takes the place of `sink.valid`: for a core that leaves steps out.

    Returns
    -------
    list of stream.Endpoint
        Position after 0 to `latency` clocks; element 0 is `sink` itself.
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

# Engine -------------------------------------------------------------------------------------------

def check_engine(engine, parameters):
    """Raise ValueError unless `engine` has the endpoints and the latency of one."""
    name = type(engine).__name__
    for port, layout in [("sink", positioned_pair_layout(parameters)), ("source", cost_layout(parameters))]:
        endpoint = getattr(engine, port, None)
        check(endpoint is not None and list(endpoint.description.payload_layout) == layout,
            f"{name}.{port} must have the fields {', '.join(field for field, _ in layout)} in their widths.")
    check(isinstance(engine.latency, int) and engine.latency > 0,
        f"{name}.latency must be a number of clocks from 1 up, not {engine.latency}.")
