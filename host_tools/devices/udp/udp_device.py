#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""A device on a network."""

from __future__ import annotations

from collections.abc import Callable

from ...core.errors import DeviceError, UnsupportedError
from ...core.features import Feature
from ...link.settings import LinkSettings
from ...link.udp_channel import UdpChannel
from ..job import StoredFrameJob
from ..remote import RemoteDevice
from .context import UdpContext
from .streamed import StreamedFrameJob


class UdpDevice(RemoteDevice):
    """A device that is reached by datagrams; see `RemoteDevice`.

    `streamed` tells whether the frames of the next stream are matched as their pixels come, without the device's
    memory.

    Parameters
    ----------
    url, channel, settings, on_close
        See `RemoteDevice`.
    streamed
        Whether frames are streamed; otherwise they are stored first.

    Raises
    ------
    UnsupportedError
        Frames are to be streamed, and the device was not built for that.
    """

    def __init__(self, url: str, channel: UdpChannel, settings: LinkSettings | None = None,
                 on_close: Callable[[], None] | None = None, *, streamed: bool = False) -> None:
        super().__init__(url, channel, settings, on_close)
        if streamed and not self._info.features & Feature.STREAMING:
            self.close()
            raise UnsupportedError(f"{self._info.name} was built without streaming: leave mode=streamed out, or use a "
                                   "device that has it, see `litestereo info`")
        self.streamed = streamed
        self._context = UdpContext(self._link, channel)

    @property
    def streamed(self) -> bool:
        """Return whether the frames of the next stream are matched as their pixels come."""
        return self._job_kind is StreamedFrameJob

    @streamed.setter
    def streamed(self, streamed: bool) -> None:
        self._job_kind = StreamedFrameJob if streamed else StoredFrameJob

    def console(self, line: str, timeout_s: float = 10.0) -> str:
        """Raise DeviceError: the console is on the serial line."""
        raise DeviceError(f"{self._info.url} has no console: it is on the device's serial line, use serial: or tcp:")
