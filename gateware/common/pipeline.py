#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What pipelines are built from: lanes, registers and delays, and the wiring between two cores."""

from migen import *

# Lanes --------------------------------------------------------------------------------------------

def lanes_of(signal, lanes):
    """Return the lanes of a wide signal as a list of slices, lane 0 from the low bits."""
    bits = len(signal)//lanes
    return [signal[lane*bits:(lane + 1)*bits] for lane in range(lanes)]

# Arithmetic ---------------------------------------------------------------------------------------

def sign_extended(signal, bits):
    """Return a number in two's complement as `bits` bits.

    Written out because migen and Verilog extend signed operands differently.
    """
    return Cat(signal, Replicate(signal[-1], bits - len(signal)))

# A number with a carry is the sum of both, not added up: `value` in the low bits, `carry` in the top bit. Adding the
# carry at once takes an adder; a later sum takes it at the carry input of an adder that is there anyway.

def with_carry(value, carry):
    """Return the number `value` + `carry`, a bit wider than `value`."""
    return Cat(value, carry)

def value_of(number):
    """Return the value of a number with a carry."""
    return number[:-1]

def carry_of(number):
    """Return the carry of a number with a carry, one bit."""
    return number[-1]

def only_if(condition, value):
    """Return `value`, or 0 without `condition`, for the input of a register.

    Synthesis makes a synchronous reset of it, which is free. A multiplexer after the register costs LUTs.
    """
    return Mux(condition, value, 0)

# Delays -------------------------------------------------------------------------------------------

def delayed(module, signal, clocks):
    """Return `signal` as it was `clocks` clocks ago.

    A reset clears what is one bit wide. Anything wider is data, which it leaves alone.
    """
    for _ in range(clocks):
        stage = Signal.like(signal, reset_less=len(signal) > 1)
        module.sync += stage.eq(signal)
        signal = stage
    return signal

# Wiring -------------------------------------------------------------------------------------------

def connect_pipeline(source, sink):
    """Return statements that connect two cores of the pipeline, whose endpoints have no ready."""
    return [sink.valid.eq(source.valid)] + [
        getattr(sink, name).eq(getattr(source, name)) for name, *_ in sink.description.payload_layout]
