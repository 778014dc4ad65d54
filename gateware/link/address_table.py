#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *
from litex.gen.genlib.misc import WaitTimer

from litex.soc.interconnect import stream

from liteeth.common   import arp_table_request_layout, arp_table_response_layout, ethernet_type_arp
from liteeth.core.arp import LiteEthARPRX, LiteEthARPTX, _arp_table_layout

from ..common.parameters import check

# Address Table ------------------------------------------------------------------------------------

class AddressTable(LiteXModule):
    """MAC addresses of the stations that datagrams go to, in place of LiteEthARPTable.

    LiteEth's table asks up to seven times, 100 ms apart, and holds all output meanwhile. So one answer to an address
    that does not exist stops a session for 0.7 s. Here a known address never holds output, and unknown ones hold it for
    a bounded share of the time:

    - A known station is served at once. Once per `REFRESH_S` it is asked again, after its datagram has gone.
    - For an unknown one the table asks once and waits up to `WAIT_S`. After that, or if it has waited too much lately,
      the datagram is dropped. The answer still counts when it comes, so the next datagram goes through.
    - Each clock of waiting has to be followed by `REST` clocks without it before the next wait. So waits take at most
      1/(REST + 1) of the time, at any traffic.

    A reset forgets all stations.

    Parameters
    ----------
    clk_freq : int
        Frequency of `sys` in Hz, at least 1000.
    entries : int
        Stations that are known at the same time, a power of 2; the oldest entry makes room for a new one.
    """
    WAIT_S    = 10e-3
    REST      = 31
    REFRESH_S = 1

    def __init__(self, clk_freq, entries=4):
        self.sink     = stream.Endpoint(_arp_table_layout)          # ARP messages that have arrived; ready is not used.
        self.source   = stream.Endpoint(_arp_table_layout)          # ARP messages to send.
        self.request  = stream.Endpoint(arp_table_request_layout)   # Address of the next datagram.
        self.response = stream.Endpoint(arp_table_response_layout)  # Its MAC address, or that it has to be dropped.
        self.latency  = None                                        # Depends on the network.

        check(entries > 1 and entries & (entries - 1) == 0, f"entries is a power of 2, at least 2, not {entries}.")
        check(clk_freq >= 1000, f"clk_freq is at least 1000 Hz, not {clk_freq}.")

        # # #

        self.add_entries(entries)
        self.add_arrivals()
        self.add_waits(clk_freq)
        self.add_fsm()

    def add_entries(self, entries):
        self.known  = Array(Signal(name=f"known{n}") for n in range(entries)) # The entry is in use.
        self.fresh  = Array(Signal(name=f"fresh{n}") for n in range(entries)) # Asked in the current period.
        self.index  = Signal(max=entries)                                     # Entry under inspection.
        self.oldest = Signal(max=entries)                                     # Entry that makes room.
        self.last   = Signal()
        self.entry  = Record([("ip_address", 32), ("mac_address", 48)])
        memory      = Memory(len(self.entry.raw_bits()), entries)
        self.write  = memory.get_port(write_capable=True)
        self.read   = memory.get_port(async_read=True)
        self.specials += memory, self.write, self.read
        self.comb += [
            self.read.adr.eq(self.index),
            self.write.adr.eq(self.index),
            self.entry.raw_bits().eq(self.read.dat_r),
            self.last.eq(self.index == entries - 1),
        ]

    def add_arrivals(self):
        """Keep an ARP message, which is on the stream for one clock, until the table has time for it."""
        self.arrived = Record([("request", 1), ("reply", 1), ("ip_address", 32), ("mac_address", 48)])
        self.done    = Signal()
        self.comb   += self.sink.ready.eq(1)
        self.sync   += [
            If(self.done,
                self.arrived.request.eq(0),
                self.arrived.reply.eq(0),
            ),
            If(self.sink.valid & ~self.arrived.request & ~self.arrived.reply,
                self.arrived.request.eq(self.sink.request),
                self.arrived.reply.eq(self.sink.reply),
                self.arrived.ip_address.eq(self.sink.ip_address),
                self.arrived.mac_address.eq(self.sink.mac_address),
            ),
        ]

    def add_waits(self, clk_freq):
        limit        = self.REST*int(clk_freq*self.WAIT_S)
        self.waiting = Signal()                          # A datagram waits for the answer.
        self.debt    = Signal(max=limit + self.REST + 1) # Clocks of rest that are due.
        self.rested  = Signal()
        self.expired = Signal()
        self.sync += [
            If(self.waiting,
                If(~self.expired, self.debt.eq(self.debt + self.REST))
            ).Elif(~self.rested,
                self.debt.eq(self.debt - 1)
            ),
        ]
        self.comb += [
            self.rested.eq(self.debt == 0),
            self.expired.eq(self.debt >= limit),
        ]
        self.period = WaitTimer(self.REFRESH_S*clk_freq)
        self.comb  += self.period.wait.eq(~self.period.done)

    def add_fsm(self):
        arrived, entry, index, response = self.arrived, self.entry, self.index, self.response

        asked    = Signal(32) # Address that was asked for last.
        pending  = Signal()   # It has not answered.
        wanted   = Signal(32) # Address that is searched.
        storing  = Signal()   # Searched for an answer, not for a datagram.
        ask      = Signal()   # Ask when the datagram has been served.
        failed   = Signal()
        expected = Signal()
        self.comb += [
            expected.eq(pending & (arrived.ip_address == asked)),
            response.failed.eq(failed),
            self.write.dat_w.eq(Cat(asked, arrived.mac_address)),
        ]
        self.sync += If(self.period.done, *[fresh.eq(0) for fresh in self.fresh])

        self.fsm = fsm = FSM(reset_state="IDLE")
        fsm.act("IDLE",
            NextValue(index, 0),
            NextValue(storing, 0),
            NextValue(ask, 0),
            If(arrived.request,
                NextState("REPLY")
            ).Elif(arrived.reply,
                NextValue(storing, 1),
                NextValue(wanted, arrived.ip_address),
                If(expected,
                    NextState("SEARCH")
                ).Else(
                    self.done.eq(1)
                )
            ).Elif(self.waiting,
                If(self.expired,
                    NextValue(self.waiting, 0),
                    NextValue(failed, 1),
                    NextState("RESPOND")
                )
            ).Elif(self.request.valid,
                NextValue(wanted, self.request.ip_address),
                NextState("SEARCH")
            )
        )
        fsm.act("REPLY",
            self.source.valid.eq(1),
            self.source.reply.eq(1),
            self.source.ip_address.eq(arrived.ip_address),
            self.source.mac_address.eq(arrived.mac_address),
            If(self.source.ready,
                self.done.eq(1),
                NextState("IDLE")
            )
        )
        fsm.act("SEARCH",
            If(self.known[index] & (entry.ip_address == wanted),
                If(storing,
                    NextState("STORE")
                ).Else(
                    NextState("FOUND")
                )
            ).Elif(self.last,
                If(storing,
                    NextValue(index, self.oldest),
                    NextValue(self.oldest, self.oldest + 1),
                    NextState("STORE")
                ).Else(
                    NextState("MISSED")
                )
            ).Else(
                NextValue(index, index + 1)
            )
        )
        fsm.act("STORE",
            self.write.we.eq(1),
            self.done.eq(1),
            NextValue(self.known[index], 1),
            NextValue(self.fresh[index], 1),
            NextValue(pending, 0),
            NextValue(response.mac_address, arrived.mac_address),
            NextValue(failed, 0),
            # The answer is for the waiting datagram, if there is one: nothing else is asked for meanwhile.
            NextValue(self.waiting, 0),
            If(self.waiting,
                NextState("RESPOND")
            ).Else(
                NextState("IDLE")
            )
        )
        fsm.act("FOUND",
            self.request.ready.eq(1),
            NextValue(response.mac_address, entry.mac_address),
            NextValue(failed, 0),
            NextValue(ask, ~self.fresh[index]),
            NextValue(self.fresh[index], 1),
            NextState("RESPOND")
        )
        fsm.act("MISSED",
            self.request.ready.eq(1),
            NextValue(failed, 1),
            If(self.rested,
                NextState("ASK")
            ).Else(
                NextValue(ask, 1),
                NextState("RESPOND")
            )
        )
        fsm.act("ASK",
            self.source.valid.eq(1),
            self.source.request.eq(1),
            self.source.ip_address.eq(wanted),
            If(self.source.ready,
                NextValue(asked, wanted),
                NextValue(pending, 1),
                # Without a response before, a datagram waits.
                NextValue(self.waiting, ~ask),
                NextState("IDLE")
            )
        )
        fsm.act("RESPOND",
            response.valid.eq(1),
            If(response.ready,
                If(ask,
                    NextState("ASK")
                ).Else(
                    NextState("IDLE")
                )
            )
        )

# ARP ----------------------------------------------------------------------------------------------

class ARP(LiteXModule):
    """As LiteEthARP, with an `AddressTable`."""
    def __init__(self, mac, mac_address, ip_address, clk_freq, dw):
        self.tx    = tx    = LiteEthARPTX(mac_address, ip_address, dw)
        self.rx    = rx    = LiteEthARPRX(mac_address, ip_address, dw)
        self.table = table = AddressTable(clk_freq)
        port       = mac.crossbar.get_port(ethernet_type_arp, dw=dw)
        self.comb += [
            rx.source.connect(table.sink),
            table.source.connect(tx.sink),
            tx.source.connect(port.sink),
            port.source.connect(rx.sink),
        ]
