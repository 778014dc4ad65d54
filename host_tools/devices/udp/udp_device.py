#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""A device on a network."""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Callable, Iterable, Iterator

from ...core.errors import DeviceError, UnsupportedError
from ...core.features import Feature
from ...core.settings import MatcherSettings
from ...link.settings import LinkSettings
from ...link.udp_channel import UdpChannel
from ...protocol import payloads
from ...protocol.messages import MessageType
from ..base import Pair, Progress, Result, check_pair
from ..pipeline import Pipeline
from ..remote import RemoteDevice
from .frame import Frame
from .route import Route

#: Released frames that a late copy of their OPEN may open again; more than datagrams change places by.
_FORMER_FRAMES = 32


class UdpDevice(RemoteDevice):
    """A device behind datagrams; see `RemoteDevice`.

    `streamed` says whether the frames of the next stream are matched as their pixels come, past the device's memory.
    Raises UnsupportedError if the device cannot do that.
    """

    def __init__(self, url: str, channel: UdpChannel, settings: LinkSettings | None = None,
                 on_close: Callable[[], None] | None = None, *, streamed: bool = False) -> None:
        super().__init__(url, channel, settings, on_close)
        if streamed and not self._info.features & Feature.STREAMING:
            self.close()
            raise UnsupportedError(f"{self._info.name} was built without streaming: leave mode=streamed out, or use a "
                                   "device that has it, see `litestereo info`")
        self.streamed    = streamed
        self._frame_ids  = itertools.count(1)
        self._route      = Route(self._link, channel)
        self._former     = deque[int](maxlen=_FORMER_FRAMES)
        self._pipelines: list[Pipeline] = []
        self._configured: MatcherSettings | None = None

    def _session_began(self) -> None:
        self._configured = None

    def console(self, line: str, timeout_s: float = 10.0) -> str:
        """Raises DeviceError: the console is on the serial line."""
        raise DeviceError(f"{self._info.url} has no console: it is on the device's serial line, use serial: or tcp:")

    def _stream(self, pairs: Iterable[Pair], settings: MatcherSettings | None,
                progress: Progress | None) -> Iterator[Result]:
        """Matches pair after pair; while one is matched others are sent and fetched.

        Raises as `Device.stream`. If the iterator is dropped before its end, the frames under way are
        released.
        """
        settings = settings or self._info.default_settings()
        pipeline = Pipeline(self._route, self._info.slots, self._former, progress, self.streamed)
        self._pipelines.append(pipeline)
        try:
            with self._guarded():
                yield from self._matched(pairs, settings, pipeline)
        finally:
            self._pipelines.remove(pipeline)
            pipeline.forget()
            self._release(pipeline.open_frames)
            self._former.extend(frame.frame_id for frame in pipeline.open_frames)

    def _matched(self, pairs: Iterable[Pair], settings: MatcherSettings, pipeline: Pipeline) -> Iterator[Result]:
        source    = iter(pairs)
        exhausted = False
        while True:
            # A pair is asked for when it can be sent: it may be one that a camera takes then.
            while not exhausted and pipeline.has_room:
                pair = next(source, None)
                if pair is None:
                    exhausted = True
                    break
                left, right = pair
                check_pair(left, right)
                self._info.check(left.shape[1], left.shape[0], settings)
                self._configure(settings)
                pipeline.add(Frame(next(self._frame_ids), (left, right), settings))
            if pipeline.empty:
                if exhausted:
                    break
                # All slots are those of frames that are leaving.
                pipeline.drain()
                continue
            for other in self._pipelines:
                if other is not pipeline:
                    other.tend()
            result = pipeline.step()
            if result is not None:
                self._count(result)
                yield result
        pipeline.drain()

    def _configure(self, settings: MatcherSettings) -> None:
        """Has the frames that are opened next matched with `settings`."""
        if settings == self._configured:
            return
        # A late copy of an earlier CONFIGURE must not undo this one. It cannot if it is of another session.
        if self._configured is not None and not any(pipeline.open_frames for pipeline in self._pipelines):
            self._configured = None
            self._link.hello()
        self._link.call(MessageType.CONFIGURE, payloads.pack_parameters(settings.parameters))
        self._configured = settings

    def _count(self, result: Result) -> None:
        counters = self._link.counters
        counters.bytes_uploaded   += 2*result.disparity.size
        counters.bytes_downloaded += result.disparity.nbytes
        counters.upload_s         += result.upload_s
        counters.download_s       += result.download_s
