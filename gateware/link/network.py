#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from liteeth.common       import convert_ip, eth_fcs_length, eth_min_frame_length, eth_phy_description, ethernet_type_ip
from liteeth.core.icmp    import LiteEthICMP
from liteeth.core.ip      import LiteEthIPRX, LiteEthIPTX, LiteEthIPV4Crossbar
from liteeth.core.udp     import LiteEthUDP, LiteEthUDPUserPort
from liteeth.mac.common   import LiteEthMACCrossbar, LiteEthMACDepacketizer, LiteEthMACPacketizer
from liteeth.mac.crc      import LiteEthMACCRC32Checker, LiteEthMACCRC32Inserter
from liteeth.mac.gap      import LiteEthMACGap
from liteeth.mac.last_be  import LiteEthMACRXLastBE, LiteEthMACTXLastBE
from liteeth.mac.padding  import LiteEthMACPaddingInserter
from liteeth.mac.preamble import LiteEthMACPreambleChecker, LiteEthMACPreambleInserter

from ..common.crossing        import Crossing
from ..common.stream_register import add_register, join
from .address_table           import ARP

WORD_BITS = 32 # Between MAC and UDP: wide enough for a system clock that is slower than the wire's.

# MAC Pipelines ------------------------------------------------------------------------------------

class RegisteredChain(LiteXModule):
    """A chain of cores in one clock domain, with registers before, between and after them.

    Without the registers, the ready of a MAC's sender would run through preamble, CRC and converter in one clock, too
    long for 125 MHz.

    Parameters
    ----------
    clock_domain : str
        Clock domain of the chain.
    source, sink : stream.Endpoint
        Stream that enters the chain, and stream that its last core feeds.
    cores : list
        The cores, in order; without any the chain is one register.
    """
    def __init__(self, clock_domain, source, sink, cores=()):
        for core in [ClockDomainsRenamer(clock_domain)(core) for core in cores]:
            self.submodules += core
            add_register(self, source, core.sink, clock_domain)
            source = core.source
        add_register(self, source, sink, clock_domain)

class MACSender(LiteXModule):
    """Send Ethernet frames to the PHY: padding, CRC, preamble, gap."""
    def __init__(self, phy):
        byte, word   = eth_phy_description(8), eth_phy_description(WORD_BITS)
        self.sink    = stream.Endpoint(word) # Ethernet frames, words of 32 bits in `sys`.
        self.latency = None                  # Depends on both clocks and on the wire.

        # # #

        cores = [
            stream.StrideConverter(word, byte),
            LiteEthMACTXLastBE(8),
            LiteEthMACPaddingInserter(8, eth_min_frame_length - eth_fcs_length),
        ]
        if getattr(phy, "with_preamble_crc", True):
            cores += [LiteEthMACCRC32Inserter(byte), LiteEthMACPreambleInserter(8)]
        cores.append(LiteEthMACGap(8))
        self.crossing = crossing = Crossing(word.payload_layout, "sys", "eth_tx")
        self.words    = RegisteredChain("sys", self.sink, crossing.sink)
        self.bytes    = RegisteredChain("eth_tx", crossing.source, phy.sink, cores)

class MACReceiver(LiteXModule):
    """Receive Ethernet frames from the PHY; those with a wrong CRC are marked as errors."""
    def __init__(self, phy):
        byte, word   = eth_phy_description(8), eth_phy_description(WORD_BITS)
        self.source  = stream.Endpoint(word) # Ethernet frames, words of 32 bits in `sys`.
        self.latency = None                  # Depends on both clocks.

        # # #

        cores = [LiteEthMACRXLastBE(8), stream.StrideConverter(byte, word)]
        if getattr(phy, "with_preamble_crc", True):
            cores = [LiteEthMACPreambleChecker(8), LiteEthMACCRC32Checker(byte), *cores]
        self.crossing = crossing = Crossing(word.payload_layout, "eth_rx", "sys")
        self.bytes    = RegisteredChain("eth_rx", phy.source, crossing.sink, cores)
        self.words    = RegisteredChain("sys", crossing.source, self.source)

class MAC(LiteXModule):
    """The sender and the receiver, with the interface of a MAC that LiteEth's protocols expect."""
    def __init__(self, phy, pipelined):
        self.sender       = sender       = MACSender(phy)
        self.receiver     = receiver     = MACReceiver(phy)
        self.crossbar     = crossbar     = LiteEthMACCrossbar(WORD_BITS)
        self.packetizer   = packetizer   = LiteEthMACPacketizer(WORD_BITS)
        self.depacketizer = depacketizer = LiteEthMACDepacketizer(WORD_BITS)
        self.comb += [
            packetizer.source.connect(sender.sink),
            receiver.source.connect(depacketizer.sink),
        ]
        join(self, crossbar.master.source, packetizer.sink, pipelined)
        join(self, depacketizer.source, crossbar.master.sink, pipelined)

# IP -----------------------------------------------------------------------------------------------

class IPSender(LiteEthIPTX):
    """As LiteEthIPTX, but a packet that is dropped leaves no checksum behind.

    LiteEth's sender resets the checksum of the header at the end of a packet that it sends, not of one that it drops
    because ARP has failed. The next packet would have the checksum of the dropped one, and be thrown away by its host.
    """
    def __init__(self, mac_address, ip_address, arp_table, dw):
        LiteEthIPTX.__init__(self, mac_address, ip_address, arp_table, dw=dw)
        end = self.packetizer.source
        self.comb += If(self.fsm.ongoing("DROP") & end.valid & end.last & end.ready, self.checksum.reset.eq(1))

class IP(LiteXModule):
    """As LiteEthIP, with a register after its receiver.

    Without the register, the check of a header and the reaction of ICMP and UDP to it would be in one clock.
    """
    def __init__(self, mac, mac_address, ip_address, arp_table, pipelined):
        self.tx       = tx       = IPSender(mac_address, ip_address, arp_table, dw=WORD_BITS)
        self.rx       = rx       = LiteEthIPRX(mac_address, ip_address, with_broadcast=False, dw=WORD_BITS)
        self.crossbar = crossbar = LiteEthIPV4Crossbar(WORD_BITS)
        port          = mac.crossbar.get_port(ethernet_type_ip, WORD_BITS)
        self.comb += [
            tx.source.connect(port.sink),
            port.source.connect(rx.sink),
        ]
        join(self, crossbar.master.source, tx.sink, pipelined)
        if pipelined:
            add_register(self, rx.source, crossbar.master.sink)
        else:
            self.buffer = buffer = stream.Buffer(rx.source.description)
            self.comb += [
                rx.source.connect(buffer.sink),
                buffer.source.connect(crossbar.master.sink),
            ]

# Network ------------------------------------------------------------------------------------------

class Network(LiteXModule):
    """LiteEth's ARP, ICMP echo, IP and UDP with words of 32 bits in `sys`, on a PHY of a byte per clock.

    Parameters
    ----------
    phy
        LiteEth PHY, 8 bits wide, with its clock domains `eth_rx` and `eth_tx`.
    mac_address, ip_address : int, str
        Addresses of the device; the IP address as an int or in dots.
    clk_freq : int
        Frequency of `sys` in Hz, for ARP's timeouts.
    with_icmp : bool
        Answer a ping. No other function needs it.
    pipelined : bool
        Add registers for ready between the protocols, for a system clock of more than 60 MHz on an ECP5.
    """
    def __init__(self, phy, mac_address, ip_address, clk_freq, with_icmp=True, pipelined=False):
        self.ip_address = ip_address = convert_ip(ip_address)
        self.pipelined  = pipelined
        self.latency    = None # Depends on the wire, and on ARP.

        # # #

        self.mac  = MAC(phy, pipelined)
        self.arp  = ARP(self.mac, mac_address, ip_address, clk_freq, dw=WORD_BITS)
        self.ip   = IP(self.mac, mac_address, ip_address, self.arp.table, pipelined)
        if with_icmp:
            self.icmp = LiteEthICMP(self.ip, ip_address, dw=WORD_BITS)
        self.udp  = LiteEthUDP(self.ip, ip_address, dw=WORD_BITS)

    def get_port(self, udp_port):
        """Return the UDP core's port for `udp_port`: `source` has the datagrams to it, `sink` takes those from it."""
        port = self.udp.crossbar.get_port(udp_port, dw=WORD_BITS)
        if not self.pipelined:
            return port
        user = LiteEthUDPUserPort(WORD_BITS)
        add_register(self, user.sink,   port.sink)
        add_register(self, port.source, user.source)
        return user
