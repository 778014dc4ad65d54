#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Messages of the link as gateware sees them: numbers and layouts. docs/protocol.md says what they mean."""

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
FRAME_BYTES   = 4*HEADER_WORDS + 4 # What a message has beside its payload: header and CRC.
MESSAGE_BYTES = FRAME_BYTES + CHUNK_BYTES
MESSAGE_WORDS = MESSAGE_BYTES//4

MAILBOX_ENTRY_BYTES = 2048 # Stride of the mailbox: a message, and who sent it.

def datagram_description():
    """A datagram of LiteEth's UDP core, words of 32 bits, the first byte in the low bits; `last_be` marks the last byte."""
    return eth_udp_user_description(32)

def peer_layout():
    """Who sent a datagram, or is to get one."""
    return [("address", 32), ("port", 16)]

def message_description():
    """A message as words of 32 bits, `last` with its last one; its bytes and its sender."""
    return EndpointDescription([("data", 32)], [("bytes", 11)] + peer_layout())

def job_layout():
    """A message to be sent, or a run of them: its peer, fields of its header, and where its payload is."""
    return peer_layout() + [
        ("type",      8),
        ("session",  32),
        ("sequence", 32),
        ("frame_id", 32),
        ("offset",   32), # Of the payload in its space, for the header.
        ("base",     32), # Byte address of the payload.
        ("length",   32), # Bytes of payload.
    ]
