#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The map of a frame, or an image, in datagrams that a READ of many parts requests, or that come without one."""

from __future__ import annotations

import time
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...core.errors import LinkTimeout, ProtocolError
from ...link.link import Link
from ...protocol import payloads
from ...protocol.messages import CHUNK_BYTES, REPLY, ErrorCode, Message, MessageType
from ...protocol.refusals import refusal
from ..base import Progress

#: Most parts of the map that are requested and have not come, and most parts of one READ.
_MOST_PARTS = 128
_READ_PARTS = 32

#: Most READs in flight. A device queues 8, late copies among them.
_MOST_READS = 4

#: So many parts of later READs show that what an earlier one lacks is lost, not overtaken.
_OVERTAKEN = 32

#: Largest factor by which the wait for parts grows while none come.
_MOST_BACKOFF = 64

#: In place of the number of a READ: that of the parts that the device sends without one.
UNREQUESTED = -1

#: Share of the longest gap that is kept with each shorter one, and multiple of it that counts as the end of parts.
_KEPT       = 0.99
_GAP_MARGIN = 2


class GapEstimate:
    """Gaps between parts of maps, as a device may do something else before it sends the next one.

    If the longest recent gap is 100 ms, the rest counts as lost after 200 ms without a part.
    """

    def __init__(self) -> None:
        self._longest_s = 0.0

    def record(self, seconds: float) -> None:
        """Record a gap after which the next part came."""
        self._longest_s = max(seconds, _KEPT*self._longest_s)

    def end_s(self, patience_s: float) -> float:
        """Return the seconds without a part after which none will come, at least `patience_s`."""
        return max(patience_s, _GAP_MARGIN*self._longest_s)


@dataclass
class _Read:
    """A READ in flight.

    Parameters
    ----------
    number
        Number of the READ within this map.
    first, count
        First part that it requests, and how many.
    arrived
        How many of its parts have come.
    later
        How many parts of later READs have come meanwhile.
    """

    number:  int
    first:   int
    count:   int
    arrived: int = 0
    later:   int = 0


class UdpDownload:
    """A frame's map or an image on its way to the host, its parts in any order.

    The device sends the parts of a streamed frame without a request while it is matched (`live`). What is missing is
    requested after the last part has come, or when no more come.

    `stalled` counts the times that parts failed to come: the caller then has to ask whether the device is still there.

    Parameters
    ----------
    link
        The link to the device.
    room
        Number of parts that the host's receive buffer holds.
    gaps
        Gaps between the parts of earlier maps, to which those of this one are added.
    frame_id, place
        Number of the frame, and offsets of the map or the image in its download space; it begins with a part.
    progress
        Called with the steps of "download".
    live
        Whether parts come without a request.
    """

    def __init__(self, link: Link, room: int, gaps: GapEstimate, frame_id: int, place: range,
                 progress: Progress | None, live: bool = False) -> None:
        self.data       = bytearray(len(place))
        self.begun_at   = 0.0 if live else time.monotonic()
        self.stalled    = 0
        self._link      = link
        self._room      = max(1, min(room, _MOST_PARTS))
        self._gaps      = gaps
        self._frame_id  = frame_id
        self._start     = place.start
        self._progress  = progress
        self._live      = live
        self._count     = -(-len(place) // CHUNK_BYTES)
        self._wanted    = deque([] if live else [(0, self._count)])
        self._arrived   = np.zeros(self._count, bool)
        self._remaining = self._count
        self._reads:      list[_Read] = []
        self._numbers:    dict[int, int] = {}
        self._heard_at  = self._part_at = time.monotonic()
        self._backoff   = 1
        self._renewed   = 0
        self._report()

    @property
    def done(self) -> bool:
        """Return whether all of it has come."""
        return self._remaining == 0

    @property
    def late_at(self) -> float:
        """Return the time after which what has not come counts as lost."""
        return self._heard_at + self._backoff*self._gaps.end_s(self._link.patience_s)

    def listen(self, sequence: int) -> None:
        """Take the parts that come without a request after the STREAM of that sequence."""
        self._numbers[sequence] = UNREQUESTED
        self._link.listen(MessageType.READ, sequence, self._frame_id, self._on_live_part)

    def settle(self) -> None:
        """Allow requests: the frame has been matched, so that the map is in the device's memory."""
        self._heard_at = time.monotonic()
        self.begun_at  = self.begun_at or self._heard_at

    def fill(self) -> None:
        """Send the READs that the window allows, and again those that seem lost."""
        if self._live:
            if not self._arrived[-1] and time.monotonic() < self.late_at:
                return
            self._live = False
            self._want(np.flatnonzero(~self._arrived))
        if self._reads and time.monotonic() >= self.late_at:
            self.stalled += 1
            self._backoff = min(2*self._backoff, _MOST_BACKOFF)
            if self.stalled >= self._link.max_tries:
                raise LinkTimeout("the device answers, but no map comes: does the network carry datagrams of 1052 "
                                  "bytes?")
            self._renewed = len(self._numbers)
            self._ask_again(self._reads)
        in_flight = sum(read.count - read.arrived for read in self._reads)
        # Whole READs, so that the device has the next one queued when it has finished one.
        size = min(_READ_PARTS, self._room)
        while self._wanted and len(self._reads) < _MOST_READS and in_flight + size <= self._room:
            in_flight += self._read(size)

    def _read(self, most: int) -> int:
        """Request the first of the wanted parts, at most `most` of them; return how many."""
        first, wanted = self._wanted.popleft()
        # Some of them may have come late.
        here  = self._arrived[first:first + wanted]
        skip  = int(np.argmin(here))
        count = 0 if here[skip] else min(most, int(np.argmax([*here[skip:], True])))
        if 0 < skip + count < wanted:
            self._wanted.appendleft((first + skip + count, wanted - skip - count))
        if count == 0:
            return 0
        first += skip
        begin  = first*CHUNK_BYTES
        length = min(count*CHUNK_BYTES, len(self.data) - begin)
        if not self._reads:
            self._heard_at = time.monotonic()
            if not self.stalled:
                self._part_at = self._heard_at
        sequence = self._link.request_burst(MessageType.READ, payloads.pack_number(length), self._frame_id,
                                            self._start + begin, self._on_part)
        self._numbers[sequence] = len(self._numbers)
        self._reads.append(_Read(self._numbers[sequence], first, count))
        return count

    def _on_live_part(self, reply: Message) -> None:
        """Handle a part that came without a request; an ERROR reply to the STREAM is handled elsewhere."""
        if reply.type == MessageType.READ | REPLY:
            self.begun_at = self.begun_at or time.monotonic()
            self._on_part(reply)

    def _on_part(self, reply: Message) -> None:
        """Handle a part of the map, or an ERROR reply."""
        if reply.type != MessageType.READ | REPLY:
            self._on_refusal(reply)
            return
        begin      = reply.offset - self._start
        part, rest = divmod(begin, CHUNK_BYTES)
        if rest or not 0 <= part < self._count:
            raise ProtocolError(f"the device sent a part of the map at offset {reply.offset}, where none begins")
        length = min(CHUNK_BYTES, len(self.data) - begin)
        if len(reply.payload) != length:
            raise ProtocolError(f"the device sent {len(reply.payload)} bytes of the map instead of {length}")
        number         = self._numbers[reply.sequence]
        self._heard_at = time.monotonic()
        # After a stall only a part of an earlier READ tells how long the gap was. Parts without a request come as fast
        # as the images are sent.
        if number != UNREQUESTED and (not self.stalled or number < self._renewed):
            self._gaps.record(self._heard_at - self._part_at)
        self._part_at = self._heard_at
        if self._arrived[part]:
            self._link.counters.parts_repeated += 1
            return
        self._arrived[part] = True
        self._remaining    -= 1
        self._backoff       = 1
        self.stalled        = 0
        self._link.counters.parts_received += 1
        self.data[begin:begin + length] = reply.payload
        self._count_part(part, number)
        self._report()

    def _count_part(self, part: int, number: int) -> None:
        """Count a part that came for the READ of that number, and request again what it shows as lost."""
        finished = overtaken = False
        for read in self._reads:
            if read.first <= part < read.first + read.count:
                read.arrived += 1
                finished      = finished or read.arrived == read.count
            elif read.number < number:
                read.later += 1
                overtaken   = overtaken or read.later >= _OVERTAKEN
        if finished:
            self._reads = [read for read in self._reads if read.arrived < read.count]
        if overtaken:
            self._ask_again([read for read in self._reads if read.later >= _OVERTAKEN])

    def _ask_again(self, reads: list[_Read]) -> None:
        """Give up `reads`, and want first what they have not brought."""
        for read in reversed(reads):
            self._want(np.flatnonzero(~self._arrived[read.first:read.first + read.count]) + read.first)
        self._reads = [read for read in self._reads if read not in reads]

    def _want(self, missing: NDArray[np.intp]) -> None:
        """Want first these parts, which should have come."""
        if len(missing):
            for parts in reversed(np.split(missing, np.flatnonzero(np.diff(missing) > 1) + 1)):
                self._wanted.appendleft((int(parts[0]), len(parts)))
        self._link.counters.parts_asked_again += len(missing)

    def _on_refusal(self, reply: Message) -> None:
        """Handle an ERROR reply to a READ: if the device had no room to queue it, it is requested again later."""
        code, _, _ = payloads.unpack_error(reply.payload)
        if code != ErrorCode.BUSY:
            raise refusal(reply)

    def _report(self) -> None:
        if self._progress is not None:
            self._progress("download", self._count - self._remaining, self._count)

    def forget(self) -> None:
        """Stop requesting, and ignore replies."""
        for sequence in self._numbers:
            self._link.end_burst(sequence)
        self._reads.clear()
        self._wanted.clear()
