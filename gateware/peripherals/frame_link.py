#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ..common               import *
from ..link.event_counters  import EventCounters
from ..link.map_parts       import MapParts
from ..link.message         import *
from ..link.message_arbiter import MessageArbiter
from ..link.message_buffer  import MessageBuffer
from ..link.message_framer  import MessageFramer
from ..link.message_sorter  import MessageSorter
from ..link.pair_gate       import PairGate
from ..link.send_queue      import SendQueue
from ..link.slot_table      import SlotTable
from ..memory.ports         import word_bytes
from ..memory.stream_reader import StreamReader
from ..memory.stream_writer import StreamWriter
from .frame_link_csr        import FrameLinkCSR

# Frame Link ---------------------------------------------------------------------------------------

class FrameLink(FrameLinkCSR, LiteXModule):
    """Write images from datagrams to memory, and send maps and the firmware's replies from memory as datagrams.

    Streamed frames bypass memory: pairs go from datagrams to `pairs`, and the map from `map` to datagrams.

    It is reset with its clock domain alone.

    Parameters
    ----------
    read_port, write_port : wishbone.Interface or LiteDRAMNativePort
        Memory ports, of at least 32 bits.
    port : int
        UDP port of the device.
    slots, max_chunks
        See `SlotTable`.
    mailbox_entries
        See `MessageSorter`.
    burst_bytes : int
        Bytes of a burst, to read or to write.
    streaming : bool
        Build what streamed frames need.
    pipelined : bool
        See `SlotTable`; the registers then need a bus bridge with registers, as that of an SoC with SDRAM.
    with_csr : bool
        Add the registers; without them the Signals of the cores are driven from outside.
    """
    def __init__(self, read_port, write_port, port, slots=4, max_chunks=1024, mailbox_entries=8,
        burst_bytes=128, streaming=False, pipelined=False, with_csr=True):
        self.sink     = stream.Endpoint(datagram_description()) # Datagrams from the network.
        self.source   = stream.Endpoint(datagram_description()) # Datagrams to it.
        self.pairs    = stream.Endpoint(pixel_pair_layout())    # Pairs of a streamed frame.
        self.map      = stream.Endpoint(disparity_layout())     # Its map, as it goes to memory; never stalls.
        self.matching = Signal()                                # The matcher is at work; for a counter.
        self.latency  = None                                    # Depends on memory and on the wire.
        # Addresses for the network, from the registers.
        self.mac_high = Signal(16) # MAC address of the device, its first 2 bytes,
        self.mac_low  = Signal(32) # and the others.
        self.netmask  = Signal(32) # Netmask of its subnet.
        self.gateway  = Signal(32) # IPv4 address of the gateway, 0: none,
        self.address  = Signal(32) # and of the device.

        self.port            = port
        self.slots           = slots
        self.max_chunks      = max_chunks
        self.mailbox_entries = mailbox_entries
        self.streaming       = streaming
        self.alignment       = max(word_bytes(read_port), word_bytes(write_port)) # Bytes.

        # # #

        self.buffer = buffer = MessageBuffer()
        self.table  = table  = SlotTable(slots, max_chunks, pipelined)
        self.writer = writer = StreamWriter(write_port, 32, burst_bytes)
        self.gate   = gate   = PairGate() if streaming else None
        self.sorter = sorter = MessageSorter(table, writer, mailbox_entries, gate)
        self.reader = reader = StreamReader(read_port, 32, burst_bytes)
        self.queue  = queue  = SendQueue(reader)
        self.framer = framer = MessageFramer(port)

        self.comb += [
            self.sink.connect(buffer.sink),
            buffer.source.connect(sorter.sink),
            framer.source.connect(self.source),
        ]
        if streaming:
            self.add_streaming()
        else:
            self.comb += [
                queue.source.connect(framer.sink),
                queue.payload.connect(framer.payload),
            ]

        self.add_counters()
        if with_csr:
            self.add_csr()

    def add_counters(self):
        """Count what happens: the events in the order of `COUNTERS`."""
        buffer, sorter, framer = self.buffer, self.sorter, self.framer
        self.counters = EventCounters([
            buffer.received,
            buffer.malformed,
            buffer.overrun,
            sorter.mailbox_full,
            sorter.foreign,
            sorter.unfit,
            sorter.accepted,
            sorter.repeated,
            sorter.stored & self.matching,
            framer.sent,
        ])

    def add_streaming(self):
        """Add the path of streamed frames: pairs to the matcher, and parts of the map between the other messages."""
        gate, sorter, framer = self.gate, self.sorter, self.framer
        self.parts    = parts   = MapParts()
        self.arbiter  = arbiter = MessageArbiter()
        self.sequence = Signal(32) # Of the parts of the map.
        self.comb += [
            gate.source.connect(self.pairs),
            self.map.connect(parts.sink),
            parts.open.eq(gate.open),
            parts.close.eq(gate.close),
            parts.job.address.eq(sorter.peer_address),
            parts.job.port.eq(sorter.peer_port),
            parts.job.session.eq(sorter.token),
            parts.job.sequence.eq(self.sequence),
            parts.job.frame_id.eq(gate.frame_id),
            parts.taken.eq(arbiter.taken[1]),
            arbiter.source.connect(framer.sink),
            arbiter.payload.connect(framer.payload),
        ]
        for n, core in enumerate([self.queue, parts]):
            self.comb += [
                core.source.connect(arbiter.sinks[n]),
                core.payload.connect(arbiter.payloads[n]),
            ]
