#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

READ         = 0x03
PROGRAM      = 0x02
ERASE_SECTOR = 0x20
ENABLE       = 0x06
DISABLE      = 0x04
STATUS       = 0x05
ID           = 0x9f

JEDEC_ID     = 0xef4018 # Size of a chip that holds the images of every board.
SECTOR_BYTES = 4096

def flash_model_bytes(used_bytes):
    """Return the size of a model that has room for `used_bytes`: the next power of two."""
    return 1 << (used_bytes - 1).bit_length()

# Flash Model --------------------------------------------------------------------------------------

class FlashModel(LiteXModule):
    """SPI flash of the simulation, at pads as `SPIMaster` wants them: it is read, erased by sector and programmed by
    page.

    Its contents repeat every `size` bytes, so address 0 is the start of the board's first image. The pins are sampled
    in `sys`, whose CPU drives them, so no edge is missed. Its contents and its state survive a reset of the SoC only in
    a clock domain without a reset: see `ClockDomainsRenamer`.

    Parameters
    ----------
    size : int
        Bytes, a power of 2.
    program_clocks, erase_clocks : int
        Clocks for which it is busy programming a page, and erasing a sector.
    """
    def __init__(self, size, program_clocks=700, erase_clocks=45000):
        self.clk  = Signal()
        self.cs_n = Signal()
        self.mosi = Signal()
        self.miso = Signal()

        # # #

        # With contents from the start, the memory loads its file.
        memory = Memory(32, size//4, init=[0], name="flash")
        port   = memory.get_port(write_capable=True, async_read=True)
        self.specials += memory, port

        clk_before  = Signal()
        cs_n_before = Signal()
        rising      = Signal()
        falling     = Signal()
        deselected  = Signal() # Chip select rises: the command ends.
        self.sync += [
            clk_before.eq(self.clk),
            cs_n_before.eq(self.cs_n),
        ]
        self.comb += [
            rising.eq( ~self.cs_n &  self.clk & ~clk_before),
            falling.eq(~self.cs_n & ~self.clk &  clk_before),
            deselected.eq(self.cs_n & ~cs_n_before),
        ]

        # Command, address, and the data after them.
        bits     = Signal(6)                # Bits of both received; 33 once the first bit of data is shown.
        command  = Signal(8)
        position = Signal(log2_int(size*8)) # Bit that is shown, most significant first.
        data     = Signal(8)                # Byte to be programmed.
        count    = Signal(3)                # Bits of `data` received.
        bytes_in = Signal()                 # A whole byte was received.
        byte_end = Signal()
        busy     = Signal(max=erase_clocks + 1)
        enabled  = Signal()
        self.comb += byte_end.eq(rising & (bits >= 32) & (count == 7))
        self.sync += [
            If(self.cs_n,
                bits.eq(0),
                count.eq(0),
                bytes_in.eq(0)
            ).Elif(rising & (bits < 32),
                bits.eq(bits + 1),
                If(bits < 8,
                    command.eq(Cat(self.mosi, command[:-1]))
                ),
                position.eq(Cat(0, 0, 0, self.mosi, position[3:-1]))
            ).Elif(rising,
                data.eq(Cat(self.mosi, data[:-1])),
                count.eq(count + 1),
                If(byte_end & (command == PROGRAM),
                    bytes_in.eq(1),
                    # The address wraps around within its page.
                    position[3:11].eq(position[3:11] + 1)
                )
            ).Elif(falling & (bits == 32),
                # The first bit of data follows the falling edge after the last bit of the address.
                bits.eq(33)
            ).Elif(falling & (bits == 33) & (command == READ),
                position.eq(position + 1)
            )
        ]

        # Output.
        status = Signal(8)
        reply  = Signal(24)
        self.comb += [
            status.eq(Cat(busy != 0, enabled)),
            self.miso.eq(Mux(command == READ, port.dat_r >> Cat(~position[:3], position[3:5]), reply[-1])),
        ]
        self.sync += If(falling,
            reply.eq(Cat(1, reply[:-1])),
            If(bits == 8,
                If(command == STATUS,
                    reply.eq(Cat(status, status, status))
                ).Elif((command == ID) & (busy == 0),
                    reply.eq(JEDEC_ID)
                ).Else(
                    reply.eq(0xffffff)
                )
            )
        )

        # Erase and program.
        erasing    = Signal()
        erase_word = Signal(log2_int(size//4))
        zeros      = Signal(32) # Zeros of the byte to be programmed, at its place in the word.
        self.comb += [
            zeros.eq((~Cat(self.mosi, data[:-1]) & 0xff) << Cat(0, 0, 0, position[3:5])),
            If(erasing,
                port.adr.eq(erase_word),
                port.dat_w.eq(0xffffffff),
                port.we.eq(1)
            ).Else(
                port.adr.eq(position[5:]),
                port.dat_w.eq(port.dat_r & ~zeros),
                port.we.eq(byte_end & (command == PROGRAM) & enabled & (busy == 0))
            )
        ]
        self.sync += [
            If(busy != 0,
                busy.eq(busy - 1)
            ).Elif(deselected,
                If((command == ENABLE) & (bits == 8),
                    enabled.eq(1)
                ).Elif((command == DISABLE) & (bits == 8),
                    enabled.eq(0)
                ).Elif(enabled & (command == PROGRAM) & bytes_in,
                    enabled.eq(0),
                    busy.eq(program_clocks)
                ).Elif(enabled & (command == ERASE_SECTOR) & (bits >= 32),
                    enabled.eq(0),
                    busy.eq(erase_clocks),
                    erasing.eq(1),
                    erase_word.eq(Cat(Constant(0, log2_int(SECTOR_BYTES//4)), position[log2_int(SECTOR_BYTES*8):]))
                )
            ),
            If(erasing,
                erase_word.eq(erase_word + 1),
                erasing.eq(erase_word[:log2_int(SECTOR_BYTES//4)] != SECTOR_BYTES//4 - 1)
            ),
        ]
