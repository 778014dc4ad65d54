#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ..common  import *
from .layouts  import *

def times(signal, constant):
    """Return `signal` times a positive constant, as a sum of shifted copies: synthesis makes no DSP block of it."""
    copies = [signal << bit for bit in range(bits_for(constant)) if constant >> bit & 1]
    return sum(copies[1:], copies[0])

# Row Ring -----------------------------------------------------------------------------------------

@ResetInserter()
class RowRing(LiteXModule):
    """The newest rows of an image, of which any 2 x 2 pixels can be read in each clock.

    Four banks, by parity of track and column: each has exactly one of the four pixels. A track, the memory of a row,
    is `bank_columns` words of two banks. The next row is in the next track; after the last one comes track 0, and as
    their number is even, the parity alternates there too.

    A pixel is written as many clocks after it came in as addresses are read after theirs came in. So what counts is the
    order at `write` and `sink`: a position reads all that was written in clocks before its own.
    """
    def __init__(self, parameters):
        self.write  = stream.Endpoint(ring_write_layout(parameters))    # Pipeline: pixels of the camera.
        self.sink   = stream.Endpoint(ring_position_layout(parameters)) # Pipeline: what to read.
        self.source = stream.Endpoint(neighbours_layout())              # Pipeline: the pixels there.

        self.latency = 4 # Row of the bank, address, memory, choice of the bank.

        # # #

        self.parameters = parameters
        self.add_choice(self.add_banks(self.add_writes(), self.add_addresses()))

    def add_writes(self):
        """Return the write of a pixel at clock 2: address, pixel, and an enable for each bank by row and column."""
        parameters = self.parameters
        write      = self.write
        base       = Signal(max=parameters.bank_words + 1)
        address    = Signal(max=parameters.bank_words + 1)
        enables    = [[Signal() for _ in range(2)] for _ in range(2)]
        valid      = delayed(self, write.valid,     1)
        odd_row    = delayed(self, write.track[0],  1)
        column     = delayed(self, write.column,    1)
        pixel      = delayed(self, write.pixel,     2)
        self.sync += [
            base.eq(times(write.track[1:], parameters.bank_columns)),
            address.eq(base + column[1:]),
            [enables[row][odd].eq(valid & (odd_row == row) & (column[0] == odd))
                for row in range(2) for odd in range(2)],
        ]
        return address, pixel, enables

    def add_addresses(self):
        """Return the address in each bank at clock 2, by parity of row and column."""
        parameters = self.parameters
        sink       = self.sink
        # The even one of two neighbours is the next one if the first is odd; the odd one has the number of the first.
        tracks     = [Signal(max=parameters.rows//2 + 1) for _ in range(2)]
        next_track = Signal(max=parameters.rows//2 + 1)
        columns    = [Signal(parameters.position_bits - 1) for _ in range(2)]
        self.comb += [
            next_track.eq(sink.track[1:] + sink.track[0]),
            tracks[0].eq(Mux(next_track == parameters.rows//2, 0, next_track)),
            tracks[1].eq(sink.track[1:]),
            columns[0].eq(sink.column[1:] + sink.column[0]),
            columns[1].eq(sink.column[1:]),
        ]
        # A column outside of the image is read at 0: it does not count, but an address beyond the bank is no address.
        inside  = [Mux(sink.column[0] == odd, sink.columns_inside[0], sink.columns_inside[1]) for odd in range(2)]
        bases   = [Signal(max=parameters.bank_words) for _ in range(2)]
        places  = [Signal(max=parameters.bank_columns) for _ in range(2)]
        address = [[Signal(max=parameters.bank_words) for _ in range(2)] for _ in range(2)]
        self.sync += [
            [base.eq(times(track, parameters.bank_columns)) for base, track in zip(bases, tracks)],
            [place.eq(only_if(counts, column)) for place, counts, column in zip(places, inside, columns)],
            [address[row][odd].eq(bases[row] + places[odd]) for row in range(2) for odd in range(2)],
        ]
        return address

    def add_banks(self, writes, addresses):
        """Return the word of each bank at clock 3, by parity of row and column."""
        write_address, pixel, enables = writes
        words = [[None, None], [None, None]]
        for row in range(2):
            for odd in range(2):
                memory = Memory(PIXEL_BITS, self.parameters.bank_words, name="row_ring")
                read   = memory.get_port(mode=READ_FIRST)
                write  = memory.get_port(write_capable=True, mode=READ_FIRST)
                self.specials += memory, read, write
                self.comb += [
                    read.adr.eq(addresses[row][odd]),
                    write.adr.eq(write_address),
                    write.dat_w.eq(pixel),
                    write.we.eq(enables[row][odd]),
                ]
                words[row][odd] = read.dat_r
        return words

    def add_choice(self, words):
        """Give each of the four pixels the word of its bank, or 0, at clock 4."""
        sink, source = self.sink, self.source
        # Of the clock in which the words are there.
        odd_row      = delayed(self, sink.track[0], 3)
        odd_column   = delayed(self, sink.column[0], 3)
        rows         = delayed(self, sink.rows_inside, 3)
        columns      = delayed(self, sink.columns_inside, 3)
        for row in range(2):
            for column in range(2):
                # The bank has the parity of the first one, or the other parity.
                chosen = [Mux(odd_column, bank[1 - column], bank[column]) for bank in words]
                word   = Mux(odd_row, chosen[1 - row], chosen[row])
                self.sync += getattr(source, f"p{row}{column}").eq(only_if(rows[row] & columns[column], word))
        self.comb += [
            source.valid.eq(delayed(self, sink.valid, self.latency)),
            source.column_fraction.eq(delayed(self, sink.column_fraction, self.latency)),
            source.row_fraction.eq(delayed(self, sink.row_fraction, self.latency)),
        ]
