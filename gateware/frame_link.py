#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from .common          import *
from .frame_link_csr  import FrameLinkCSR
from .memory_port     import word_bytes
from .message         import *
from .message_buffer  import MessageBuffer
from .message_framer  import MessageFramer
from .message_sorter  import MessageSorter
from .send_queue      import SendQueue
from .slot_table      import SlotTable
from .stream_reader   import StreamReader
from .stream_writer   import StreamWriter

# Frame Link ---------------------------------------------------------------------------------------

class FrameLink(FrameLinkCSR, LiteXModule):
    """Images from datagrams to memory, and maps and the firmware's replies from memory to datagrams.

    Parameters
    ----------
    read_port, write_port : wishbone.Interface or LiteDRAMNativePort
        Ways to memory, of at least 32 bits.
    address : int
        IPv4 address of the device.
    port : int
        UDP port of the device.
    slots, max_chunks
        See `SlotTable`.
    mailbox_entries
        See `MessageSorter`.
    burst_bytes : int
        Bytes that are read or written in one go.
    """
    def __init__(self, read_port, write_port, address, port, slots=4, max_chunks=1024, mailbox_entries=8, burst_bytes=128,
        with_csr=True):
        self.sink   = stream.Endpoint(datagram_description()) # From LiteEth's UDP core.
        self.source = stream.Endpoint(datagram_description()) # To it.

        self.address         = address
        self.port            = port
        self.slots           = slots
        self.max_chunks      = max_chunks
        self.mailbox_entries = mailbox_entries
        self.alignment       = max(word_bytes(read_port), word_bytes(write_port)) # Bytes.

        self.matching = Signal() # The matcher is at work; for a counter.

        # # #

        # Cores.
        # ------
        self.buffer = buffer = MessageBuffer()
        self.table  = table  = SlotTable(slots, max_chunks)
        self.writer = writer = StreamWriter(write_port, 32, burst_bytes)
        self.sorter = sorter = MessageSorter(table, writer, mailbox_entries)
        self.reader = reader = StreamReader(read_port, 32, burst_bytes)
        self.queue  = queue  = SendQueue(reader)
        self.framer = framer = MessageFramer(port)

        # Streams.
        # --------
        self.comb += [
            self.sink.connect(buffer.sink),
            buffer.source.connect(sorter.sink),
            queue.source.connect(framer.sink),
            queue.payload.connect(framer.payload),
            framer.source.connect(self.source),
        ]

        # Counters.
        # ---------
        events = {
            "datagrams_received":    buffer.received,
            "datagrams_malformed":   buffer.malformed,
            "datagrams_overrun":     buffer.overrun,
            "mailbox_overrun":       sorter.mailbox_full,
            "uploads_foreign":       sorter.foreign,
            "uploads_unfit":         sorter.unfit,
            "chunks_received":       sorter.accepted,
            "chunks_repeated":       sorter.repeated,
            "chunks_while_matching": sorter.accepted & self.matching,
            "datagrams_sent":        framer.sent,
        }
        self.counters = {}
        for name, event in events.items():
            self.counters[name] = counter = Signal(32, name=name)
            self.sync += If(event, counter.eq(counter + 1))

        if with_csr:
            self.add_csr()
