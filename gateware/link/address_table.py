#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from liteeth.common import arp_table_request_layout, arp_table_response_layout

from ..common.parameters import check
from .headers            import arp_layout

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
        self.sink     = stream.Endpoint(arp_layout())               # ARP messages that have arrived; ready is not used.
        self.source   = stream.Endpoint(arp_layout())               # ARP messages to send.
        self.request  = stream.Endpoint(arp_table_request_layout)   # Address of the next datagram.
        self.response = stream.Endpoint(arp_table_response_layout)  # Its MAC address, or that it has to be dropped.
        self.latency  = None                                        # Depends on the network.

        check(entries > 1 and entries & (entries - 1) == 0, f"entries is a power of 2, at least 2, not {entries}.")
        check(clk_freq >= 1000, f"clk_freq is at least 1000 Hz, not {clk_freq}.")

        # # #

        self.add_arrivals()
        self.add_entries(entries)
        self.add_waits(clk_freq)
        self.add_fsm()

    def add_entries(self, entries):
        self.known  = Array(Signal(name=f"known{n}") for n in range(entries)) # The entry is in use.
        self.fresh  = Array(Signal(name=f"fresh{n}") for n in range(entries)) # Asked in the current period.
        self.index  = Signal(max=entries)                                     # Entry under inspection.
        self.place  = Signal(max=entries)                                     # Entry that was asked for last.
        self.oldest = Signal(max=entries)                                     # Entry that makes room.
        self.asked  = Signal(32)                                              # Address that was asked for last.
        self.entry  = Record([("ip_address", 32), ("mac_address", 48)])
        memory      = Memory(len(self.entry.raw_bits()), entries)
        self.write  = memory.get_port(write_capable=True)
        self.read   = memory.get_port(async_read=True)
        self.specials += memory, self.write, self.read
        self.comb += [
            self.read.adr.eq(self.index),
            self.write.adr.eq(self.place),
            self.write.dat_w.eq(Cat(self.asked, self.arrived.mac_address)),
            self.entry.raw_bits().eq(self.read.dat_r),
            self.response.mac_address.eq(self.entry.mac_address),
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
        """Count in steps of 2**n clocks: some hundreds of them are a wait."""
        wait_clocks  = int(clk_freq*self.WAIT_S)
        self.bits    = bits = max(0, wait_clocks.bit_length() - 9)
        # The step in which a wait begins counts as a whole one.
        limit        = self.REST*((wait_clocks >> bits) + 2)
        self.waiting = Signal()                          # A datagram waits for the answer,
        self.begins  = Signal()                          # from the next clock on.
        self.debt    = Signal(max=limit + self.REST + 1) # Steps of rest that are due.
        self.rested  = Signal()
        self.expired = Signal()
        step         = Signal()
        change       = Signal(len(self.debt))
        count        = Signal(bits + 1)
        period       = Signal(max=max(2, int(self.REFRESH_S*clk_freq) >> bits))
        self.ended   = Signal() # A period has ended.
        self.comb += [
            step.eq(count[bits]),
            self.rested.eq(self.debt == 0),
            self.expired.eq(self.debt >= limit),
            change.eq(Mux(self.waiting | self.begins, self.REST, 2**len(change) - 1)),
            self.ended.eq(step & (period == 0)),
        ]
        self.sync += [
            count.eq(count[:bits] + 1 if bits else 1),
            If(self.begins | (step & Mux(self.waiting, ~self.expired, ~self.rested)),
                self.debt.eq(self.debt + change)
            ),
            If(step,
                period.eq(period - 1),
                If(period == 0,
                    period.eq((int(self.REFRESH_S*clk_freq) >> bits) - 1)
                )
            ),
        ]

    def add_fsm(self):
        arrived, entry, index, request, response = self.arrived, self.entry, self.index, self.request, self.response

        pending = Signal() # The address that was asked for has not answered.
        ask     = Signal() # Ask when the datagram has been served.
        adds    = Signal() # Its answer makes a new entry.
        failed  = Signal()
        self.comb += response.failed.eq(failed)
        self.sync += If(self.ended, *[fresh.eq(0) for fresh in self.fresh])

        self.fsm = fsm = FSM(reset_state="IDLE")
        fsm.act("IDLE",
            NextValue(index, 0),
            NextValue(ask, 0),
            If(arrived.request,
                NextState("REPLY")
            ).Elif(arrived.reply,
                If(pending & (arrived.ip_address == self.asked),
                    NextState("STORE")
                ).Else(
                    self.done.eq(1)
                )
            ).Elif(self.waiting,
                If(self.expired,
                    NextValue(self.waiting, 0),
                    NextValue(failed, 1),
                    NextState("RESPOND")
                )
            ).Elif(request.valid,
                NextState("SEARCH")
            )
        )
        fsm.act("REPLY",
            self.source.valid.eq(1),
            If(self.source.ready,
                self.done.eq(1),
                NextState("IDLE")
            )
        )
        fsm.act("SEARCH",
            If(self.known[index] & (entry.ip_address == request.ip_address),
                NextState("FOUND")
            ).Elif(index == len(self.known) - 1,
                NextState("MISSED")
            ).Else(
                NextValue(index, index + 1)
            )
        )
        fsm.act("STORE",
            self.write.we.eq(1),
            self.done.eq(1),
            NextValue(self.known[self.place], 1),
            NextValue(self.fresh[self.place], 1),
            NextValue(index, self.place),
            NextValue(pending, 0),
            NextValue(failed, 0),
            If(adds,
                NextValue(self.oldest, self.oldest + 1)
            ),
            # The answer is for the waiting datagram, if there is one: nothing else is asked for meanwhile.
            NextValue(self.waiting, 0),
            If(self.waiting,
                NextState("RESPOND")
            ).Else(
                NextState("IDLE")
            )
        )
        fsm.act("FOUND",
            request.ready.eq(1),
            NextValue(failed, 0),
            If(~self.fresh[index],
                NextValue(ask, 1),
                NextValue(self.asked, request.ip_address),
                NextValue(self.place, index),
                NextValue(adds, 0)
            ),
            NextValue(self.fresh[index], 1),
            NextState("RESPOND")
        )
        fsm.act("MISSED",
            request.ready.eq(1),
            NextValue(failed, 1),
            NextValue(self.asked, request.ip_address),
            NextValue(self.place, self.oldest),
            NextValue(adds, 1),
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
            If(self.source.ready,
                NextValue(pending, 1),
                # Without a response before, a datagram waits.
                NextValue(self.waiting, ~ask),
                self.begins.eq(~ask),
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
        self.comb += [
            self.source.reply.eq(~self.source.request),
            self.source.mac_address.eq(arrived.mac_address),
            self.source.ip_address.eq(Mux(self.source.request, self.asked, arrived.ip_address)),
        ]
