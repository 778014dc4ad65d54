#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Devices on the other side of a link: what those on a serial line and those on a network share."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from ..core.errors import DeviceError, DeviceRefused, LiteStereoError, ProtocolError
from ..link.channel import Channel
from ..link.link import Link
from ..link.settings import LinkCounters, LinkSettings
from ..protocol import payloads
from ..protocol.messages import MessageType
from .base import RESTART_LIMIT_S, Device, DeviceInfo, Progress
from .firmware_image import read_firmware
from .udp.frame import Frame
from .updating import restart_device, write_firmware

#: A goodbye is a courtesy: the time in seconds that it may take.
_BYE_LIMIT_S = 1.0


def _version(number: int) -> str:
    return f"{number >> 8}.{number & 0xff}"


def _describe(url: str, capabilities: payloads.Capabilities) -> DeviceInfo:
    return DeviceInfo(
        url          = url,
        name         = capabilities.name or "device",
        max_width        = capabilities.max_width,
        max_height       = capabilities.max_height,
        max_pixels       = capabilities.max_pixels,
        max_disparities  = capabilities.max_disparities,
        min_block_size   = capabilities.min_block_size,
        max_block_size   = capabilities.max_block_size,
        slots        = capabilities.slots,
        sys_clk_hz       = capabilities.sys_clk_hz,
        features         = capabilities.features,
        gateware_version = _version(capabilities.gateware_version),
        firmware_version = _version(capabilities.firmware_version),
    )


class RemoteDevice(Device):
    """A device behind a channel, with which it begins a session.

    Parameters
    ----------
    url
        What to call the device in messages.
    channel
        The way to it, closed together with the device.
    settings
        Limits of the link.
    on_close
        Called when the device is closed, after the channel.

    Raises
    ------
    DeviceError
        The device does not answer, or not as it should, or another host uses it.
    ProtocolError
        It speaks another version of the protocol.
    """

    def __init__(self, url: str, channel: Channel, settings: LinkSettings | None = None,
                 on_close: Callable[[], None] | None = None) -> None:
        super().__init__()
        self._closing  = channel.close
        self._on_close = on_close
        self._link     = Link(channel, settings)
        self._usable   = True
        try:
            capabilities = self._link.hello()
        except BaseException:
            self._usable = False
            self.close()
            raise
        self._info = _describe(url, capabilities)

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

    def update_firmware(self, firmware: Path | bytes, *, restart: bool = True, progress: Progress | None = None,
                        restart_limit_s: float = RESTART_LIMIT_S) -> DeviceInfo:
        """Writes another firmware to the device's flash; see `Device.update_firmware`."""
        image = read_firmware(firmware)
        image.check(self._info)
        with self._guarded():
            write_firmware(self._link, image, progress)
            if restart:
                capabilities = restart_device(self._link, restart_limit_s)
                self._info   = _describe(self._info.url, capabilities)
                self._session_began()
        if restart and self._info.firmware_version != image.version:
            raise DeviceError(f"the device started firmware {self._info.firmware_version} instead of {image.version}: "
                              "see what it says on its serial line")
        return self._info

    def _session_began(self) -> None:
        """Forgets what was told the device in the session before."""

    def close(self) -> None:
        """Ends the session, and closes the channel."""
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
    def _guarded(self) -> Iterator[None]:
        """Uses the link when it is this thread's turn; after an error that is no answer it is used no more."""
        with self._turns.turn():
            if not self._usable:
                raise DeviceError("the connection to the device is closed: connect again")
            try:
                yield
            except (DeviceError, ProtocolError) as error:
                # A refusal is an answer: the session goes on.
                self._usable = isinstance(error, DeviceRefused)
                raise

    def _release(self, frames: Iterable[Frame]) -> None:
        """Releases the `frames` that an error, or nobody's interest, has left open."""
        if self._usable:
            with contextlib.suppress(LiteStereoError):
                for frame in frames:
                    self._link.call(MessageType.RELEASE, frame_id=frame.frame_id)
