#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from liteeth.common import arp_table_request_layout, arp_table_response_layout

from .headers import *
from .message import datagram_description

# Header Writer ------------------------------------------------------------------------------------

@ResetInserter()
class HeaderWriter(LiteXModule):
    """Put frames together: ARP messages, replies to an echo, and datagrams, in this order if several wait.

    An echo or a datagram goes to the MAC address that the table has for its next station: the receiver itself, or the
    gateway if that is on another subnet and there is one. If the table has none, it is dropped.

        IDLE ─┬─ HEADER                                 ARP message
              └─ SUM ── LOOKUP ─┬─ HEADER ── DATA       echo or datagram
                                └─ DROP

    Each path ends in IDLE. During LOOKUP ARP messages are sent, too.
    """
    def __init__(self):
        self.sink        = stream.Endpoint(datagram_description())      # Datagrams, of 1472 bytes at most.
        self.arp         = stream.Endpoint(arp_layout())                # ARP messages.
        self.echo        = stream.Endpoint(sent_layout())               # Replies to an echo, big-endian:
        self.echo_to     = Signal(32)                                   # receiver,
        self.echo_bytes  = Signal(8)                                    # and length.
        self.request     = stream.Endpoint(arp_table_request_layout)    # The table is asked for a MAC address,
        self.response    = stream.Endpoint(arp_table_response_layout)   # and answers.
        self.source      = stream.Endpoint(sent_layout())               # Frames.
        self.on          = Signal()   # There are addresses; without, everything is dropped.
        self.mac_address = Signal(48) # Of the device,
        self.ip_address  = Signal(32) # and its IP address.
        self.netmask     = Signal(32) # Of its subnet.
        self.gateway     = Signal(32) # To other subnets; 0: none.
        self.latency     = None       # Depends on the table.

        # # #

        self.word     = Signal(32) # Word of the headers, big-endian.
        self.index    = Signal(4)  # Number of it.
        self.second   = Signal()   # Its second half is added to the checksum.
        self.is_arp   = Signal()   # What is sent.
        self.is_icmp  = Signal()
        self.receiver = Signal(32) # Who gets it.
        self.fsm      = FSM(reset_state="IDLE")

        self.add_route()
        self.add_word()
        self.add_checksum()
        self.add_states()

    def add_route(self):
        """Find the next station."""
        foreign = Signal() # The receiver is on another subnet, and there is a gateway.
        self.comb += [
            self.receiver.eq(Mux(self.is_icmp, self.echo_to, self.sink.ip_address)),
            self.request.ip_address.eq(Mux(foreign, self.gateway, self.receiver)),
        ]
        self.sync += foreign.eq((((self.receiver ^ self.ip_address) & self.netmask) != 0) & (self.gateway != 0))

    def add_word(self):
        """Select the words of the headers."""
        total    = Signal(11) # Bytes of the IP packet,
        udp      = Signal(11) # and of the UDP packet.
        target   = Signal(48) # MAC address of the receiver.
        mac, ip  = self.mac_address, self.ip_address
        self.sum = Signal(16) # Checksum of the IP header.
        self.comb += [
            total.eq(Mux(self.is_icmp, self.echo_bytes, self.sink.length[:11])
                + Mux(self.is_icmp, IP_BYTES, IP_BYTES + UDP_BYTES)),
            udp.eq(self.sink.length[:11] + UDP_BYTES),
            target.eq(Mux(self.is_arp, self.arp.mac_address | Replicate(self.arp.request, 48),
                self.response.mac_address)),
        ]
        def at(number, arp):
            return (self.index == number) & (self.is_arp if arp else ~self.is_arp)
        def either(number):
            return self.index == number
        high = [
            (either(1) | at(9, True),                  target[16:32]),
            (either(2) | at(6, True),                  mac[32:48]),
            (either(3) | at(7, True),                  mac[:16]),
            (at(4, True),                              ARP_KINDS >> 16),
            (at(5, True),                              ARP_LENGTHS),
            (at(8, True),                              ip[:16]),
            (at(10, True),                             self.arp.ip_address[16:]),
            (at(4, False),                             IP_FIRST),
            (at(6, False) & self.is_icmp,              TIME_TO_LIVE << 8 | PROTOCOL_ICMP),
            (at(6, False) & ~self.is_icmp,             TIME_TO_LIVE << 8 | PROTOCOL_UDP),
            (at(7, False),                             ip[16:]),
            (at(8, False),                             self.receiver[16:]),
            (at(9, False),                             self.sink.src_port),
            (at(10, False),                            udp),
        ]
        low = [
            (either(0) | at(8, True),                  target[32:48]),
            (either(1) | at(9, True),                  target[:16]),
            (either(2) | at(6, True),                  mac[16:32]),
            (at(3, False),                             TYPE_IP),
            (at(3, True),                              TYPE_ARP),
            (at(4, True),                              ARP_KINDS & 0xffff),
            (at(5, True) & self.arp.request,           ARP_REQUEST),
            (at(5, True) & ~self.arp.request,          ARP_REPLY),
            (at(7, True),                              ip[16:]),
            (at(10, True),                             self.arp.ip_address[:16]),
            (at(4, False),                             total),
            (at(6, False),                             self.sum),
            (at(7, False),                             ip[:16]),
            (at(8, False),                             self.receiver[:16]),
            (at(9, False),                             self.sink.dst_port),
        ]
        # One condition of each half holds at most: no multiplexer is needed, but for the selection by it.
        halves = []
        for rows in (low, high):
            half = 0
            for condition, value in rows:
                selected = Signal()
                self.comb += selected.eq(condition)
                half = half | (Replicate(selected, 16) & value)
            halves.append(Signal(16))
            self.comb += halves[-1].eq(half)
        self.comb += self.word.eq(Cat(*halves))

    def add_checksum(self):
        """Sum the IP header up, half a word in a clock."""
        self.checksum = checksum = ChecksumAdder()
        summing = self.fsm.ongoing("SUM")
        self.comb += [
            If(self.index != 9,
                checksum.half.eq(Mux(self.second, self.word[:16], self.word[16:]))
            ),
            checksum.ce.eq(summing),
            checksum.clear.eq(self.fsm.ongoing("IDLE")),
            If(~summing,
                self.sum.eq(~checksum.total)
            ),
        ]

    def add_states(self):
        """Choose what is sent, and send it."""
        sink, arp, echo, source, response, fsm = self.sink, self.arp, self.echo, self.source, self.response, self.fsm
        last    = Signal() # The last word of the headers.
        looking = Signal() # An echo or a datagram waits for a MAC address,
        looked  = Signal() # which the table was asked for.
        self.comb += last.eq(self.index == Mux(self.is_icmp & ~self.is_arp, HEADER_LAST - 2, HEADER_LAST))
        fsm.act("IDLE",
            NextValue(self.second, 0),
            NextValue(self.is_arp, arp.valid),
            NextValue(self.is_icmp, echo.valid),
            NextValue(self.index, Mux(arp.valid, 0, 4)),
            If(arp.valid,
                If(self.on,
                    NextState("HEADER")
                ).Else(
                    arp.ready.eq(1)
                )
            ).Elif(echo.valid | sink.valid,
                If(self.on,
                    NextState("SUM")
                ).Else(
                    NextState("DROP")
                )
            )
        )
        fsm.act("SUM",
            NextValue(self.second, ~self.second),
            If(self.second,
                NextValue(self.index, self.index + 1)
            ),
            # This clock adds the last carry.
            If(self.index == 9,
                NextValue(self.index, 0),
                NextValue(looking, 1),
                NextState("LOOKUP")
            )
        )
        # The table may have to ask first.
        fsm.act("LOOKUP",
            self.request.valid.eq(~looked),
            If(arp.valid,
                NextValue(self.is_arp, 1),
                NextState("HEADER")
            ).Elif(~looked,
                NextValue(looked, self.request.ready)
            ).Elif(response.valid,
                NextValue(looking, 0),
                NextValue(looked, 0),
                If(response.failed,
                    response.ready.eq(1),
                    NextState("DROP")
                ).Else(
                    NextState("HEADER")
                )
            )
        )
        fsm.act("HEADER",
            source.valid.eq(1),
            source.data.eq(big_endian(self.word)),
            source.tail.eq(3),
            source.last.eq(self.is_arp & last),
            # Until then the table holds the MAC address.
            response.ready.eq(~self.is_arp & source.ready & (self.index == 1)),
            If(source.ready,
                NextValue(self.index, self.index + 1),
                If(last,
                    If(self.is_arp,
                        arp.ready.eq(1),
                        NextValue(self.is_arp, 0),
                        NextValue(self.index, 0),
                        If(looking,
                            NextState("LOOKUP")
                        ).Else(
                            NextState("IDLE")
                        )
                    ).Else(
                        NextState("DATA")
                    )
                )
            )
        )
        fsm.act("DATA",
            If(self.is_icmp,
                echo.connect(source, omit={"data"}),
                source.data.eq(big_endian(echo.data))
            ).Else(
                source.valid.eq(sink.valid),
                source.data.eq(sink.data),
                source.last.eq(sink.last),
                source.tail.eq(Cat(sink.last_be[1] | sink.last_be[3], sink.last_be[2] | sink.last_be[3])),
                sink.ready.eq(source.ready)
            ),
            If(source.valid & source.ready & source.last,
                NextState("IDLE")
            )
        )
        fsm.act("DROP",
            If(self.is_icmp,
                echo.ready.eq(1)
            ).Else(
                sink.ready.eq(1)
            ),
            If((echo.valid & echo.ready & echo.last) | (sink.valid & sink.ready & sink.last),
                NextState("IDLE")
            )
        )
