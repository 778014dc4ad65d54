#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ..common.crossing        import Crossing
from ..common.stream_register import add_register
from .address_table           import AddressTable
from .echo                    import Echo
from .header_parser           import HeaderParser
from .header_writer           import HeaderWriter
from .headers                 import received_layout, sent_layout
from .message                 import datagram_description
from .wire_receiver           import WireReceiver
from .wire_sender             import WireSender

CROSSING_WORDS = 16 # More than pass while the pointers of a crossing are on their way.

# Network ------------------------------------------------------------------------------------------

class Network(LiteXModule):
    """Datagrams of one UDP port on a PHY of a byte per clock: Ethernet, ARP, IPv4, UDP, and ICMP's echo.

    The wire's bytes become words of 32 bits in the wire's clock domains; all else is in `sys`. Nothing is received or
    sent until there is an IP address. It is reset with its clock domains alone, which a reset must hold for some
    clocks.

    Parameters
    ----------
    phy
        LiteEth PHY, 8 bits wide, with its clock domains `eth_rx` and `eth_tx`.
    udp_port : int
        UDP port of the device.
    clk_freq : int
        Frequency of `sys` in Hz, for ARP's timeouts; for 1 Gbit/s at least 50 MHz.
    with_icmp : bool
        Answer a ping. No other function needs it.
    pipelined : bool
        Add registers for ready at the datagrams, for a system clock of more than 60 MHz on an ECP5.
    """
    def __init__(self, phy, udp_port, clk_freq, with_icmp=True, pipelined=False):
        self.sink        = stream.Endpoint(datagram_description()) # Datagrams to send.
        self.source      = stream.Endpoint(datagram_description()) # Datagrams to the port.
        self.mac_address = Signal(48) # Of the device.
        self.ip_address  = Signal(32) # Its IP address; while its first byte is 0, the network is off.
        self.netmask     = Signal(32) # Of its subnet.
        self.gateway     = Signal(32) # To other subnets; 0: none, their hosts are on the same wire.
        self.latency     = None       # Depends on the wire, and on ARP.

        # # #

        self.parser = HeaderParser(udp_port)
        self.writer = HeaderWriter()
        self.table  = AddressTable(clk_freq)
        on          = Signal()
        self.sync  += on.eq(self.ip_address[24:] != 0)
        for core in (self.parser, self.writer):
            self.comb += [
                core.on.eq(on),
                core.mac_address.eq(self.mac_address),
                core.ip_address.eq(self.ip_address),
            ]
        self.comb += [
            self.writer.netmask.eq(self.netmask),
            self.writer.gateway.eq(self.gateway),
            self.parser.arp.connect(self.table.sink),
            self.table.source.connect(self.writer.arp),
            self.writer.request.connect(self.table.request),
            self.table.response.connect(self.writer.response),
        ]
        self.add_wire(phy)
        self.add_datagrams(pipelined)
        if with_icmp:
            self.add_echo()

    def add_wire(self, phy):
        """Add the paths from the wire and to it; each side of a crossing is a register."""
        framed        = getattr(phy, "with_preamble_crc", True)
        self.receiver = receiver = ClockDomainsRenamer("eth_rx")(WireReceiver(framed))
        self.received = received = Crossing(received_layout(), "eth_rx", "sys", CROSSING_WORDS)
        self.words    = words    = stream.Buffer(received_layout())
        self.sender   = sender   = ClockDomainsRenamer("eth_tx")(WireSender(framed))
        self.sent     = sent     = Crossing(sent_layout(), "sys", "eth_tx", CROSSING_WORDS)
        self.written  = written  = stream.Buffer(sent_layout())
        self.unsent   = unsent   = ClockDomainsRenamer("eth_tx")(stream.Buffer(sent_layout()))
        self.comb += [
            phy.source.connect(receiver.sink),
            receiver.source.connect(received.sink),
            received.source.connect(words.sink),
            words.source.connect(self.parser.sink),
            self.writer.source.connect(written.sink),
            written.source.connect(sent.sink),
            sent.source.connect(unsent.sink),
            unsent.source.connect(sender.sink),
            sender.source.connect(phy.sink),
        ]

    def add_datagrams(self, pipelined):
        """Add the paths from the parser and to the writer."""
        if pipelined:
            add_register(self, self.sink, self.writer.sink)
        else:
            self.datagrams = datagrams = stream.Buffer(datagram_description())
            self.comb += [
                self.sink.connect(datagrams.sink),
                datagrams.source.connect(self.writer.sink),
            ]
        self.comb += self.parser.source.connect(self.source)

    def add_echo(self):
        """Add the answer to a ping."""
        parser, writer  = self.parser, self.writer
        self.echo = echo = Echo()
        self.comb += [
            echo.word.eq(parser.echo_word),
            echo.write.eq(parser.echo_write),
            echo.begin.eq(parser.echo_begin),
            echo.done.eq(parser.echo_done),
            echo.bytes.eq(parser.echo_bytes),
            echo.sender.eq(parser.sender),
            echo.source.connect(writer.echo),
            writer.echo_to.eq(echo.address),
            writer.echo_bytes.eq(echo.length),
        ]
