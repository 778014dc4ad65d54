#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from liteeth.common       import convert_ip, eth_fcs_length, eth_min_frame_length, eth_phy_description, ethernet_type_ip
from liteeth.core.arp     import LiteEthARP
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

WORD_BITS = 32 # Between MAC and UDP: wide enough that the system's clock may be slower than the wire's.

# MAC Pipelines ------------------------------------------------------------------------------------

class Registered(LiteXModule):
    """Streams and cores of one clock domain in a row, with registers between each two.

    Without them the ready of a MAC's sender runs through preamble, CRC and converter in one clock, too long for 125 MHz.

    Parameters
    ----------
    clock_domain : str
        Of all of them.
    source, sink : stream.Endpoint
        Beginning and end of the row.
    cores : list
        What stands between.
    """
    def __init__(self, clock_domain, source, sink, cores=()):
        for core in [ClockDomainsRenamer(clock_domain)(core) for core in cores]:
            self.submodules += core
            add_register(self, source, core.sink, clock_domain)
            source = core.source
        add_register(self, source, sink, clock_domain)

class MACSender(LiteXModule):
    """Frames, words of 32 bits in `sys`, to the PHY: padding, CRC, preamble, gap."""
    def __init__(self, phy):
        byte, word = eth_phy_description(8), eth_phy_description(WORD_BITS)
        self.sink  = stream.Endpoint(word)

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
        self.words    = Registered("sys", self.sink, crossing.sink)
        self.bytes    = Registered("eth_tx", crossing.source, phy.sink, cores)

class MACReceiver(LiteXModule):
    """Frames from the PHY, as words of 32 bits in `sys`; frames with a wrong CRC are marked as errors."""
    def __init__(self, phy):
        byte, word  = eth_phy_description(8), eth_phy_description(WORD_BITS)
        self.source = stream.Endpoint(word)

        # # #

        cores = [LiteEthMACRXLastBE(8), stream.StrideConverter(byte, word)]
        if getattr(phy, "with_preamble_crc", True):
            cores = [LiteEthMACPreambleChecker(8), LiteEthMACCRC32Checker(byte), *cores]
        self.crossing = crossing = Crossing(word.payload_layout, "eth_rx", "sys")
        self.bytes    = Registered("eth_rx", phy.source, crossing.sink, cores)
        self.words    = Registered("sys", crossing.source, self.source)

class MAC(LiteXModule):
    """What LiteEth's protocols want of a MAC, around the two pipelines."""
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

class IP(LiteXModule):
    """As LiteEthIP, with a register behind its receiver: without it a header's check, and ICMP's and UDP's answer to it,
    are one clock."""
    def __init__(self, mac, mac_address, ip_address, arp_table, pipelined):
        self.tx       = tx       = LiteEthIPTX(mac_address, ip_address, arp_table, dw=WORD_BITS)
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
    """LiteEth's ARP, ICMP echo, IP and UDP at 32 bits in `sys`, on a PHY of a byte per clock.

    Parameters
    ----------
    phy
        LiteEth PHY, 8 bits wide, with its clock domains `eth_rx` and `eth_tx`.
    mac_address, ip_address : int, str
        Of the device; the IP address as an int or in dots.
    clk_freq : int
        Of `sys` in Hz, for ARP's timeouts.
    with_icmp : bool
        Answer a ping. Nothing else needs it.
    pipelined : bool
        Registers for ready between the protocols, for a system clock of more than 60 MHz on an ECP5.
    """
    def __init__(self, phy, mac_address, ip_address, clk_freq, with_icmp=True, pipelined=False):
        self.ip_address = ip_address = convert_ip(ip_address)
        self.pipelined  = pipelined
        self.mac  = MAC(phy, pipelined)
        self.arp  = LiteEthARP(self.mac, mac_address, ip_address, clk_freq, entries=4, dw=WORD_BITS)
        self.ip   = IP(self.mac, mac_address, ip_address, self.arp.table, pipelined)
        if with_icmp:
            self.icmp = LiteEthICMP(self.ip, ip_address, dw=WORD_BITS)
        self.udp  = LiteEthUDP(self.ip, ip_address, dw=WORD_BITS)

    def get_port(self, udp_port):
        """Streams of datagrams from and to a UDP port."""
        port = self.udp.crossbar.get_port(udp_port, dw=WORD_BITS)
        if not self.pipelined:
            return port
        user = LiteEthUDPUserPort(WORD_BITS)
        add_register(self, user.sink,   port.sink)
        add_register(self, port.source, user.source)
        return user
