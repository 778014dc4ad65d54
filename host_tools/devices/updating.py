#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The update of a device's firmware, over any link."""

from __future__ import annotations

import time

from ..core.errors import DeviceError, LinkTimeout
from ..link.link import Link
from ..protocol import payloads
from ..protocol.messages import ErrorCode, MessageType
from ..protocol.payloads import Trial, UpdateProgress, UpdateState
from ..protocol.refusals import failed_update
from .base import Progress
from .firmware_image import FirmwareImage
from .pieces import report, upload_pieces

#: Seconds between two polls for the progress, and between two hellos to a device that is restarting.
_POLL_S = 0.1

#: Seconds without progress after which the device counts as stuck; a slow simulation takes long to read an image.
_STUCK_LIMIT_S = 600.0


def write_firmware(link: Link, image: FirmwareImage, progress: Progress | None) -> None:
    """Send `image` to the device, and wait until it is in its flash.

    Parameters
    ----------
    link
        The link to the device, in a session.
    image
        The firmware, which is for this device.
    progress
        Called with the steps of "upload" and "write".

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
        upload_pieces(link, MessageType.IMAGE, image.program, progress)
        reply = _ask(link, MessageType.WRITE)
    _wait(link, reply, progress)


def ask_trial(link: Link, limit_s: float = 0.0) -> Trial:
    """Return what has become of the newest firmware; wait for at most `limit_s` while it is on trial."""
    give_up_at = time.monotonic() + limit_s
    while True:
        trial = _ask(link, MessageType.PROGRESS).trial
        if trial != Trial.RUNNING or time.monotonic() >= give_up_at:
            return Trial(trial) if trial in set(Trial) else Trial.UNKNOWN
        link.idle(_POLL_S)


def _ask(link: Link, kind: MessageType, payload: bytes = b"") -> UpdateProgress:
    return UpdateProgress.unpack(link.call(kind, payload).payload)


def _wait(link: Link, reply: UpdateProgress, progress: Progress | None) -> None:
    moved_at = time.monotonic()
    while reply.state != UpdateState.DONE:
        if reply.state == UpdateState.FAILED:
            raise failed_update(reply.failure)
        if reply.state not in (UpdateState.CHECKING, UpdateState.WRITING):
            raise DeviceError("the device restarted while it wrote the firmware: try again")
        if time.monotonic() - moved_at > _STUCK_LIMIT_S:
            raise LinkTimeout(f"the device has made no progress with the firmware for {_STUCK_LIMIT_S:g} s: restart "
                              "it, and try again")
        report(progress, "write", reply.done, reply.total)
        link.idle(_POLL_S)
        before, reply = reply, _ask(link, MessageType.PROGRESS)
        if (reply.state, reply.done) != (before.state, before.done):
            moved_at = time.monotonic()
    report(progress, "write", reply.total, reply.total)


def restart_device(link: Link, limit_s: float) -> payloads.Capabilities:
    """Restart the device, and begin a session with it.

    Raises DeviceError if it has not come back within `limit_s`.
    """
    # If the device no longer knows the session, it has restarted, and the reply was lost.
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
