#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ..common import *
from .message import *

# Map Parts ----------------------------------------------------------------------------------------

class MapParts(LiteXModule):
    """Keep parts of the map that is being computed until they are sent, each as a message.

    The matcher does not wait for the wire: a part that finds no room when it begins is left out. Memory has the whole
    map. It is reset with its clock domain alone.

    Parameters
    ----------
    parts : int
        Room, in parts of 1024 bytes; a power of 2.
    """
    def __init__(self, parts=4):
        check(parts >= 2 and parts & (parts - 1) == 0, f"parts must be a power of 2, at least 2, not {parts}.")
        self.sink    = stream.Endpoint(disparity_layout()) # Pixels of the map, the last one marked. Never stalls.
        # Receiver of the parts, and fields of their header: taken over by `open`.
        self.job     = Record(peer_layout() + [("session", 32), ("sequence", 32), ("frame_id", 32)])
        self.open    = Signal()                            # Begin a map (pulse). Not while sending, nor within a map.
        self.close   = Signal()                            # Give the map up (pulse).
        self.sending = Signal()                            # Parts wait to be sent, or one is being sent.
        self.taken   = Signal()                            # The offered message is being sent, and has to stay.
        self.source  = stream.Endpoint(job_layout())       # Messages.
        self.payload = stream.Endpoint([("data", 32)])     # Their payloads.
        self.latency = None                                # A part waits for its last pixel, and for the parts before.

        # # #

        memory = Memory(32, parts*CHUNK_BYTES//4, name="map_parts")
        write  = memory.get_port(write_capable=True, mode=READ_FIRST)
        read   = memory.get_port(mode=READ_FIRST)
        self.specials += memory, write, read
        self.fifo = stream.SyncFIFO([("offset", 32), ("length", 11)], parts) # Parts that wait.

        self.add_pixels(write, parts)
        self.add_messages()
        self.add_payload(read, parts)

    def add_pixels(self, write, parts):
        """Cut the map into parts, and keep those that find room."""
        sink, fifo = self.sink, self.fifo
        active  = Signal()                   # Pixels of the map are missing.
        offset  = Signal(32)                 # Of the part in the map.
        pixel   = Signal(max=CHUNK_BYTES//2) # Number of the pixel in the part.
        held    = Signal(DISPARITY_BITS)     # The pixel before, if that is the first of its word.
        place   = Signal(max=parts)          # Where the part is kept.
        omit    = Signal()                   # The part is left out, as decided with its first pixel,
        omitted = Signal()                   # and remembered for the others.
        ends    = Signal()                   # The pixel is the last of the part.
        self.comb += [
            sink.ready.eq(1),
            omit.eq(Mux(pixel == 0, ~fifo.sink.ready, omitted)),
            ends.eq(sink.valid & active & (sink.last | (pixel == CHUNK_BYTES//2 - 1))),
            write.adr.eq(Cat(pixel[1:], place)),
            write.dat_w.eq(Mux(pixel[0], Cat(held, sink.disparity), sink.disparity)),
            write.we.eq(sink.valid & active & ~omit & (pixel[0] | sink.last)),
            fifo.sink.valid.eq(ends & ~omit),
            fifo.sink.offset.eq(offset),
            fifo.sink.length.eq(Cat(C(0, 1), pixel) + 2),
        ]
        self.sync += [
            If(sink.valid & active,
                held.eq(sink.disparity),
                omitted.eq(omit),
                pixel.eq(pixel + 1),
                If(ends,
                    pixel.eq(0),
                    offset.eq(offset + CHUNK_BYTES),
                    If(~omit,
                        place.eq(place + 1)
                    ),
                    If(sink.last,
                        active.eq(0)
                    )
                )
            ),
            If(self.open,
                active.eq(1),
                offset.eq(0),
                pixel.eq(0)
            ),
            If(self.close,
                active.eq(0)
            ),
        ]

    def add_messages(self):
        """Offer the parts as messages; discard those of a map that was given up, except for one that is being sent."""
        fifo     = self.fifo
        header   = Record([*self.job.layout], name="part_header")
        dropping = Signal() # The map was given up, and parts of it wait.
        self.comb += [
            fifo.source.ready.eq(Mux(self.taken, self.source.ready, dropping)),
            self.source.valid.eq(fifo.source.valid & (self.taken | ~dropping)),
            self.source.type.eq(TYPE_READ | REPLY_BIT),
            self.source.offset.eq(fifo.source.offset),
            self.source.length.eq(fifo.source.length),
            [getattr(self.source, name).eq(getattr(header, name)) for name, *_ in self.job.layout],
            self.sending.eq(fifo.source.valid),
        ]
        self.sync += [
            If(self.open,
                [getattr(header, name).eq(getattr(self.job, name)) for name, *_ in self.job.layout]
            ),
            If(self.close,
                dropping.eq(1)
            ).Elif(~fifo.source.valid,
                dropping.eq(0)
            ),
        ]

    def add_payload(self, read, parts):
        """Read the payload of the first part that waits, a word ahead: block RAM takes half a clock to show a word."""
        first     = Signal(max=parts)          # Where it is kept.
        index     = Signal(max=CHUNK_BYTES//4) # Number of its next word,
        following = Signal(max=CHUNK_BYTES//4) # and the same a clock later.
        there     = Signal()                   # The memory shows that word,
        takes     = Signal()                   # and the register takes it.
        loaded    = Signal()                   # The register has a word.
        popped    = Signal()                   # The part is sent or discarded.
        self.comb += [
            popped.eq(self.fifo.source.valid & self.fifo.source.ready),
            takes.eq(~loaded | self.payload.ready),
            following.eq(index + (there & takes)),
            read.adr.eq(Cat(following, first)),
            self.payload.valid.eq(loaded),
        ]
        self.sync += [
            index.eq(following),
            there.eq(self.fifo.source.valid & ~popped),
            If(takes,
                loaded.eq(there),
                self.payload.data.eq(read.dat_r)
            ),
            If(popped,
                first.eq(first + 1),
                index.eq(0),
                loaded.eq(0)
            ),
        ]
