#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from liteeth.common import convert_ip

from ...gateware.common.parameters      import check
from ...gateware.link.network           import Network
from ...gateware.peripherals.frame_link import FrameLink
from .add_stereo                        import BusPorts
from .dma_checks                        import DMAChecks

UDP_PORT    = 19539 # As in docs/protocol.md.
MAC_ADDRESS = 0x10e2d5000002
IP_ADDRESS  = "192.168.1.50"
NETMASK     = "255.255.255.0"
GATEWAY     = "0.0.0.0" # None.

# Helpers ------------------------------------------------------------------------------------------

def as_int(word):
    """Return the bits of a 32-bit word as C's `int` has them: LiteX's headers have a function that returns each
    constant as an `int`."""
    return word - 2**32 if word >= 2**31 else word

# Frame Link Mixin ---------------------------------------------------------------------------------

class FrameLinkMixin(DMAChecks):
    """Gives a LiteX SoC the method `add_frame_link`: `class MySoC(FrameLinkMixin, SoCCore)`."""

    def add_frame_link(self, phy, name="frame_link", mac_address=MAC_ADDRESS, ip_address=IP_ADDRESS, netmask=NETMASK,
        gateway=GATEWAY, udp_port=UDP_PORT, max_chunks=1024, memory=None, burst_bytes=128, streaming=None,
        with_icmp=True, pipelined=False):
        """Add the path of frames between Ethernet and memory: a `Network` and a `FrameLink`.

        Parameters
        ----------
        phy
            LiteEth PHY, 8 bits wide, a module of this SoC.
        name : str
            Name of the peripheral, and prefix of its registers; a C identifier.
        mac_address, ip_address, netmask, gateway
            Addresses of the device, as ints or in dots; a gateway of 0.0.0.0 is none. The firmware writes them to the
            peripheral's registers.
        udp_port : int
            UDP port of the device.
        max_chunks : int
            Most chunks of 1024 bytes of a pair of images; a power of 2.
        memory : object with `get_port(mode=...)`, optional
            Source of the DMA's ports: see `StereoMixin.add_stereo`.
        burst_bytes : int
            Bytes of a burst.
        streaming : bool, optional
            Build the path of streamed frames from the wire through the matcher `stereo` and back; by default if there
            is that matcher.
        with_icmp : bool
            Answer a ping.
        pipelined : bool
            See `Network` and `SlotTable`.

        Raises
        ------
        ValueError
            If a parameter is not as above. For a cache that is added later, when the SoC is finalized.
        """
        self.check_dma_name(name)
        self.check_if_exists(name)
        stereo = getattr(self, "stereo", None)
        if streaming is None:
            streaming = stereo is not None
        check(not streaming or stereo is not None,
            "streamed frames need a matcher: add it before the frame link, or set streaming to False.")
        # Only with SDRAM LiteX builds the bridge to the registers with registers: see `SlotTable`.
        check(not pipelined or hasattr(self, "sdram"), "a pipelined frame link needs an SoC with SDRAM.")
        if memory is None:
            memory = BusPorts(self, name)
        for constant, address in [("ADDRESS", ip_address), ("NETMASK", netmask), ("GATEWAY", gateway)]:
            self.add_constant(f"NETWORK_{constant}", as_int(convert_ip(address)))
        self.add_constant("NETWORK_MAC_HIGH", mac_address >> 32)
        self.add_constant("NETWORK_MAC_LOW",  as_int(mac_address & 0xffffffff))
        network    = Network(phy, udp_port, self.clk_freq, with_icmp, pipelined)
        read_port  = memory.get_port(mode="read")
        write_port = memory.get_port(mode="write")
        self.check_dma_ports(name, read_port, write_port)
        link       = FrameLink(
            read_port   = read_port,
            write_port  = write_port,
            port        = udp_port,
            max_chunks  = max_chunks,
            burst_bytes = burst_bytes,
            streaming   = streaming,
            pipelined   = pipelined,
        )
        self.comb += [
            network.mac_address.eq(Cat(link.mac_low, link.mac_high)),
            network.ip_address.eq(link.address),
            network.netmask.eq(link.netmask),
            network.gateway.eq(link.gateway),
            network.source.connect(link.sink),
            link.source.connect(network.sink),
        ]
        if stereo is not None:
            self.comb += link.matching.eq(stereo.busy)
        if streaming:
            # With cameras the pairs of the link pass through them.
            self.comb += [
                link.pairs.connect(getattr(stereo, "entry", stereo.pairs)),
                stereo.map.connect(link.map),
            ]
            stereo.streams = True
        self.add_module(name=f"{name}_network", module=network)
        self.add_module(name=name, module=link)
