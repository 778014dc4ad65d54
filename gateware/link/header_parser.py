#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from .headers import *
from .message import datagram_description

# Header Parser ------------------------------------------------------------------------------------

@ResetInserter()
class HeaderParser(LiteXModule):
    """Take received frames apart: datagrams to a port, ARP messages, and requests for an echo.

    Each word of the headers is compared as it passes, which takes two clocks; a frame that is none of the three, or not
    for this device, is discarded. What is compared:

    - The receiver is the device's MAC address; for ARP it may also be the broadcast address.
    - ARP: IPv4 on Ethernet, a request or a reply, for the device's IP address.
    - IPv4: no options, no fragment, less than 2048 bytes, correct checksum, to the device's IP address.
    - UDP: to the port, with the length that the IP header implies.
    - ICMP: a request for an echo.

    A datagram's last word waits for the end of its frame, and has an error if the frame has one, or is too short. Of a
    datagram without payload one word comes. ARP messages and requests for an echo in such frames are discarded, and so
    are frames that end within the headers.

    Parameters
    ----------
    port : int
        UDP port of the device.
    """
    def __init__(self, port):
        self.sink        = stream.Endpoint(received_layout())      # Frames.
        self.source      = stream.Endpoint(datagram_description()) # Datagrams to the port.
        self.arp         = stream.Endpoint(arp_layout())           # ARP messages; for a clock, ready is not used.
        self.on          = Signal()   # There are addresses; without, all frames are discarded.
        self.mac_address = Signal(48) # Of the device,
        self.ip_address  = Signal(32) # and its IP address.
        # Request for an echo: words of ICMP's header and data, as they are on the wire, big-endian; then its end.
        self.echo_word   = Signal(32) # Word,
        self.echo_write  = Signal()   # if there is one.
        self.echo_begin  = Signal()   # Words of another frame follow.
        self.echo_done   = Signal()   # The request was correct (pulse).
        self.echo_bytes  = Signal(12) # Bytes of its header and data.
        self.sender      = Signal(32) # IP address of the sender of the datagram or the request.
        self.latency     = None       # A datagram's last word waits for the end of the frame.

        # # #

        self.word      = Signal(32)             # Word of the frame, big-endian.
        self.index     = Signal(4)              # Number of the word in the headers; HEADER_LAST + 1: after them.
        self.in_header = Signal()               # It is one of the headers,
        self.second    = Signal()               # in its second clock.
        self.good      = Signal(reset=1)        # The frame is one of the three so far.
        self.fits      = Signal()               # Its word in the headers is as it has to be.
        self.is_arp    = Signal()               # What it is.
        self.is_icmp   = Signal()
        self.remaining = Signal(12)             # Bytes of the IP packet from here on; after the headers, 4 more.
        self.moves     = Signal()               # The word is taken.
        self.enough    = Signal()               # The payload ends in this word,
        self.complete  = Signal()               # or in one before.

        self.add_words()
        self.add_checks(port)
        self.add_fields(port)
        self.add_payload()

    def add_words(self):
        """Count the words of a frame."""
        sink = self.sink
        self.comb += [
            self.word.eq(big_endian(sink.data)),
            self.in_header.eq(self.index != HEADER_LAST + 1),
            self.moves.eq(sink.valid & sink.ready),
        ]
        self.sync += [
            self.second.eq(sink.valid & self.in_header & ~self.second),
            If(self.moves,
                If(self.in_header,
                    self.index.eq(self.index + 1),
                    self.good.eq(self.good & self.fits)
                ),
                If(sink.last,
                    self.index.eq(0),
                    self.good.eq(1)
                )
            ),
        ]

    def add_checks(self, port):
        """Compare the words of the headers: the first clock compares, the second one judges."""
        word = self.word
        high, low = word[16:], word[:16]
        def found(condition):
            flag = Signal()
            self.sync += flag.eq(condition)
            return flag
        ours_high, ours_low = found(low == self.mac_address[32:]), found(word == self.mac_address[:32])
        all_high,  all_low  = found(high == 0xffff), found(low == 0xffff)
        ours       = found(word == self.ip_address)
        arp        = found(low == TYPE_ARP)
        ip         = found(low == TYPE_IP)
        arp_kinds  = found(word == ARP_KINDS)
        arp_length = found((high == ARP_LENGTHS) & ((low == ARP_REQUEST) | (low == ARP_REPLY)))
        ip_first   = found((word[24:] == IP_FIRST >> 8) & (word[11:16] == 0))
        whole      = found(word[:14] == 0)
        udp        = found(word[16:24] == PROTOCOL_UDP)
        icmp       = found(word[16:24] == PROTOCOL_ICMP)
        to_port    = found(low == port)
        echo       = found(high == ECHO_REQUEST)
        sized      = found((high[3:] != 0) & (high == Cat(self.remaining[:11], C(0, 5))) & ~self.remaining[11])
        # A request for an echo has no length: that of the IP packet has room for its header, which has as many bytes.
        roomy      = found((self.remaining[:11] >= UDP_BYTES) & ~self.remaining[11])

        to_us, to_all = Signal(), Signal() # The receiver so far.
        self.checksum = checksum = ChecksumAdder()
        summed        = found(((checksum.total == 0xffff) & ~checksum.carry)
            | ((checksum.total == 0xfffe) & checksum.carry))
        self.comb += [
            checksum.half.eq(Mux(self.second, low, high)),
            checksum.ce.eq(self.sink.valid & (self.index >= 4) & (self.index <= 8)),
            checksum.clear.eq(self.index == 3),
            self.fits.eq(1),
            Case(self.index, {
                0:  self.fits.eq(self.on & (ours_high | all_low)),
                1:  self.fits.eq((to_us & ours_low) | (to_all & all_high & all_low)),
                3:  self.fits.eq(arp | (ip & to_us)),
                4:  self.fits.eq(Mux(self.is_arp, arp_kinds, ip_first)),
                5:  self.fits.eq(Mux(self.is_arp, arp_length, whole)),
                6:  self.fits.eq(self.is_arp | udp | icmp),
                8:  self.fits.eq(self.is_arp | ours),
                9:  self.fits.eq(self.is_arp | Mux(self.is_icmp, echo, to_port)),
                10: self.fits.eq(Mux(self.is_arp, ours, summed & Mux(self.is_icmp, roomy, sized))),
            }),
        ]
        self.sync += If(self.moves,
            Case(self.index, {
                0: [to_us.eq(ours_high), to_all.eq(all_low)],
                1: [to_us.eq(to_us & ours_low), to_all.eq(to_all & all_high & all_low)],
                3: self.is_arp.eq(arp),
                6: self.is_icmp.eq(icmp),
            })
        )

    def add_fields(self, port):
        """Keep what the headers say."""
        word      = self.word
        mac_start = Signal(32) # Of an ARP message, as its words have them.
        ip_end    = Signal(16)
        request   = Signal()
        self.sync += If(self.moves,
            If(self.in_header,
                Case(self.index, {
                    5: request.eq(word[0]),
                    6: mac_start.eq(word),
                    7: self.sender.eq(word),
                    8: ip_end.eq(word[16:]),
                    9: self.source.src_port.eq(word[16:]),
                })
            ),
            If(self.index == 4,
                self.remaining.eq(word[:11])
            ).Else(
                self.remaining.eq(self.remaining - 4)
            ),
            If(self.index == HEADER_LAST,
                self.source.length.eq(self.remaining - UDP_BYTES),
                self.echo_bytes.eq(self.remaining)
            )
        )
        self.comb += [
            self.source.dst_port.eq(port),
            self.source.ip_address.eq(self.sender),
            self.arp.request.eq(request),
            self.arp.reply.eq(~request),
            self.arp.mac_address.eq(Cat(self.sender[16:], mac_start)),
            self.arp.ip_address.eq(Cat(ip_end, self.sender[:16])),
        ]

    def add_payload(self):
        """Pass the payload on, and judge the frame at its end."""
        sink, source = self.sink, self.source
        whole = Signal()  # If the frame ends here, it has all of the payload.
        need  = Signal(2) # Number of the payload's last byte in its word.
        free  = Signal()  # No word waits at the source.
        self.comb += [
            need.eq(self.remaining[:2] - 1),
            free.eq(~source.valid | source.ready),
            # The fields of a datagram stay until its last word is taken: the next frame does not begin before.
            sink.ready.eq(Mux(self.in_header, self.second & (free | (self.index != 0)), free)),
            # The remaining bytes have 4 more, as those of the word before are counted.
            self.enough.eq((self.remaining[4:] == 0) & (~self.remaining[3] | (self.remaining[:3] == 0))),
            whole.eq(self.complete | (self.enough & (sink.tail >= need))),
            self.arp.valid.eq(self.moves & sink.last & ~sink.error & ~self.in_header & self.good & self.is_arp),
            self.echo_word.eq(self.word),
            self.echo_begin.eq(self.index == 8),
            # 4 remain in the word after a request without data.
            self.echo_write.eq(self.moves & self.is_icmp & ~self.complete & (self.index > 8) & (self.remaining != 4)),
            self.echo_done.eq(self.moves & sink.last & ~sink.error & ~self.in_header & self.good & ~self.is_arp
                & self.is_icmp & whole),
        ]
        self.sync += [
            If(source.ready,
                source.valid.eq(0)
            ),
            If(self.moves & ~self.in_header & self.good & ~self.is_arp,
                self.complete.eq((self.complete | self.enough) & ~sink.last),
                If(~self.complete,
                    source.data.eq(sink.data),
                    source.last.eq(sink.last | self.enough)
                ),
                If(~self.is_icmp,
                    source.valid.eq(sink.last | ~(self.complete | self.enough)),
                    source.error.eq(Replicate(sink.last & (sink.error | ~whole), 4))
                )
            ),
        ]
        self.comb += If(source.last,
            Case(source.length[:2], {
                1:         source.last_be.eq(0b0001),
                2:         source.last_be.eq(0b0010),
                3:         source.last_be.eq(0b0100),
                "default": source.last_be.eq(0b1000),
            })
        )
