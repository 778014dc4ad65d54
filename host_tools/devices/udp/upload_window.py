#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""How many chunks may be on their way, and after how many of them to ask what is missing."""

from __future__ import annotations

#: Batches on their way at most. Each ends with a request, of which a device keeps 8 waiting, with those for maps.
_MOST_BATCHES = 3

#: Chunks of a batch. All that are on their way fit the buffers of any system, and keep a wire of 1 Gbit/s busy. A
#: device whose CPU is slow to answer gets more of the wire the larger batches are.
_SMALLEST_BATCH = 4
_FIRST_BATCH    = 16
_LARGEST_BATCH  = 48

#: Share of a batch above which its losses show that it was too large.
_LOSSY = 0.125


class UploadWindow:
    """Chunks of all frames on their way to a device; it has the size that the way has shown to bear."""

    def __init__(self) -> None:
        self.batch    = _FIRST_BATCH
        self._batches = 0

    def take(self, wanted: int) -> int:
        """Number of chunks, at most `wanted`, that may be sent now as a batch; 0 is to wait for some to arrive."""
        if self._batches >= _MOST_BATCHES:
            return 0
        self._batches += 1
        return min(wanted, self.batch)

    def give_back(self) -> None:
        """A batch is not on its way any more."""
        self._batches -= 1

    def learn(self, count: int, lost: int) -> None:
        """A batch of `count` chunks, of which `lost` did not arrive, was answered."""
        if lost > _LOSSY*count:
            self.batch = max(_SMALLEST_BATCH, self.batch // 2)
        elif lost == 0:
            self.batch = min(_LARGEST_BATCH, self.batch + 2)
