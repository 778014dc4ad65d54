#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Messages of the link in the gateware: numbers and layouts. docs/protocol.md defines them."""

from litex.soc.interconnect.stream import EndpointDescription

from liteeth.common  import eth_udp_user_description

MAGIC   = 0x534c # "LS".
VERSION = 1

TYPE_UPLOAD = 0x04
TYPE_READ   = 0x07
TYPE_PAIRS  = 0x0d
REPLY_BIT   = 0x80

CHUNK_BYTES   = 1024
HEADER_WORDS  = 6 # Of 32 bits: magic, version, type; session; sequence; frame id; offset; length.
FRAME_BYTES   = 4*HEADER_WORDS + 4 # Header and CRC: all of a message but its payload.
MESSAGE_BYTES = FRAME_BYTES + CHUNK_BYTES
MESSAGE_WORDS = MESSAGE_BYTES//4

MAILBOX_ENTRY_BYTES = 2048 # Stride of the mailbox: an entry is a message and its sender.

def datagram_description():
    """Return the description of a datagram, as LiteEth's UDP core has them.

    Words of 32 bits, the first byte in the low bits; `last_be` marks the last byte.
    """
    return eth_udp_user_description(32)

def peer_layout():
    """Return the layout of the address of a datagram's sender or receiver."""
    return [("address", 32), ("port", 16)]

def message_description():
    """Return the description of a message: words of 32 bits, the last one marked; its bytes and its sender."""
    return EndpointDescription([("data", 32)], [("bytes", 11)] + peer_layout())

def job_layout():
    """Return the layout of a message to send, or of a burst of them: receiver, header and place of the payload."""
    return peer_layout() + [
        ("type",      8),
        ("session",  32),
        ("sequence", 32),
        ("frame_id", 32),
        ("offset",   32), # Of the payload in its space, for the header.
        ("base",     32), # Byte address of the payload.
        ("length",   32), # Bytes of payload.
    ]
