#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.soc.interconnect.csr import *
from litex.soc.integration.doc  import ModuleDoc

from ..link.event_counters import COUNTER_NUMBERS

LINK_VERSION = (0, 4) # Of the register interface: major, minor.

STAGED_JOB = {
    "address":  "IPv4 address of the peer that gets the message.",
    "port":     "UDP port of that peer.",
    "type":     "Type of the message.",
    "session":  "Session of the message.",
    "sequence": "Sequence of the message.",
    "frame_id": "Frame id of the message.",
    "offset":   "Offset of the message; it grows by 1024 with each message of a burst.",
    "base":     "Byte address of the payload, a multiple of ``alignment``; it grows as the offset does.",
    "length":   "Bytes of payload: of a reply 0 to 1024, of a burst any number.",
}

COUNTERS = {
    "datagrams_received":    "Datagrams that came to the port.",
    "datagrams_malformed":   "Datagrams dropped: wrong length, magic or CRC.",
    "datagrams_overrun":     "Messages dropped: they came faster than memory takes them.",
    "mailbox_overrun":       "Messages dropped: the mailbox was full.",
    "uploads_foreign":       "Chunks dropped: not of the session, or not from its peer.",
    "uploads_unfit":         "Chunks dropped: no open slot has such a frame, or the frame has no such chunk; or, of a "
                             "streamed frame, it was not the next one.",
    "chunks_received":       "Chunks written, or passed to the matcher.",
    "chunks_repeated":       "Chunks dropped: they had come before.",
    "chunks_while_matching": "Chunks written to memory while the matcher was at work.",
    "datagrams_sent":        "Datagrams sent.",
}

# Frame Link CSR -----------------------------------------------------------------------------------

class FrameLinkCSR:
    """Registers of the frame link."""

    def add_csr(self):
        self.intro = ModuleDoc("""Frame link

        Receives messages of the link protocol in UDP datagrams. UPLOADs are written to the slot of their frame; all
        other messages to the mailbox, for the software. Sends messages whose payload is in memory.

        To begin: write ``mac_high``, ``mac_low``, ``netmask`` and ``gateway``, then ``address``, which starts the
        network; write ``mailbox_base``, then 1 to ``enable`` in ``control``. For each message in the mailbox: read it,
        and write ``mailbox_consumed``. Entry n is at ``mailbox_base`` + (n modulo ``mailbox_entries``) x 2048: address
        of its sender (4 bytes), port (2), length of the message (2), message. Messages are whole, and their CRC is
        correct.

        To receive a frame: write ``token``, ``peer_address`` and ``peer_port``; stage the frame in ``slot_*`` and open
        its slot. ``missing`` and ``arrived`` tell what has come. Close the slot, and wait while ``writing`` names it,
        before its memory is used for anything else.

        To send: stage the message in ``send_*`` and write 1 to ``reply``, or to ``run`` for a burst, such as a whole
        map.

        To receive a streamed frame: stage it in ``stream_*``, open the stream, then start the matcher with ``streamed``
        in its ``options``. The stream closes itself with the last pair. To give the frame up, abort the matcher, then
        close the stream.

        To read a counter: write its number to ``counter_index``, then read ``counter``.

        A CPU with a data cache has to invalidate its lines of the mailbox before it reads a message.
        """)
        self.add_capabilities()
        self.add_addresses()
        self.add_session()
        self.add_slots()
        self.add_mailbox()
        self.add_sender()
        self.add_status("streaming", 1, int(self.streaming), "1: streamed frames are supported.")
        if self.streaming:
            self.add_stream()
        self.add_counter()

    def add_status(self, name, size, value, description):
        """Add a register that shows a value."""
        status = CSRStatus(size, name=name, description=description)
        setattr(self, f"_{name}", status)
        self.comb += status.status.eq(value)

    def add_storage(self, name, signal, description):
        """Add a register that drives a Signal."""
        storage = CSRStorage(len(signal), name=name, description=description)
        setattr(self, f"_{name}", storage)
        self.comb += signal.eq(storage.storage)

    def add_capabilities(self):
        """Add what the frame link is built for."""
        major, minor = LINK_VERSION
        self.add_status("version",         16, major << 8 | minor,    "Version of the registers: major x 256 + minor.")
        self.add_status("slots",            8, self.slots,            "Slots.")
        self.add_status("max_chunks",      16, self.max_chunks,       "Most chunks of a frame, both images.")
        self.add_status("mailbox_entries",  8, self.mailbox_entries,  "Messages that the mailbox holds.")
        self.add_status("alignment",       16, self.alignment,        "Bytes that each base is a multiple of.")
        self.add_status("port",            16, self.port,             "UDP port of the device.")

    def add_addresses(self):
        """Add the addresses of the device, which are 0 after a reset."""
        self.add_storage("mac_high", self.mac_high, "MAC address of the device; of 10:e2:d5:00:00:02 this is 0x10e2,")
        self.add_storage("mac_low",  self.mac_low,  "and this 0xd5000002.")
        self.add_storage("netmask",  self.netmask,  "Netmask of its subnet; 255.255.255.0 is 0xffffff00.")
        self.add_storage("gateway",  self.gateway,  "IPv4 address of the gateway to other subnets; 0: there is none, "
                                                    "and all hosts are looked for on the same wire.")
        self.add_storage("address",  self.address,  "IPv4 address of the device; 192.168.1.50 is 0xc0a80132. While its "
                                                    "highest byte is 0, nothing is received or sent.")

    def add_session(self):
        """Add the switch and the session."""
        self._control = CSRStorage(name="control", fields=[
            CSRField("enable", size=1, description="Receive messages; otherwise all are discarded.")])
        self.comb += self.sorter.enable.eq(self._control.fields.enable)
        self.add_storage("token",        self.sorter.token,        "Token of the session; 0 if there is none.")
        self.add_storage("peer_address", self.sorter.peer_address, "IPv4 address of the session's peer.")
        self.add_storage("peer_port",    self.sorter.peer_port,    "UDP port of the session's peer.")

    def add_slots(self):
        """Add the slots and what has arrived of their frames."""
        table = self.table
        self.add_storage("slot_frame_id", table.frame_id, "Id of the frame to open.")
        self.add_storage("slot_base",     table.base,     "Byte address of its left image, a multiple of "
                                                          "``alignment``.")
        self.add_storage("slot_pixels",   table.pixels,   "Pixels of one image; the right image begins that many bytes "
                                                          "after the left image, rounded up to whole chunks of 1024.")
        self._slot_control = CSRStorage(name="slot_control", fields=[
            CSRField("slot",  size=4, offset=0, description="Slot."),
            CSRField("open",  size=1, offset=8, pulse=True,
                description="Write 1 to open it for the staged frame. Not while clearing."),
            CSRField("close", size=1, offset=9, pulse=True, description="Write 1 to close it."),
        ])
        self._slot_status = CSRStatus(name="slot_status", fields=[
            CSRField("clearing", size=1, offset=0, description="A slot that was opened is not ready yet."),
            CSRField("writing",  size=1, offset=1, description="A chunk is on its way to memory."),
            CSRField("slot",     size=4, offset=4, description="Slot of that chunk."),
        ])
        self.comb += [
            table.slot.eq(self._slot_control.fields.slot),
            table.open.eq(self._slot_control.fields.open),
            table.close.eq(self._slot_control.fields.close),
            self._slot_status.fields.clearing.eq(table.clearing),
            self._slot_status.fields.writing.eq(self.sorter.writing),
            self._slot_status.fields.slot.eq(table.found),
        ]
        self.add_storage("arrived_index", table.arrived_index,
            "Word of ``arrived`` to read: slot x (``max_chunks`` / 32) + word.")
        self.add_status("arrived", 32, table.arrived,
            "A bit per chunk, 1 if it is in memory; bit i of word w is chunk 32 x w + i.")
        self.add_status("missing", 16, table.missing, "Chunks missing of the slot that ``arrived_index`` names.")

    def add_mailbox(self):
        """Add the mailbox's place and its two counters."""
        sorter = self.sorter
        self.add_storage("mailbox_base",     sorter.mailbox_base,
            "Byte address of the mailbox, a multiple of ``alignment``.")
        self.add_status("mailbox_produced", 8, sorter.produced,   "Messages ever put in, modulo 256.")
        self.add_storage("mailbox_consumed", sorter.consumed,     "Messages ever taken out, modulo 256.")

    def add_sender(self):
        """Add the staged message and what becomes of it."""
        queue = self.queue
        for name, description in STAGED_JOB.items():
            self.add_storage(f"send_{name}", getattr(queue.job, name), description)
        self._send_control = CSRStorage(name="send_control", fields=[
            CSRField("reply", size=1, pulse=True,
                description="Write 1 to send the staged message. Ignored while ``reply_busy``."),
            CSRField("run",   size=1, pulse=True,
                description="Write 1 to send a burst: a message per 1024 bytes begun. Ignored while ``run_busy``."),
            CSRField("abort", size=1, pulse=True,
                description="Write 1 to give the burst up, after the message that is being read."),
        ])
        self._send_status = CSRStatus(name="send_status", fields=[
            CSRField("reply_busy", size=1, description="The payload of the reply has not been read yet."),
            CSRField("run_busy",   size=1, description="Some payload of the burst has not been read yet."),
        ])
        self.comb += [
            queue.reply.eq(self._send_control.fields.reply),
            queue.burst.eq(self._send_control.fields.run),
            queue.abort.eq(self._send_control.fields.abort),
            self._send_status.fields.reply_busy.eq(queue.reply_busy),
            self._send_status.fields.run_busy.eq(queue.burst_busy),
        ]

    def add_stream(self):
        """Add the streamed frame."""
        gate, parts = self.gate, self.parts
        self.add_storage("stream_frame_id", gate.frame_id, "Id of the streamed frame to open.")
        self.add_storage("stream_pixels",   gate.pixels,   "Pixels of one of its images.")
        self.add_storage("stream_sequence", self.sequence, "Sequence of the messages that bring its map.")
        self._stream_control = CSRStorage(name="stream_control", fields=[
            CSRField("open",  size=1, pulse=True,
                description="Write 1 to receive pairs of the staged frame, and to send its map to the session's peer. "
                            "Only while ``stream_status`` is 0."),
            CSRField("close", size=1, pulse=True,
                description="Write 1 to give it up: what is under way is discarded."),
        ])
        self._stream_status = CSRStatus(name="stream_status", fields=[
            CSRField("open",    size=1, description="Pairs are missing."),
            CSRField("sending", size=1, description="Parts of the map have not been sent."),
        ])
        self.comb += [
            gate.open.eq(self._stream_control.fields.open),
            gate.close.eq(self._stream_control.fields.close),
            self._stream_status.fields.open.eq(gate.opened),
            self._stream_status.fields.sending.eq(parts.sending),
        ]
        self.add_status("stream_offset", 32, gate.offset, "Offset of the chunk of pairs that comes next.")

    def add_counter(self):
        """Add the counters, of which software reads one at a time."""
        self._counter_index = CSRStorage(name="counter_index", fields=[
            CSRField("number", size=4, values=[(str(number), f"``{name}``: {description}")
                for number, (name, description) in zip(COUNTER_NUMBERS, COUNTERS.items())],
                description="Number of the counter to read.")])
        self.comb += [
            self.counters.index.eq(self._counter_index.fields.number),
            self.counters.read.eq(self._counter_index.re),
        ]
        self.add_status("counter", 32, self.counters.value,
            "That counter, when ``counter_index`` was written; modulo 2**32, 0 after a reset.")
