#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""How many chunks may be on their way, and after how many of them to ask what is missing."""

from __future__ import annotations

#: Chunks on their way at most: what fits the buffers of any system, and keeps a wire of 1 Gbit/s busy.
_MOST_CHUNKS = 64

#: Batches on their way at most. Each ends with a request, of which a device keeps 8 waiting, with those for maps.
_MOST_BATCHES = 4

_FIRST_BATCH    = 16
_SMALLEST_BATCH = 4

#: Share of a batch above which its losses show that it was too large.
_LOSSY = 0.125


class UploadWindow:
    """Chunks of all frames on their way to a device; it has the size that the way has shown to bear."""

    def __init__(self) -> None:
        self.batch    = _FIRST_BATCH
        self._chunks  = 0
        self._batches = 0

    def take(self, wanted: int) -> int:
        """Number of chunks, at most `wanted`, that may be sent now as a batch; 0 is to wait for some to arrive."""
        count = min(wanted, self.batch)
        if self._batches and (self._batches >= _MOST_BATCHES or self._chunks + count > _MOST_CHUNKS):
            return 0
        self._chunks  += count
        self._batches += 1
        return count

    def give_back(self, count: int) -> None:
        """A batch of `count` chunks is not on its way any more."""
        self._chunks  -= count
        self._batches -= 1

    def learn(self, count: int, lost: int) -> None:
        """A batch of `count` chunks, of which `lost` did not arrive, was answered."""
        if lost > _LOSSY*count:
            self.batch = max(_SMALLEST_BATCH, self.batch // 2)
        elif lost == 0:
            self.batch = min(_MOST_CHUNKS // _MOST_BATCHES, self.batch + 1)
