#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""A device on a serial line, or on what carries one."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator

from ...core.settings import MatcherSettings
from ...link.console import run_line
from ...link.serial_channel import SerialChannel
from ...link.settings import LinkSettings
from ...link.transports import Transport
from ..base import Pair, Progress, Result, check_pair
from ..remote import RemoteDevice
from ..udp.frame import Frame
from .transfer import Transfer


class SerialDevice(RemoteDevice):
    """A device behind a byte transport; see `RemoteDevice`."""

    def __init__(self, url: str, transport: Transport, settings: LinkSettings | None = None,
                 on_close: Callable[[], None] | None = None) -> None:
        self._channel   = SerialChannel(transport)
        super().__init__(url, self._channel, settings, on_close)
        self._frame_ids = itertools.count(1)
        self._transfer  = Transfer(self._link)

    def _session_began(self) -> None:
        self._transfer = Transfer(self._link)

    def console(self, line: str, timeout_s: float = 10.0) -> str:
        """Types a line at the device's console; see `Device.console`."""
        with self._guarded():
            return run_line(self._link, self._channel, line, timeout_s)

    def _stream(self, pairs: Iterable[Pair], settings: MatcherSettings | None,
                progress: Progress | None) -> Iterator[Result]:
        """Matches pair after pair; while one is matched and fetched the next is on its way.

        Raises as `Device.stream`. If the iterator is dropped before its end, the frames under way are
        released.
        """
        settings = settings or self._info.default_settings()
        frames: list[Frame] = []
        try:
            with self._guarded():
                yield from self._matched(pairs, settings, progress, frames)
        finally:
            self._link.forget()
            self._release(frames)

    def _matched(self, pairs: Iterable[Pair], settings: MatcherSettings, progress: Progress | None,
                 frames: list[Frame]) -> Iterator[Result]:
        """The results; `frames` are those that are open meanwhile."""
        overlap = self._info.slots > 1
        previous: Frame | None = None
        for left, right in pairs:
            check_pair(left, right)
            self._info.check(left.shape[1], left.shape[0], settings)
            result = None
            if previous is not None and not overlap:
                result, previous = self._transfer.collect(previous, progress), None
                frames.clear()
            frame = Frame(next(self._frame_ids), (left, right), settings)
            # It counts as open from the request on: the reply may be what goes missing.
            frames.append(frame)
            self._transfer.begin_upload(frame, progress)
            if previous is not None:
                result = self._transfer.collect(previous, progress)
                frames.remove(previous)
            self._transfer.finish_upload(frame)
            previous = frame
            if result is not None:
                yield result
        if previous is not None:
            result = self._transfer.collect(previous, progress)
            frames.clear()
            yield result
