#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What all frames share on their way over a network."""

from __future__ import annotations

from ...link.link import Link
from ...link.udp_channel import UdpChannel
from ..base import Progress
from ..job import Chunk, LinkContext
from .download import GapEstimate, UdpDownload
from .upload import UdpUpload, UploadWindow

#: One frame is sent, one is matched and one is fetched, and while they move on one is between two of these.
_MOST_FRAMES = 4

#: Number of released frames that a late copy of their OPEN may open again; more than datagrams overtake each other by.
_FORMER_FRAMES = 32


class UdpContext(LinkContext):
    """The link, the channel below it, and what is known of the network; see `LinkContext`."""

    def __init__(self, link: Link, channel: UdpChannel) -> None:
        super().__init__(link, _MOST_FRAMES, _FORMER_FRAMES)
        self.channel = channel
        self.window  = UploadWindow()
        self._gaps   = GapEstimate()

    def upload(self, frame_id: int, chunks: list[Chunk], progress: Progress | None) -> UdpUpload:
        """Return the upload of an open frame's images."""
        return UdpUpload(self.link, self.channel, self.window, frame_id, chunks, progress)

    def download(self, frame_id: int, count: int, progress: Progress | None, offset: int = 0,
                 live: bool = False) -> UdpDownload:
        """Return a download; `live` if the parts come without a request while the frame is matched."""
        return UdpDownload(self.link, self.channel.room, self._gaps, frame_id, range(offset, offset + count), progress,
                           live)
