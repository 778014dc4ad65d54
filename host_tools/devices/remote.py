#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""A device on the other side of a link."""

from __future__ import annotations

import contextlib
import itertools
import time
from collections.abc import Callable, Iterable, Iterator

from .. import payloads
from ..console import run_line
from ..errors import DeviceError, DeviceRefused, LinkTimeout, LiteStereoError, ProtocolError
from ..link import Link, LinkCounters, LinkSettings
from ..payloads import FrameState, FrameStatus
from ..protocol import MessageType
from ..refusals import failed_frame
from ..settings import MatcherSettings
from ..transports import Transport
from .base import Device, DeviceInfo, Pair, Progress, Result, check_pair
from .frame import Frame

#: The wait between two questions for the status in seconds: it grows from the first to the second.
_MIN_POLL_S = 0.001
_MAX_POLL_S = 0.05

#: Longest match in seconds; a slow simulation of the largest frame takes a few.
_MATCH_LIMIT_S = 120.0

#: A goodbye is a courtesy: the time in seconds that it may take.
_BYE_LIMIT_S = 1.0


def _version(number: int) -> str:
    return f"{number >> 8}.{number & 0xff}"


class RemoteDevice(Device):
    """A device behind a byte transport, with which it begins a session.

    Parameters
    ----------
    url
        What to call the device in messages.
    transport
        The line to it, closed together with the device.
    settings
        Limits of the link.
    on_close
        Called when the device is closed, after the line.

    Raises
    ------
    DeviceError
        The device does not answer, or not as it should.
    ProtocolError
        It speaks another version of the protocol.
    """

    def __init__(self, url: str, transport: Transport, settings: LinkSettings | None = None,
                 on_close: Callable[[], None] | None = None) -> None:
        self._transport  = transport
        self._on_close   = on_close
        self._link       = Link(transport, settings)
        self._frame_ids  = itertools.count(1)
        self._configured:  MatcherSettings | None = None
        self._usable     = True
        try:
            capabilities = self._link.hello()
        except BaseException:
            self._usable = False
            self.close()
            raise
        self._info = DeviceInfo(
            url              = url,
            name             = capabilities.name or "device",
            max_width        = capabilities.max_width,
            max_height       = capabilities.max_height,
            max_pixels       = capabilities.max_pixels,
            max_disparities  = capabilities.max_disparities,
            min_block_size   = capabilities.min_block_size,
            max_block_size   = capabilities.max_block_size,
            slots            = capabilities.slots,
            sys_clk_hz       = capabilities.sys_clk_hz,
            features         = capabilities.features,
            gateware_version = _version(capabilities.gateware_version),
            firmware_version = _version(capabilities.firmware_version),
        )

    @property
    def link_counters(self) -> LinkCounters:
        """What happened on this host's side of the link."""
        return self._link.counters

    def info(self) -> DeviceInfo:
        """What the device told about itself when the session began."""
        return self._info

    def statistics(self) -> dict[str, int]:
        """The device's counters by name."""
        with self._guarded():
            return payloads.unpack_counters(self._link.call(MessageType.STATISTICS).payload)

    def console(self, line: str, timeout_s: float = 10.0) -> str:
        """Types a line at the device's console; see `Device.console`."""
        with self._guarded():
            return run_line(self._link, line, timeout_s)

    def stream(self, pairs: Iterable[Pair], settings: MatcherSettings | None = None,
               progress: Progress | None = None) -> Iterator[Result]:
        """Matches pair after pair; while one is matched and fetched the next is on its way. Raises as `Device.stream`.

        If the iterator is dropped before its end, the frames under way are released.
        """
        settings = settings or self._info.default_settings()
        overlap  = self._info.slots > 1
        previous: Frame | None = None
        frames: list[Frame] = []
        with self._guarded(frames):
            for left, right in pairs:
                check_pair(left, right)
                self._info.check(left.shape[1], left.shape[0], settings)
                result = None
                if previous is not None and not overlap:
                    result, previous = self._collect(previous, progress), None
                    frames.clear()
                frame = Frame(next(self._frame_ids), (left, right), settings)
                # It counts as open from the request on: the reply may be what goes missing.
                frames.append(frame)
                self._begin_upload(frame, progress)
                if previous is not None:
                    result = self._collect(previous, progress)
                    frames.remove(previous)
                self._finish_upload(frame)
                previous = frame
                if result is not None:
                    yield result
            if previous is not None:
                result = self._collect(previous, progress)
                frames.clear()
                yield result

    def close(self) -> None:
        """Ends the session, and closes the line."""
        if self._usable:
            self._usable = False
            with contextlib.suppress(LiteStereoError):
                self._link.forget()
                self._link.limit_silence(_BYE_LIMIT_S)
                self._link.call(MessageType.BYE)
        self._transport.close()
        if self._on_close is not None:
            on_close, self._on_close = self._on_close, None
            on_close()

    @contextlib.contextmanager
    def _guarded(self, frames: Iterable[Frame] = ()) -> Iterator[None]:
        """Uses the link, and releases `frames` afterwards if an error, or nobody's interest, left them open."""
        if not self._usable:
            raise DeviceError("the connection to the device is closed: connect again")
        try:
            yield
        except (DeviceError, ProtocolError) as error:
            # A refusal is an answer: the session goes on.
            self._usable = isinstance(error, DeviceRefused)
            raise
        finally:
            self._link.forget()
            if self._usable:
                with contextlib.suppress(LiteStereoError):
                    for frame in frames:
                        self._link.call(MessageType.RELEASE, frame_id=frame.frame_id)

    def _begin_upload(self, frame: Frame, progress: Progress | None) -> None:
        """Opens a frame and queues its upload."""
        if frame.settings != self._configured:
            self._link.call(MessageType.CONFIGURE, payloads.pack_parameters(frame.settings.parameters))
            self._configured = frame.settings
        opened   = self._link.call(MessageType.OPEN, payloads.pack_size(frame.width, frame.height), frame.frame_id)
        _, pitch = payloads.unpack_opened(opened.payload)
        chunks   = list(frame.chunks(pitch))
        done     = _steps("upload", len(chunks), progress)
        frame.uploads = [self._link.submit(MessageType.UPLOAD, chunk, frame.frame_id, offset, on_reply=done)
                         for offset, chunk in chunks]

    def _finish_upload(self, frame: Frame) -> None:
        """Waits for the upload's end, and has the frame matched."""
        self._link.wait(frame.uploads)
        frame.started_at = time.monotonic()
        self._link.call(MessageType.START, frame_id=frame.frame_id)

    def _collect(self, frame: Frame, progress: Progress | None) -> Result:
        """Waits for a frame's match, and fetches its map, while the link sends what else is queued."""
        if progress is not None:
            progress("match", 0, 1)
        status = self._wait_for_match(frame)
        if progress is not None:
            progress("match", 1, 1)
        matched_at = time.monotonic()
        reads      = list(frame.reads())
        done       = _steps("download", len(reads), progress)
        calls      = [self._link.submit(MessageType.READ, payloads.pack_number(length), frame.frame_id, offset,
                                        reply_bytes=length, urgent=True, on_reply=frame.store(length, done))
                      for offset, length in reads]
        self._link.wait(calls)
        downloaded_at = time.monotonic()
        self._link.call(MessageType.RELEASE, frame_id=frame.frame_id)
        return Result(frame.disparity(), frame.settings, status.clocks, status.first_row_clocks,
                      frame.started_at - frame.opened_at, matched_at - frame.started_at, downloaded_at - matched_at)

    def _wait_for_match(self, frame: Frame) -> FrameStatus:
        poll_s = _MIN_POLL_S
        while True:
            reply  = self._link.call(MessageType.STATUS, frame_id=frame.frame_id)
            status = FrameStatus.unpack(reply.payload)
            if status.state == FrameState.DONE:
                return status
            if status.state == FrameState.FAILED:
                raise failed_frame(frame.frame_id, status.error)
            if status.state not in (FrameState.READY, FrameState.MATCHING):
                raise DeviceError(f"the device lost frame {frame.frame_id} (state {status.state}): connect again")
            if time.monotonic() - frame.started_at > _MATCH_LIMIT_S:
                raise LinkTimeout(f"the device has not matched frame {frame.frame_id} within {_MATCH_LIMIT_S:g} s")
            self._link.idle(poll_s)
            poll_s = min(1.5*poll_s, _MAX_POLL_S)


def _steps(phase: str, total: int, progress: Progress | None) -> Callable[[object], None] | None:
    """A callback that counts the replies of one phase."""
    if progress is None:
        return None
    counter = itertools.count(1)
    progress(phase, 0, total)

    def step(_: object) -> None:
        progress(phase, next(counter), total)

    return step
