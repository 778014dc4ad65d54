#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The frame link in Verilator with a memory: datagrams in, datagrams out, and the registers that software sees."""

from __future__ import annotations

import zlib
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from litex.gen import LiteXModule
from litex.soc.interconnect import stream
from migen import Cat, Signal

from litestereo.gateware.link.event_counters import COUNTER_NUMBERS
from litestereo.gateware.link.message import TYPE_PAIRS
from litestereo.gateware.peripherals.frame_link import FrameLink
from litestereo.gateware.peripherals.frame_link_csr import COUNTERS
from litestereo.host_tools.protocol.messages import CHUNK_BYTES, Message, MessageType
from litestereo.sim.cores.stream_core import StreamCore
from litestereo.soc.parts.wide_ram import WideRAM

ADDRESS, PORT     = 0xc0a80132, 19539
PEER              = (0xc0a80164, 40000)
SLOTS, MAX_CHUNKS = 4, 64
MEMORY_BYTES      = 1 << 17
SLOT_BYTES        = 24*CHUNK_BYTES
MAILBOX_BASE      = 1 << 16
WIRE              = [("data", 32), ("last_be", 4), ("error", 4), ("address", 32), ("port", 16)]
SHARED            = {"valid", "ready", "last", "data", "last_be", "error"}

JOB = ("address", "port", "type", "session", "sequence", "frame_id", "offset", "base", "length")


class LinkInRAM(LiteXModule):
    """Frame link and memory, with a plain stream on each side, and Signals instead of registers.

    There is no matcher: each pixel pair becomes a disparity, so pairs come back as parts of a map.
    """
    def __init__(self, data_width: int) -> None:
        self.ram    = ram  = WideRAM(MEMORY_BYTES, data_width)
        self.link   = link = FrameLink(ram.get_port("read"), ram.get_port("write"), PORT, SLOTS, MAX_CHUNKS,
                                       streaming=True, with_csr=False)
        self.sink   = stream.Endpoint(WIRE)
        self.source = stream.Endpoint([*WIRE, ("length", 16)])
        self.comb += [
            self.sink.connect(link.sink, keep=SHARED),
            link.sink.ip_address.eq(self.sink.address),
            link.sink.src_port.eq(self.sink.port),
            link.source.connect(self.source, keep=SHARED),
            self.source.length.eq(link.source.length),
            self.source.address.eq(link.source.ip_address),
            self.source.port.eq(link.source.dst_port),
        ]
        self.slow = Signal(4) # Bits of a counter that must be 0 for a pair to pass.
        count     = Signal(4)
        awake     = Signal()
        self.sync += count.eq(count + 1)
        self.comb += [
            awake.eq((count & self.slow) == 0),
            link.pairs.ready.eq(awake),
            link.map.valid.eq(link.pairs.valid & awake),
            link.map.disparity.eq(Cat(link.pairs.left, link.pairs.right)),
            link.map.last.eq(link.pairs.last),
        ]
        table, sorter, queue = link.table, link.sorter, link.queue
        self.settings = {
            "enable": sorter.enable, "token": sorter.token, "peer_address": sorter.peer_address,
            "peer_port": sorter.peer_port, "mailbox_base": sorter.mailbox_base, "consumed": sorter.consumed,
            "slot": table.slot, "slot_frame_id": table.frame_id, "slot_base": table.base, "slot_pixels": table.pixels,
            "open": table.open, "close": table.close, "arrived_index": table.arrived_index,
            "reply": queue.reply, "burst": queue.burst, "abort": queue.abort,
            "stream_frame_id": link.gate.frame_id, "stream_pixels": link.gate.pixels, "sequence": link.sequence,
            "stream_open": link.gate.open, "stream_close": link.gate.close, "slow": self.slow,
            "matching": link.matching, "counter_index": link.counters.index, "counter_read": link.counters.read,
        } | {f"send_{name}": getattr(queue.job, name) for name in JOB}
        self.status = {
            "clearing": table.clearing, "writing": sorter.writing, "arrived": table.arrived, "missing": table.missing,
            "produced": sorter.produced, "reply_busy": queue.reply_busy, "burst_busy": queue.burst_busy,
            "opened": link.gate.opened, "sending": link.parts.sending, "offset": link.gate.offset,
            "counter": link.counters.value,
        }
        for name, signal in self.settings.items():
            port = Signal.like(signal)
            setattr(self, f"set_{name}", port)
            self.comb += signal.eq(port)
        for name, signal in self.status.items():
            setattr(self, f"get_{name}", signal)


@dataclass(frozen=True)
class Datagram:
    """Bytes, and the address and port of their sender or receiver."""
    data: bytes
    peer: tuple[int, int] = PEER
    error: bool = False


def wire_items(datagrams: Iterable[Datagram]) -> tuple[np.ndarray, np.ndarray]:
    """Return datagrams as items of `WIRE`, and the marks `last`."""
    rows, lasts = [], []
    for datagram in datagrams:
        count = max(1, -(-len(datagram.data)//4))
        words = np.frombuffer(datagram.data.ljust(4*count, b"\x55"), "<u4")
        item  = np.zeros((count, 3), np.uint64)
        be    = np.zeros(count, np.uint64)
        be[-1] = 1 << (len(datagram.data) - 1) % 4
        address, port = datagram.peer
        error = np.full(count, 0xf if datagram.error else 0, np.uint64)
        # Bit positions from 0: data 32, last_be 4, error 4, address 32, port 16.
        item[:, 0] = words
        item[:, 1] = be | error << np.uint64(4) | np.uint64((address & 0xffffff) << 8)
        item[:, 2] = address >> 24 | port << 8
        rows.append(item)
        mark     = np.zeros(count, bool)
        mark[-1] = True
        lasts.append(mark)
    return np.concatenate(rows).astype(np.uint32), np.concatenate(lasts)


class LinkBench:
    """What firmware and host do with the link, in Verilator."""
    def __init__(self, data_width: int = 128) -> None:
        dut       = LinkInRAM(data_width)
        self.core = StreamCore(dut, [f"set_{name}" for name in dut.settings],
                               status=[f"get_{name}" for name in dut.status])
        self.begin()

    def begin(self, token: int = 0x1234) -> None:
        """Start a session, as the firmware does."""
        self.set(enable=1, token=token, peer_address=PEER[0], peer_port=PEER[1], mailbox_base=MAILBOX_BASE, consumed=0)

    def set(self, **values: int) -> None:
        """Drive Signals that replace registers."""
        self.core.set(**{f"set_{name}": value for name, value in values.items()})

    def get(self, name: str) -> int:
        """Return a status."""
        return self.core.get(f"get_{name}")

    def pulse(self, name: str) -> None:
        """Set a Signal for one clock."""
        self.set(**{name: 1})
        self.clocks(1)
        self.set(**{name: 0})
        self.clocks(1)

    def clocks(self, count: int) -> None:
        """Run some clocks with an idle wire that accepts nothing from the device."""
        self.core.run(np.zeros((0, 3), np.uint32), 1, ready=0.0, idle_clocks=count)

    def receive(self, datagrams: Iterable[Datagram], valid: float = 1.0, seed: int = 0, settle: int = 3000) -> None:
        """Put datagrams on the wire, and wait until the device has handled them."""
        words, last = wire_items(datagrams)
        self.core.run(words, 1, last=last, valid=valid, ready=0.0, seed=seed, idle_clocks=settle)

    def open(self, slot: int, frame_id: int, pixels: int) -> None:
        """Open a slot for a frame."""
        self.set(slot=slot, slot_frame_id=frame_id, slot_base=slot*SLOT_BYTES, slot_pixels=pixels)
        self.pulse("open")
        while self.get("clearing"):
            self.clocks(1)

    def close(self, slot: int) -> None:
        """Close a slot."""
        self.set(slot=slot)
        self.pulse("close")

    def open_stream(self, frame_id: int, pixels: int, sequence: int = 1) -> None:
        """Accept the pairs of a frame, and send its map."""
        self.set(stream_frame_id=frame_id, stream_pixels=pixels, sequence=sequence)
        self.pulse("stream_open")

    def close_stream(self) -> None:
        """Abort the streamed frame, and wait until the part that is being sent is sent."""
        self.pulse("stream_close")
        self.take(1)

    def arrived(self, slot: int, chunks: int) -> list[bool]:
        """Return which chunks of a slot have arrived."""
        flags = []
        for word in range(-(-chunks//32)):
            self.set(arrived_index=slot*(MAX_CHUNKS//32) + word)
            self.clocks(3)
            flags += [bool(self.get("arrived") >> bit & 1) for bit in range(32)]
        return flags[:chunks]

    def missing(self, slot: int) -> int:
        """Return how many chunks the slot lacks."""
        self.set(arrived_index=slot*(MAX_CHUNKS//32))
        self.clocks(3)
        return self.get("missing")

    def stage(self, **job: int) -> None:
        """Set the fields of a job; those not named are 0."""
        self.set(**{f"send_{name}": job.get(name, 0) for name in JOB})

    def send(self, kind: str, outputs: int, ready: float = 1.0, seed: int = 0, **job: int) -> list[Datagram]:
        """Start a `reply` or a `burst`, and return as many datagrams from the wire."""
        self.stage(**job)
        self.pulse(kind)
        return self.take(outputs, ready, seed)

    def take(self, outputs: int, ready: float = 1.0, seed: int = 0) -> list[Datagram]:
        """Return the next datagrams that the device sends; fewer if it stops."""
        datagrams: list[Datagram] = []
        data = bytearray()
        while len(datagrams) < outputs:
            item = self.core.run(np.zeros((0, 3), np.uint32), 1, ready=ready, seed=seed + len(data), idle_clocks=5000)
            if not len(item.words):
                break
            low, middle, high = (int(word) for word in item.words[0][:3])
            be = middle & 0xf
            data += low.to_bytes(4, "little")[:be.bit_length() if item.last[0] else 4]
            if item.last[0]:
                assert high >> 24 | int(item.words[0][3]) << 8 == len(data)
                datagrams.append(Datagram(bytes(data), (middle >> 8 | (high & 0xff) << 24, high >> 8 & 0xffff)))
                data.clear()
        return datagrams

    def memory(self, base: int, length: int) -> bytes:
        """Return bytes of the memory, as the device sends them."""
        count     = -(-length//CHUNK_BYTES)
        datagrams = self.send("burst", count, base=base, length=length, address=PEER[0], port=PEER[1])
        assert len(datagrams) == count
        return b"".join(Message.decode(datagram.data).payload for datagram in datagrams)

    def counters(self) -> dict[str, int]:
        """Return all counters."""
        return {name: self.counter(number) for number, name in zip(COUNTER_NUMBERS, COUNTERS, strict=True)}

    def counter(self, number: int) -> int:
        """Return a counter, read as software does."""
        self.set(counter_index=number)
        self.pulse("counter_read")
        self.clocks(2)
        return self.get("counter")


def chunk_offsets(pixels: int) -> list[tuple[int, int]]:
    """Return offset and length of every chunk of a frame whose images have so many pixels."""
    pitch = -(-pixels//CHUNK_BYTES)*CHUNK_BYTES
    return [(base + start, min(CHUNK_BYTES, pixels - start))
            for base in (0, pitch) for start in range(0, pixels, CHUNK_BYTES)]


def upload(frame_id: int, offset: int, payload: bytes, token: int = 0x1234, **fields: int) -> bytes:
    """Return an UPLOAD as bytes."""
    return Message(MessageType.UPLOAD, token, 1, frame_id, offset, payload, **fields).encode()


def pairs(frame_id: int, offset: int, payload: bytes, token: int = 0x1234) -> bytes:
    """Return a chunk of pairs as bytes."""
    return Message(TYPE_PAIRS, token, 1, frame_id, offset, payload).encode()


def with_crc(data: bytes) -> bytes:
    """Return bytes followed by their CRC-32, which makes them a valid message."""
    return data + zlib.crc32(data).to_bytes(4, "little")
