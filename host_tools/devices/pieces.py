#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What goes to a device in pieces, a firmware or a calibration, and how the progress of it is told."""

from __future__ import annotations

from ..link.link import Link
from ..protocol.messages import CHUNK_BYTES, MessageType
from .base import Progress


def upload_pieces(link: Link, kind: MessageType, data: bytes, progress: Progress | None) -> None:
    """Send `data` in messages of that kind, each with its offset, and wait until the device has taken all of them.

    Parameters
    ----------
    link
        The link to the device, in a session.
    kind
        Kind of the messages.
    data
        What is sent.
    progress
        Called with the steps of "upload", a step per message.

    Raises
    ------
    DeviceError
        The device refuses a message, or does not answer.
    """
    calls = [link.submit(kind, data[offset:offset + CHUNK_BYTES], offset=offset)
             for offset in range(0, len(data), CHUNK_BYTES)]
    for index, call in enumerate(calls):
        report(progress, "upload", index, len(calls))
        link.wait([call])
    report(progress, "upload", len(calls), len(calls))


def report(progress: Progress | None, phase: str, done: int, total: int) -> None:
    """Tell `progress`, if there is one, how many steps of a phase are done."""
    if progress is not None:
        progress(phase, done, total)
