#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""A device on a serial line, or on what carries one."""

from __future__ import annotations

from collections.abc import Callable

from ...link.console import run_line
from ...link.link import Link
from ...link.serial_channel import SerialChannel
from ...link.settings import LinkSettings
from ...link.transports import Transport
from ..base import Progress
from ..job import Chunk, LinkContext
from ..remote import RemoteDevice
from .download import SerialDownload
from .upload import SerialUpload

#: One frame is matched or fetched while the next one is sent.
_MOST_FRAMES = 2


class SerialContext(LinkContext):
    """The link over a line, on which nothing overtakes anything; see `LinkContext`."""

    def __init__(self, link: Link) -> None:
        super().__init__(link, _MOST_FRAMES, 0)

    def upload(self, frame_id: int, chunks: list[Chunk], progress: Progress | None) -> SerialUpload:
        """Return the upload of an open frame's images."""
        return SerialUpload(self.link, frame_id, chunks, progress)

    def download(self, frame_id: int, count: int, progress: Progress | None, offset: int = 0) -> SerialDownload:
        """Return a download."""
        return SerialDownload(self.link, frame_id, range(offset, offset + count), progress)


class SerialDevice(RemoteDevice):
    """A device that is reached by a line of bytes; see `RemoteDevice`.

    Parameters
    ----------
    transport
        The line, closed together with the device.
    url, settings, on_close
        See `RemoteDevice`.
    """

    def __init__(self, url: str, transport: Transport, settings: LinkSettings | None = None,
                 on_close: Callable[[], None] | None = None) -> None:
        self._channel = SerialChannel(transport)
        super().__init__(url, self._channel, settings, on_close)
        self._context = SerialContext(self._link)

    def console(self, line: str, timeout_s: float = 10.0) -> str:
        """Type a line at the device's console; see `Device.console`."""
        with self._guarded():
            return run_line(self._link, self._channel, line, timeout_s)
