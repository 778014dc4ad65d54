#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Ethernet, ARP, IPv4, UDP and ICMP as words of 32 bits: numbers, layouts, and the checksum of a header.

Two bytes of padding are in front of each frame. So all headers end with a word:

    word    Ethernet            word    IPv4                 UDP or ICMP          ARP
    0       padding, receiver   4       version, length                           kinds of address
    1       receiver            5       fragment                                  their lengths, operation
    2       sender              6       protocol, checksum                        sender's MAC
    3       sender, type        7       sender                                    sender's MAC, sender
                                8       receiver                                  sender, receiver's MAC
                                9                            ports or type        receiver's MAC
                                10                           length, checksum     receiver
"""

from migen import *

HEADER_LAST = 10 # Number of the last word of the headers; the payload begins in the next one.

TYPE_IP     = 0x0800
TYPE_ARP    = 0x0806
IP_FIRST    = 0x4500     # Version 4, a header of 5 words.
ARP_KINDS   = 0x00010800 # IPv4 on Ethernet.
ARP_LENGTHS = 0x0604
ARP_REQUEST = 1
ARP_REPLY   = 2
PROTOCOL_ICMP = 1
PROTOCOL_UDP  = 17
ECHO_REQUEST  = 0x0800   # Type and code of ICMP.
TIME_TO_LIVE  = 128

IP_BYTES    = 20         # Header of IPv4,
UDP_BYTES   = 8          # and of UDP; ICMP's echo has one of as many bytes.

ECHO_WORDS  = 32         # Of ICMP's header and data: up to 120 bytes of data are echoed.

def received_layout():
    """Return the layout of words of received frames: in the last word the number of its last byte, and an error."""
    return [("data", 32), ("tail", 2), ("error", 1)]

def sent_layout():
    """Return the layout of words of frames to send: in the last word the number of its last byte."""
    return [("data", 32), ("tail", 2)]

def arp_layout():
    """Return the layout of an ARP message: what it is, and the address of the other station."""
    return [("reply", 1), ("request", 1), ("ip_address", 32), ("mac_address", 48)]

def big_endian(word):
    """Return a word whose first byte is in the high bits instead of the low ones, or the reverse."""
    return Cat(word[24:32], word[16:24], word[8:16], word[0:8])

class ChecksumAdder(Module):
    """Add half words as the Internet checksum does: a carry is added to the next one."""
    def __init__(self):
        self.half  = Signal(16) # Half word.
        self.ce    = Signal()   # Add it.
        self.clear = Signal()   # Begin again, at 0.
        self.total = Signal(16) # Sum of the half words so far, but for
        self.carry = Signal()   # the carry of the last one.

        # # #

        # The lowest bit of this sum makes the carry that is added, without a second adder.
        both = Signal(18)
        self.comb += both.eq(Cat(self.carry, self.total) + Cat(1, self.half))
        self.sync += If(self.clear,
            self.total.eq(0),
            self.carry.eq(0)
        ).Elif(self.ce,
            self.total.eq(both[1:17]),
            self.carry.eq(both[17])
        )
