#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""One frame on its way through a remote device, from the request for a slot to its release."""

from __future__ import annotations

import abc
import time
from collections import deque
from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from ..core.errors import DeviceError, LinkTimeout
from ..core.settings import MatcherSettings
from ..link.link import Call, Link
from ..protocol import payloads
from ..protocol.messages import CHUNK_BYTES, ErrorCode, Message, MessageType
from ..protocol.payloads import FrameFlag, FrameOption, FrameState, FrameStatus
from ..protocol.refusals import failed_frame, refusal, spoiled_frame
from .base import Images, Pair, Progress, Result, chosen_images

#: Shortest and longest wait in seconds between two requests for a frame's status; it grows from one to the other.
MIN_POLL_S = 0.0005
_MAX_POLL_S = 0.05

#: Longest match in seconds, after two others; a slow simulation of the largest frame takes a few.
_MATCH_LIMIT_S = 360.0

#: Number of tries to open a frame before a lack of slots counts as an error.
_OPEN_TRIES = 8

#: Offset in the upload space, and bytes: one chunk of an image.
Chunk = tuple[int, memoryview]


#: Options of the images that come out, with their places in the download space, in pitches.
_IMAGES = {"left": (FrameOption.LEFT, 2), "right": (FrameOption.RIGHT, 3)}


@dataclass(frozen=True)
class FrameRequest:
    """What a device is to do with the pairs of a stream, and to send.

    Parameters
    ----------
    settings
        Settings that the device has been given.
    rectified
        Whether the device rectifies them.
    grid_crc
        CRC of the grid by which it does.
    images
        Images that are wanted on top of the maps.
    """

    settings:  MatcherSettings
    rectified: bool   = False
    grid_crc:  int    = 0
    images:    Images = ()

    @property
    def options(self) -> FrameOption:
        """Return the options of the frames: images that the matcher gets as they were sent are not fetched."""
        if not self.rectified:
            return FrameOption(0)
        options = FrameOption.RECTIFIED
        for name in self.images:
            options |= _IMAGES[name][0]
        return options


class Upload(Protocol):
    """A frame's pixels on their way to the device; it begins with the first of them, and ends with the last reply."""

    begun_at: float
    ended_at: float

    @property
    def done(self) -> bool:
        """Return whether the device has all pixels."""

    @property
    def sent(self) -> bool:
        """Return whether the next frame may be sent."""

    def fill(self) -> None:
        """Send what the window allows."""

    def forget(self) -> None:
        """Stop sending, and ignore replies."""


class Download(Protocol):
    """A frame's map, or an image of it, on its way to the host.

    `data` holds the bytes, `stalled` counts the times that parts failed to come.
    """

    data:     bytearray
    begun_at: float
    stalled:  int

    @property
    def done(self) -> bool:
        """Return whether all of it has come."""

    @property
    def late_at(self) -> float:
        """Return the time after which what has not come counts as lost."""

    def fill(self) -> None:
        """Request what the window allows, and again what seems lost."""

    def forget(self) -> None:
        """Stop requesting, and ignore replies."""


class LinkContext(abc.ABC):
    """What the frames of a device share: the link, how their pixels and maps travel, and which were released.

    Parameters
    ----------
    link
        The link to the device.
    most_frames
        Number of frames that keep the link busy.
    former_frames
        Number of released frames that a late copy of the request that opened them may open again.
    """

    def __init__(self, link: Link, most_frames: int, former_frames: int) -> None:
        self.link        = link
        self.most_frames = most_frames
        self.former      = deque[int](maxlen=former_frames)

    @abc.abstractmethod
    def upload(self, frame_id: int, chunks: list[Chunk], progress: Progress | None) -> Upload:
        """Return the upload of an open frame's images."""

    @abc.abstractmethod
    def download(self, frame_id: int, count: int, progress: Progress | None, offset: int = 0) -> Download:
        """Return the download of `count` bytes of a matched frame from an offset: of the map, or of an image."""


class FrameJob(abc.ABC):
    """A frame in flight: replies move it on, and `step` sends what is to be sent.

    Parameters
    ----------
    context
        The link, and what its frames share.
    frame_id
        Number of the frame in this session.
    pair
        Left and right image, which are copied.
    request
        What the device does with the frame, and sends.
    progress
        Called with the steps of "upload", "match" and "download".
    """

    #: The request that takes a slot.
    OPENING: ClassVar[MessageType]

    def __init__(self, context: LinkContext, frame_id: int, pair: Pair, request: FrameRequest,
                 progress: Progress | None) -> None:
        self.frame_id           = frame_id
        self.released           = False
        self.height:              int
        self.width:               int
        self.height, self.width = pair[0].shape
        self._request           = request
        # Copies: a stream may fill the same arrays with the next pair.
        self._sent              = [memoryview(image.tobytes()) for image in pair]
        self._context           = context
        self._link              = context.link
        self._progress          = progress
        self._upload:             Upload | None      = None
        self._download:           Download | None    = None
        self._images_out:         dict[str, Download] = {}
        self._status:             FrameStatus | None = None
        self._call:               Call | None        = None
        self._opens             = 0
        self._first             = False
        self._asking            = False
        self._poll_s            = MIN_POLL_S
        self._poll_at           = 0.0
        self._stalls            = 0
        self._started_at        = 0.0
        self._matched_at        = 0.0
        self._downloaded_at     = 0.0

    @property
    def map_bytes(self) -> int:
        """Return the size of the map in bytes."""
        return 2*self.width*self.height

    @property
    @abc.abstractmethod
    def sent(self) -> bool:
        """Return whether the next frame may be sent."""

    @property
    @abc.abstractmethod
    def feeding(self) -> bool:
        """Return whether the matcher waits for pixels of this frame."""

    @property
    def arrived(self) -> bool:
        """Return whether all of the map and of the images is here."""
        return self._status is not None and self._fetching is None and self._download is not None

    @property
    def _fetching(self) -> Download | None:
        """Return what is fetched now, or as soon as the frame has been matched; None if all is here."""
        every = [self._download, *self._images_out.values()]
        return next((one for one in every if one is not None and not one.done), None)

    @property
    def wake_at(self) -> float:
        """Return the time of the next step if no reply comes."""
        if self._first and self._status is not None and (fetching := self._fetching) is not None:
            return fetching.late_at
        return self._poll_at if self._asking and self._call is None else float("inf")

    def start(self) -> None:
        """Request a slot for the frame."""
        self._opens += 1
        size = payloads.pack_size(self.width, self.height, self._request.options)
        self._call = self._link.submit(self.OPENING, size, self.frame_id, on_reply=self._on_slot,
                                       accepts=[ErrorCode.NO_SLOT])

    def step(self, first: bool, due: bool) -> None:
        """Send what is to be sent.

        Parameters
        ----------
        first
            Whether this is the first frame in flight, the only one whose map is requested.
        due
            Whether the matcher waits for pixels of no other frame.
        """
        self._first = first
        if self._upload is not None and not self._upload.done:
            self._upload.fill()
        self._advance()
        self._asking = self._status is None and self._may_change(due)
        if self._asking and self._call is None and time.monotonic() >= self._poll_at:
            self._ask_status()
        if first and self._status is not None and (fetching := self._fetching) is not None:
            fetching.fill()
            # If no map comes, the reply to STATUS tells whether there still is a session.
            if fetching.stalled > self._stalls and self._call is None:
                self._ask_status()
            self._stalls = fetching.stalled

    @abc.abstractmethod
    def _advance(self) -> None:
        """Send what follows the pixels."""

    @abc.abstractmethod
    def _may_change(self, due: bool) -> bool:
        """Return whether the frame's status may have changed."""

    def release(self) -> None:
        """Release the frame, whose map has arrived."""
        self._downloaded_at = time.monotonic()
        self.forget()
        self._call = self._link.submit(MessageType.RELEASE, frame_id=self.frame_id, urgent=True,
                                       on_reply=self._on_released)

    def _on_released(self, _: Message) -> None:
        self._call    = None
        self.released = True

    def result(self) -> Result:
        """Return the frame's result, once the map is here; raise DeviceError before."""
        if self._status is None or self._upload is None or self._download is None:
            raise DeviceError(f"frame {self.frame_id} has not been matched")
        disparity = np.frombuffer(self._download.data, "<i2").astype(np.int16)
        return Result(
            disparity        = disparity.reshape(self.height, self.width),
            settings         = self._request.settings,
            clocks           = self._status.clocks,
            first_row_clocks = self._status.first_row_clocks,
            upload_s         = self._upload.ended_at - self._upload.begun_at,
            match_s          = self._matched_at - self._started_at,
            download_s       = self._downloaded_at - self._download.begun_at,
            **self._images(),
        )

    def _images(self) -> dict[str, NDArray[np.uint8]]:
        """Return the images that are wanted: those that were sent, if the device has not rectified them."""
        shape = (self.height, self.width)
        if self._request.rectified:
            return {name: np.frombuffer(one.data, np.uint8).reshape(shape).copy()
                    for name, one in self._images_out.items()}
        left, right = (np.frombuffer(image, np.uint8).reshape(shape) for image in self._sent)
        return chosen_images((left, right), self._request.images)

    def _on_slot(self, reply: Message) -> None:
        if reply.type == MessageType.ERROR:
            if self._opens >= _OPEN_TRIES:
                raise refusal(reply)
            self._release_former()
            self.start()
            return
        self._call = None
        self._on_opened(reply)

    @abc.abstractmethod
    def _on_opened(self, reply: Message) -> None:
        """Handle the reply that gives the frame a slot."""

    def _release_former(self) -> None:
        """Release the frames of before again: late copies may have opened them."""
        for frame_id in self._context.former:
            self._link.submit(MessageType.RELEASE, frame_id=frame_id, urgent=True)

    def _ask_status(self) -> None:
        self._call = self._link.submit(MessageType.STATUS, frame_id=self.frame_id, urgent=True,
                                       on_reply=self._on_status)

    def _on_status(self, reply: Message) -> None:
        self._call = None
        self._handle_status(FrameStatus.unpack(reply.payload))
        self._poll_at = time.monotonic() + self._poll_s
        self._poll_s  = min(1.5*self._poll_s, _MAX_POLL_S)

    def _handle_status(self, status: FrameStatus) -> None:
        now = time.monotonic()
        if status.state == FrameState.FAILED:
            self._fail(status)
        elif status.state not in (FrameState.READY, FrameState.MATCHING, FrameState.DONE):
            raise DeviceError(f"the device lost frame {self.frame_id} (state {status.state}): connect again")
        elif status.state == FrameState.DONE and self._status is None:
            self._check_rectified(status)
            self._status     = status
            self._matched_at = now
            if self._progress is not None:
                self._progress("match", 1, 1)
            self._on_matched()
            self._fetch_images()
        elif status.state != FrameState.DONE and now - self._started_at > _MATCH_LIMIT_S:
            raise LinkTimeout(f"the device has not matched frame {self.frame_id} within {_MATCH_LIMIT_S:g} s: "
                              "restart it")

    def _check_rectified(self, status: FrameStatus) -> None:
        """Raise DeviceRefused if the frame was to be rectified, and was not as it should."""
        if not self._request.rectified:
            return
        if not status.flags & FrameFlag.RECTIFIED or status.grid_crc != self._request.grid_crc:
            raise spoiled_frame(self.frame_id, f"it used grid {status.grid_crc:08x} instead of "
                                               f"{self._request.grid_crc:08x}")
        if status.flags & FrameFlag.ROW_GONE:
            raise spoiled_frame(self.frame_id, "a row of the images was gone when a pixel needed it")
        if status.flags & FrameFlag.FOLDED:
            raise spoiled_frame(self.frame_id, "its map folds over")

    def _fetch_images(self) -> None:
        """Prepare the downloads of the images."""
        if not self._request.rectified:
            return
        pitch = payloads.frame_pitch(self.width, self.height)
        for name in self._request.images:
            self._images_out[name] = self._context.download(self.frame_id, self.width*self.height, self._progress,
                                                            offset=_IMAGES[name][1]*pitch)

    @abc.abstractmethod
    def _on_matched(self) -> None:
        """Prepare the download: the map is in the device's memory."""

    def _fail(self, status: FrameStatus) -> None:
        """Raise DeviceRefused: the device could not match the frame."""
        raise failed_frame(self.frame_id, status.error)

    def forget(self) -> None:
        """Request nothing any more, and ignore replies."""
        if self._call is not None:
            self._link.drop(self._call)
        if self._upload is not None:
            self._upload.forget()
        for download in (self._download, *self._images_out.values()):
            if download is not None:
                download.forget()


class StoredFrameJob(FrameJob):
    """A frame whose images are all in the device's memory before it is matched; see `FrameJob`."""

    OPENING: ClassVar[MessageType] = MessageType.OPEN

    def __init__(self, context: LinkContext, frame_id: int, pair: Pair, request: FrameRequest,
                 progress: Progress | None) -> None:
        super().__init__(context, frame_id, pair, request, progress)
        self._started = False

    @property
    def sent(self) -> bool:
        """Return whether all chunks have been sent, so that those of the next frame may be."""
        return self._upload is not None and self._upload.sent

    @property
    def feeding(self) -> bool:
        """Return False: the matcher starts when all chunks are there."""
        return False

    def _on_opened(self, reply: Message) -> None:
        _, pitch = payloads.unpack_opened(reply.payload)
        chunks   = [(base + offset, image[offset:offset + CHUNK_BYTES])
                    for base, image in zip((0, pitch), self._sent, strict=True)
                    for offset in range(0, len(image), CHUNK_BYTES)]
        self._upload = self._context.upload(self.frame_id, chunks, self._progress)

    def _advance(self) -> None:
        if self._upload is not None and self._upload.done and not self._started and self._call is None:
            self._call = self._link.submit(MessageType.START, frame_id=self.frame_id, urgent=True,
                                           on_reply=self._on_started)
            self._started_at = time.monotonic()

    def _on_started(self, _: Message) -> None:
        self._call    = None
        self._started = True
        if self._progress is not None:
            self._progress("match", 0, 1)

    def _may_change(self, due: bool) -> bool:
        return self._first and self._started

    def _on_matched(self) -> None:
        self._download = self._context.download(self.frame_id, self.map_bytes, self._progress)
