#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Names of signals in emitted Verilog, independent of what else the process has made."""

from contextlib import contextmanager

from migen.fhdl.tools import list_signals, list_special_ios

from litex.gen.fhdl import verilog

@contextmanager
def names_in_order():
    """Number signals that claim one name in the order in which they were made, in all Verilog that is emitted inside.

    LiteX numbers them in the order in which a set of all signals has them. That depends on how many signals the process
    has made before, of other designs or of stages that a board does not have. So the clocks of the SDRAM's pads, all
    `sdrio_clk`, would have other numbers after any change of gateware, and each bitstream another key.
    """
    generate = verilog._generate_signals

    def generate_in_order(fragment, ios, name, namespace, *arguments):
        signals = list_signals(fragment) | list_special_ios(fragment, ins=True, outs=True, inouts=True)
        # The ports have their names already, and keep them.
        for signal in sorted(signals - ios, key=lambda signal: signal.duid):
            namespace.get_name(signal)
        return generate(fragment, ios, name, namespace, *arguments)

    verilog._generate_signals = generate_in_order
    try:
        yield
    finally:
        verilog._generate_signals = generate
