#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The map of a frame from a device, in datagrams that a READ of many asks for, or that come by themselves."""

from __future__ import annotations

import time
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...core.errors import LinkTimeout, ProtocolError
from ...protocol import payloads
from ...protocol.messages import CHUNK_BYTES, REPLY, ErrorCode, Message, MessageType
from ...protocol.refusals import refusal
from ..base import Progress
from .frame import Frame
from .route import Route

#: Parts of the map that are asked for and have not come, at most, and those of one READ.
_MOST_PARTS = 128
_READ_PARTS = 32

#: READs that are not through, at most. A device keeps 8 in line, and late copies are among them.
_MOST_READS = 4

#: So many parts of later READs show that what an earlier one lacks has been lost, not overtaken.
_OVERTAKEN = 32


@dataclass
class _Read:
    """A READ under way: its number, its first part, how many parts, how many came, and how many of later READs."""

    number: int
    first:  int
    count:  int
    come:   int = 0
    later:  int = 0


#: Number of the STREAM that parts of a streamed frame's map answer, before all READs.
_BY_THEMSELVES = -1


class Download:
    """A frame's map on its way, its parts in whatever order they come.

    Parts of a streamed frame's map come by themselves (`live`), while it is matched; what is missing is asked for
    once the last of them has come, or nothing does any more.

    `stalled` counts the times that parts failed to come; somebody has to look whether the device is still there.
    """

    def __init__(self, route: Route, frame: Frame, progress: Progress | None, live: bool = False) -> None:
        self._link      = route.link
        self._lulls     = route.lulls
        self._room      = max(1, min(route.channel.room, _MOST_PARTS))
        self._frame     = frame
        self._progress  = progress
        self._count     = -(-frame.map_bytes // CHUNK_BYTES)
        self._live      = live
        self._wanted    = deque([] if live else [(0, self._count)])
        self._came      = np.zeros(self._count, bool)
        self._left      = self._count
        self._reads:      list[_Read] = []
        self._numbers:    dict[int, int] = {}
        self._heard_at  = self._part_at = time.monotonic()
        self._backoff   = 1
        self._renewed   = 0
        self.stalled    = 0
        self._report()

    @property
    def done(self) -> bool:
        """Whether all of the map has come."""
        return self._left == 0

    @property
    def late_at(self) -> float:
        """When what has not come until then counts as lost."""
        return self._heard_at + self._backoff*self._lulls.end_s(self._link.patience_s)

    def listen(self, sequence: int) -> None:
        """Takes parts that come by themselves after the STREAM of that sequence."""
        self._numbers[sequence] = _BY_THEMSELVES
        self._link.listen(MessageType.READ, sequence, self._frame.frame_id, self._take_live)

    def settle(self) -> None:
        """The frame has been matched, so the map is in the device's memory and may be asked for."""
        self._heard_at = time.monotonic()

    def fill(self) -> None:
        """Sends the READs that the window allows, and again those that seem lost."""
        if self._live:
            if not self._came[-1] and time.monotonic() < self.late_at:
                return
            self._live = False
            self._want(np.flatnonzero(~self._came))
        if self._reads and time.monotonic() >= self.late_at:
            self.stalled += 1
            self._backoff = min(2*self._backoff, 64)
            if self.stalled >= self._link.max_tries:
                raise LinkTimeout("the device answers, but no map comes: does the network carry datagrams of 1052 "
                                  "bytes?")
            self._renewed = len(self._numbers)
            self._ask_again(self._reads)
        under_way = sum(read.count - read.come for read in self._reads)
        # Whole READs, so that the device has the next one in line when it is through with one.
        size = min(_READ_PARTS, self._room)
        while self._wanted and len(self._reads) < _MOST_READS and under_way + size <= self._room:
            under_way += self._read(size)

    def _read(self, most: int) -> int:
        """Asks for the first parts that are wanted, at most so many of them; returns how many."""
        first, wanted = self._wanted.popleft()
        # Some may have come late.
        here  = self._came[first:first + wanted]
        skip  = int(np.argmin(here))
        count = 0 if here[skip] else min(most, int(np.argmax([*here[skip:], True])))
        if 0 < skip + count < wanted:
            self._wanted.appendleft((first + skip + count, wanted - skip - count))
        if count == 0:
            return 0
        first += skip
        offset = first*CHUNK_BYTES
        length = min(count*CHUNK_BYTES, self._frame.map_bytes - offset)
        if not self._reads:
            self._heard_at = time.monotonic()
            if not self.stalled:
                self._part_at = self._heard_at
        sequence = self._link.request_burst(MessageType.READ, payloads.pack_number(length), self._frame.frame_id,
                                            offset, self._take)
        self._numbers[sequence] = len(self._numbers)
        self._reads.append(_Read(self._numbers[sequence], first, count))
        return count

    def _take_live(self, reply: Message) -> None:
        """Takes in a part of the map that has come by itself; a refused STREAM is not its business."""
        if reply.type == MessageType.READ | REPLY:
            self._frame.download_at = self._frame.download_at or time.monotonic()
            self._take(reply)

    def _take(self, reply: Message) -> None:
        """Takes in a part of the map, or an ERROR reply."""
        if reply.type != MessageType.READ | REPLY:
            self._refused(reply)
            return
        part, rest = divmod(reply.offset, CHUNK_BYTES)
        if rest or part >= self._count:
            raise ProtocolError(f"the device sent a part of the map at offset {reply.offset}, where none is")
        length = min(CHUNK_BYTES, self._frame.map_bytes - reply.offset)
        if len(reply.payload) != length:
            raise ProtocolError(f"the device sent {len(reply.payload)} bytes of the map instead of {length}")
        number         = self._numbers[reply.sequence]
        self._heard_at = time.monotonic()
        # After a stall only a part that was asked for before it tells how long the silence was. What comes by itself
        # comes as fast as the images go.
        if number != _BY_THEMSELVES and (not self.stalled or number < self._renewed):
            self._lulls.note(self._heard_at - self._part_at)
        self._part_at = self._heard_at
        if self._came[part]:
            self._link.counters.parts_repeated += 1
            return
        self._came[part] = True
        self._left      -= 1
        self._backoff    = 1
        self.stalled     = 0
        self._link.counters.parts_received += 1
        self._frame.store_part(reply.offset, reply.payload)
        self._note(part, number)
        self._report()

    def _note(self, part: int, number: int) -> None:
        """Notes that a part has come, by the READ of that number, and asks again for what it shows as lost."""
        through = overtaken = False
        for read in self._reads:
            if read.first <= part < read.first + read.count:
                read.come += 1
                through    = through or read.come == read.count
            elif read.number < number:
                read.later += 1
                overtaken   = overtaken or read.later >= _OVERTAKEN
        if through:
            self._reads = [read for read in self._reads if read.come < read.count]
        if overtaken:
            self._ask_again([read for read in self._reads if read.later >= _OVERTAKEN])

    def _ask_again(self, reads: list[_Read]) -> None:
        """Puts what `reads` have not brought first among what is wanted."""
        for read in reversed(reads):
            self._want(np.flatnonzero(~self._came[read.first:read.first + read.count]) + read.first)
        self._reads = [read for read in self._reads if read not in reads]

    def _want(self, missing: NDArray[np.intp]) -> None:
        """Puts parts that should have come first among what is wanted."""
        if len(missing):
            for run in reversed(np.split(missing, np.flatnonzero(np.diff(missing) > 1) + 1)):
                self._wanted.appendleft((int(run[0]), len(run)))
        self._link.counters.parts_asked_again += len(missing)

    def _refused(self, reply: Message) -> None:
        """Takes in that a READ was refused: it may stand in line too early, and is then asked for again."""
        code, _, _ = payloads.unpack_error(reply.payload)
        if code != ErrorCode.BUSY:
            raise refusal(reply)

    def _report(self) -> None:
        if self._progress is not None:
            self._progress("download", self._count - self._left, self._count)

    def forget(self) -> None:
        """Ignores what may still come."""
        for sequence in self._numbers:
            self._link.end_burst(sequence)
        self._reads.clear()
        self._wanted.clear()
