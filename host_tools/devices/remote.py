#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""A device on the other side of a link."""

from __future__ import annotations

import contextlib
import itertools
from collections.abc import Callable, Iterable, Iterator

from .. import payloads
from ..call import LinkCounters, LinkSettings
from ..console import run_line
from ..errors import DeviceError, DeviceRefused, LiteStereoError, ProtocolError
from ..link import Link
from ..protocol import MessageType
from ..settings import MatcherSettings
from ..transports import Transport
from .base import Device, DeviceInfo, Pair, Progress, Result, check_pair
from .frame import Frame
from .transfer import Transfer

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
        self._transfer   = Transfer(self._link)
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
        """Matches pair after pair; while one is matched and fetched the next is on its way.

        Raises as `Device.stream`. If the iterator is dropped before its end, the frames under way are
        released.
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
        """Uses the link, and releases the `frames` that an error, or nobody's interest, has left open."""
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
