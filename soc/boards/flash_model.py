#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

# Flash Model --------------------------------------------------------------------------------------

class FlashModel(LiteXModule):
    """A SPI flash of the simulation, at pads as `SPIMaster` wants them: it answers the command READ, and no other.

    Its contents repeat every `size` bytes: address 0 is wherever the board's first image is. The pins are looked at in `sys`,
    whose CPU drives them, so an edge is never missed.

    Parameters
    ----------
    size : int
        Bytes, a power of 2.
    """
    def __init__(self, size):
        self.clk  = Signal()
        self.cs_n = Signal()
        self.mosi = Signal()
        self.miso = Signal()

        # # #

        # First contents, for the memory to load its file.
        memory = Memory(32, size//4, init=[0], name="flash")
        port   = memory.get_port(async_read=True)
        self.specials += memory, port

        clk_before = Signal()
        bits       = Signal(6)                # Of command and address.
        shift      = Signal(32)               # Both, when all bits are in.
        position   = Signal(log2_int(size*8)) # Bit that is shown, the highest one of a byte first.
        self.comb += [
            port.adr.eq(position[5:]),
            self.miso.eq(port.dat_r >> Cat(~position[:3], position[3:5])),
        ]
        self.sync += [
            clk_before.eq(self.clk),
            If(self.cs_n,
                bits.eq(0)
            ).Elif(self.clk & ~clk_before & (bits < 32),
                bits.eq(bits + 1),
                shift.eq(Cat(self.mosi, shift[:-1])),
                position.eq(Cat(0, 0, 0, self.mosi, shift[:len(position) - 4]))
            ).Elif(~self.clk & clk_before & (bits == 32),
                # The first bit comes with the falling edge behind the last one of the address.
                bits.eq(33)
            ).Elif(~self.clk & clk_before & (bits == 33),
                position.eq(position + 1)
            ),
        ]
