#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What each master of the main memory does in each clock, for the module memory2file; in simulation only."""

import json
import os
from functools import reduce
from operator  import and_, or_

from migen import *

from litex.gen import *

from litex.soc.interconnect import wishbone

EVENTS = 32 # Width of the pads.

# Masters of the memory, in the order in which a SoC asks for their ports.
MATCHER = ["matcher_reader", "matcher_writer"]
LINK    = ["link_reader", "link_writer"]

# Memory Monitor -----------------------------------------------------------------------------------

class MemoryMonitor(LiteXModule):
    """Show the events of a clock as bits, and name them.

    `NAME_words` is a word that NAME's port takes or gives, `NAME_waits` a clock in which it waits for one.

    Parameters
    ----------
    soc : StereoSoC
        SoC whose ports have all been asked for.
    events : Signal
        Pads of `EVENTS` bits.
    """
    def __init__(self, soc, events):
        self.names = []
        self.bits  = []

        # # #

        self.add_cpu(soc)
        dma = [*MATCHER, *(LINK if hasattr(soc, "frame_link") else [])]
        if hasattr(soc, "sdram"):
            lines = ["cpu_lines"] if hasattr(soc, "line_reader") else []
            self.add_ports(["cpu", *dma, *lines, "screen"], soc.sdram.crossbar.masters)
            self.add_commands(soc.sdram.controller)
        else:
            self.add_ports(dma, soc.memory.masters)
        self.comb += events.eq(Cat(*self.bits))

    def add_event(self, name, expression):
        """Add an event, as the next bit."""
        assert len(self.bits) < EVENTS
        self.names.append(name)
        self.bits.append(expression)

    def add_cpu(self, soc):
        """Count the CPU's own accesses to main memory: of instructions and of data."""
        region = soc.bus.regions["main_ram"]
        for name, bus in [("cpu_instructions", soc.cpu.ibus), ("cpu_data", soc.cpu.dbus)]:
            inside = Signal()
            shift  = log2_int(bus.data_width//8)
            self.comb += inside.eq(bus.cyc & bus.stb & (bus.adr >= region.origin >> shift)
                & (bus.adr < (region.origin + region.size) >> shift))
            self.add_event(f"{name}_words", inside & bus.ack)
            self.add_event(f"{name}_waits", inside & ~bus.ack)

    def add_ports(self, names, ports):
        """Count the words of each port, and the clocks in which it waits."""
        waits = Signal()
        takes = Signal()
        for name, port in zip(names, ports):
            if isinstance(port, wishbone.Interface):
                valid, ready = port.cyc & port.stb, port.ack
            else:
                valid, ready = port.cmd.valid, port.cmd.ready
            self.add_event(f"{name}_words", valid & ready)
            self.add_event(f"{name}_waits", valid & ~ready)
        self.comb += [
            takes.eq(reduce(or_, self.bits[-2*len(ports)::2])),
            waits.eq(reduce(or_, self.bits[-2*len(ports) + 1::2])),
        ]
        self.add_event("idle", ~takes & ~waits)

    def add_commands(self, controller):
        """Count the commands to the chip."""
        commands = {
            "activations": (0, 1, 1),
            "reads":       (1, 0, 1),
            "writes":      (1, 0, 0),
            "precharges":  (0, 1, 0),
            "refreshes":   (0, 0, 1),
        }
        for name, levels in commands.items():
            self.add_event(name, reduce(or_, [
                ~phase.cs_n[0] & reduce(and_, [signal if level else ~signal
                    for signal, level in zip((phase.ras_n, phase.cas_n, phase.we_n), levels)])
                for phase in controller.dfi.phases]))

    def write_names(self, folder):
        """Write the names of the events, in the order of their bits, to `memory.json`."""
        with open(os.path.join(folder, "memory.json"), "w") as file:
            json.dump(self.names, file)
