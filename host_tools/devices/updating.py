#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Another firmware to a device, over whatever link."""

from __future__ import annotations

import time

from ..core.errors import DeviceError, LinkTimeout
from ..link.link import Link
from ..protocol import payloads
from ..protocol.messages import CHUNK_BYTES, ErrorCode, MessageType
from ..protocol.payloads import UpdateProgress, UpdateState
from ..protocol.refusals import failed_update
from .base import Progress
from .firmware_image import FirmwareImage

#: Seconds between two questions for the progress, and between two hellos to a device that is restarting.
_POLL_S = 0.1

#: Seconds without progress after which the device counts as stuck; a slow simulation takes a while to read an image.
_STILL_LIMIT_S = 600.0


def write_firmware(link: Link, image: FirmwareImage, progress: Progress | None) -> None:
    """Hands `image` over and waits until it is in the device's flash.

    Raises
    ------
    FirmwareError
        The device has no room for it.
    DeviceError
        The device refuses, fails or does not answer.
    """
    image.check_room(_ask(link, MessageType.PROGRESS).room)
    reply = _ask(link, MessageType.UPDATE, payloads.pack_update(len(image.program), image.crc))
    if reply.state == UpdateState.LOADING:
        _upload(link, image.program, progress)
        reply = _ask(link, MessageType.WRITE)
    _wait(link, reply, progress)


def _ask(link: Link, kind: MessageType, payload: bytes = b"") -> UpdateProgress:
    return UpdateProgress.unpack(link.call(kind, payload).payload)


def _upload(link: Link, program: bytes, progress: Progress | None) -> None:
    offsets = range(0, len(program), CHUNK_BYTES)
    calls   = [link.submit(MessageType.IMAGE, program[offset:offset + CHUNK_BYTES], offset=offset)
               for offset in offsets]
    for index, call in enumerate(calls):
        if progress is not None:
            progress("upload", index, len(calls))
        link.wait([call])
    if progress is not None:
        progress("upload", len(calls), len(calls))


def _wait(link: Link, reply: UpdateProgress, progress: Progress | None) -> None:
    moved_at = time.monotonic()
    while reply.state != UpdateState.DONE:
        if reply.state == UpdateState.FAILED:
            raise failed_update(reply.failure)
        if reply.state not in (UpdateState.CHECKING, UpdateState.WRITING):
            raise DeviceError("the device has forgotten the firmware while it wrote it: it restarted, try again")
        if time.monotonic() - moved_at > _STILL_LIMIT_S:
            raise LinkTimeout(f"the device writes the firmware, but has not come further for {_STILL_LIMIT_S:g} s")
        if progress is not None:
            progress("write", reply.done, reply.total)
        link.idle(_POLL_S)
        before, reply = reply, _ask(link, MessageType.PROGRESS)
        if (reply.state, reply.done) != (before.state, before.done):
            moved_at = time.monotonic()
    if progress is not None:
        progress("write", reply.total, reply.total)


def restart_device(link: Link, limit_s: float) -> payloads.Capabilities:
    """Restarts the device and begins a session with it; raises DeviceError if it is not back within `limit_s`."""
    # A device that does not know the session any more has restarted, and it was the reply that got lost.
    link.wait([link.submit(MessageType.RESTART, urgent=True, accepts=[ErrorCode.SESSION])])
    give_up_at = time.monotonic() + limit_s
    while True:
        try:
            return link.hello()
        except DeviceError as error:
            link.forget()
            if time.monotonic() > give_up_at:
                raise DeviceError(f"the device has not come back within {limit_s:g} s: {error}") from None
        time.sleep(_POLL_S)
