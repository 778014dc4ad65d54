#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Devices at the other end of a link: what those on a serial line and those on a network share."""

from __future__ import annotations

import contextlib
import itertools
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from ..core.errors import DeviceError, DeviceRefused, LiteStereoError, ProtocolError, UnsupportedError
from ..core.features import Feature, named_capabilities
from ..core.grid import GridPair, grid_crc
from ..core.settings import MatcherSettings
from ..link.channel import Channel
from ..link.link import Link
from ..link.settings import LinkCounters, LinkSettings
from ..protocol import payloads
from ..protocol.messages import MessageType
from ..protocol.payloads import Trial
from .base import (
    RESTART_LIMIT_S,
    Device,
    DeviceInfo,
    Images,
    Pair,
    Progress,
    Result,
    check_grid_size,
    check_pair,
)
from .calibrating import ask_calibration, calibration_gap, erase_calibration, read_calibration, write_calibration
from .firmware_image import read_firmware
from .job import FrameJob, FrameRequest, LinkContext, StoredFrameJob
from .pipeline import Pipeline
from .updating import ask_trial, restart_device, write_firmware

#: Longest wait for the reply to BYE, in seconds.
_BYE_LIMIT_S = 1.0

#: Longest wait for a new firmware to write to its flash that it is confirmed, in seconds.
_CONFIRM_LIMIT_S = 5.0


def _version(number: int) -> str:
    return f"{number >> 8}.{number & 0xff}"


def _describe(url: str, capabilities: payloads.Capabilities) -> DeviceInfo:
    return DeviceInfo(
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
        capabilities     = named_capabilities(capabilities.more),
    )


class RemoteDevice(Device):
    """A device at the other end of a channel, with which it begins a session.

    A derived class sets `_context`.

    Parameters
    ----------
    url
        Name of the device in messages.
    channel
        The path to it, closed together with the device.
    settings
        Limits of the link.
    on_close
        Called when the device is closed, after the channel.

    Raises
    ------
    DeviceError
        The device does not answer, or not as it should, or another host uses it.
    ProtocolError
        The device speaks another version of the protocol.
    """

    _context: LinkContext

    def __init__(self, url: str, channel: Channel, settings: LinkSettings | None = None,
                 on_close: Callable[[], None] | None = None) -> None:
        super().__init__()
        self._closing    = channel.close
        self._on_close   = on_close
        self._link       = Link(channel, settings)
        self._usable     = True
        self._job_kind:    type[FrameJob] = StoredFrameJob
        self._frame_ids  = itertools.count(1)
        self._pipelines:   list[Pipeline] = []
        self._configured:  MatcherSettings | None = None
        self._calibration: payloads.CalibrationStatus | None = None
        try:
            capabilities = self._link.hello()
        except BaseException:
            self._usable = False
            self.close()
            raise
        self._info  = _describe(url, capabilities)
        self._trial = Trial.UNKNOWN

    @property
    def link_counters(self) -> LinkCounters:
        """Return the counters of this host's side of the link."""
        return self._link.counters

    def info(self) -> DeviceInfo:
        """Return what the device told about itself when the session began."""
        return self._info

    def stream(self, pairs: Iterable[Pair], settings: MatcherSettings | None = None,
               progress: Progress | None = None, grids: GridPair | None = None,
               images: Images = ()) -> Iterator[Result]:
        """Match pair after pair, and send the next ones while one is matched; see `Device.stream`.

        If the iterator is dropped before its end, the frames in flight are released.
        """
        self._check_grids(grids)
        settings = self._settings(settings)
        request  = FrameRequest(settings, grids is not None, 0 if grids is None else grid_crc(grids), images)
        with self._guarded() as cleanup:
            pipeline = Pipeline(self._context, self._job_kind, self._pipelines, self._info.slots, progress)
            self._pipelines.append(pipeline)
            cleanup.callback(self._end, pipeline)
            source    = iter(pairs)
            exhausted = False
            while not (exhausted and pipeline.empty):
                # Take a pair only when it can be sent: a camera may take it just then.
                while not exhausted and pipeline.has_room:
                    pair = next(source, None)
                    if pair is None:
                        exhausted = True
                        break
                    left, right = pair
                    check_pair(left, right)
                    check_grid_size(left, grids)
                    self._info.check(left.shape[1], left.shape[0], settings)
                    self._configure(settings)
                    pipeline.add(next(self._frame_ids), (left, right), request)
                if pipeline.empty:
                    # All slots may be those of frames that are leaving.
                    pipeline.drain()
                elif (result := pipeline.step()) is not None:
                    self._count(result)
                    yield result
            pipeline.drain()

    def _configure(self, settings: MatcherSettings) -> None:
        """Have the device match the frames that are opened next with `settings`."""
        if settings == self._configured:
            return
        # A late copy of an earlier CONFIGURE must not undo this one: it cannot if it belongs to another session.
        if (self._configured is not None and not self._link.ordered
                and not any(pipeline.open_frames for pipeline in self._pipelines)):
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

    def _end(self, pipeline: Pipeline) -> None:
        """End a stream: release the frames that an error or an abandoned iterator has left open."""
        self._pipelines.remove(pipeline)
        pipeline.forget()
        self._release(pipeline.open_frames)
        self._context.former.extend(pipeline.open_frames)

    def _release(self, frame_ids: Iterable[int]) -> None:
        if self._usable:
            with contextlib.suppress(LiteStereoError):
                for frame_id in frame_ids:
                    self._link.call(MessageType.RELEASE, frame_id=frame_id)

    def statistics(self) -> dict[str, int]:
        """Return the device's counters by name."""
        with self._guarded():
            return payloads.unpack_counters(self._link.call(MessageType.STATISTICS).payload)

    def rectification_gap(self, grids: GridPair) -> str:
        """Return why the device does not rectify with the grids: it does with those of its calibration."""
        if not self._info.features & Feature.RECTIFICATION:
            return super().rectification_gap(grids)
        with self._guarded():
            # No other host changes it during this session.
            self._calibration = self._calibration or ask_calibration(self._link)
        return calibration_gap(self._calibration, grids[0].width, grids[0].height, grid_crc(grids))

    def calibration(self) -> bytes | None:
        """Return the record of the calibration that the device uses; see `Device.calibration`."""
        with self._calibrating():
            return read_calibration(self._link)

    def write_calibration(self, record: bytes, *, keep: bool = True, progress: Progress | None = None) -> None:
        """Have the device rectify by a calibration; see `Device.write_calibration`."""
        with self._calibrating():
            self._calibration = write_calibration(self._link, record, keep, progress)

    def erase_calibration(self) -> None:
        """Have the device use no calibration, and erase the one in its flash; see `Device.erase_calibration`."""
        with self._calibrating():
            self._calibration = erase_calibration(self._link)

    @contextlib.contextmanager
    def _calibrating(self) -> Iterator[None]:
        """Lock the device, and forget what is known of its calibration; raise UnsupportedError if it has none."""
        if not self._info.features & Feature.RECTIFICATION:
            raise UnsupportedError(f"{self._info.name} was built without rectification: it keeps no calibration, see "
                                   "`litestereo info`")
        with self._guarded():
            self._calibration = None
            yield

    def update_firmware(self, firmware: Path | bytes, *, restart: bool = True, progress: Progress | None = None,
                        restart_limit_s: float = RESTART_LIMIT_S) -> DeviceInfo:
        """Write another firmware to the device's flash; see `Device.update_firmware`."""
        image = read_firmware(firmware)
        image.check(self._info)
        with self._guarded():
            write_firmware(self._link, image, progress)
            if restart:
                capabilities     = restart_device(self._link, restart_limit_s)
                self._info       = _describe(self._info.url, capabilities)
                self._configured = self._calibration = None
            self._trial = ask_trial(self._link, _CONFIRM_LIMIT_S if restart else 0.0)
        if restart and self._trial == Trial.FELL_BACK:
            raise DeviceError(f"firmware {image.version} did not work: it was reset before it was confirmed, and the "
                              f"device runs firmware {self._info.firmware_version} again; see what it says on its "
                              "serial line")
        if restart and self._info.firmware_version != image.version:
            raise DeviceError(f"the device started firmware {self._info.firmware_version} instead of {image.version}: "
                              "see what it says on its serial line")
        return self._info

    def trial(self) -> Trial:
        """Return what has become of the firmware that `update_firmware` has written; see `Device.trial`."""
        return self._trial

    def close(self) -> None:
        """End the session, and close the channel."""
        if self._usable:
            self._usable = False
            with contextlib.suppress(LiteStereoError):
                self._link.forget()
                self._link.limit_silence(_BYE_LIMIT_S)
                self._link.call(MessageType.BYE)
        self._closing()
        if self._on_close is not None:
            on_close, self._on_close = self._on_close, None
            on_close()

    @contextlib.contextmanager
    def _guarded(self) -> Iterator[contextlib.ExitStack]:
        """Lock the device, and after an error other than a refusal use its link no more.

        The callbacks of the stack that this gives run after that, while the device is still locked.
        """
        with self._lock.held(), contextlib.ExitStack() as cleanup:
            if not self._usable:
                raise DeviceError("the connection to the device is closed: connect again")
            try:
                yield cleanup
            except (DeviceError, ProtocolError) as error:
                # A refusal is a reply: the session goes on.
                self._usable = isinstance(error, DeviceRefused)
                raise
