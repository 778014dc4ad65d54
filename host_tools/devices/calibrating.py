#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The calibration of a device, over any link: a record of bytes, as docs/rectification.md has it."""

from __future__ import annotations

import time
import zlib

from ..core.errors import DeviceError, GeometryError, LinkTimeout
from ..link.link import Link
from ..protocol import payloads
from ..protocol.messages import CHUNK_BYTES, MessageType
from ..protocol.payloads import CalibrationState, CalibrationStatus
from ..protocol.refusals import failed_calibration
from .base import Progress
from .pieces import report, upload_pieces

#: Seconds between two polls for the state.
_POLL_S = 0.1

#: Longest check and write of a calibration in seconds: a slow simulation counts rows and writes to flash for minutes.
_WRITE_LIMIT_S = 600.0

#: Bytes of the checksum at the end of a record.
_CRC_BYTES = 4


def ask_calibration(link: Link) -> CalibrationStatus:
    """Return what a device with rectification says of its calibration."""
    return _ask(link, MessageType.CALIBRATION)


def write_calibration(link: Link, record: bytes, keep: bool, progress: Progress | None) -> CalibrationStatus:
    """Send a record to the device, and wait until it is in use, and in flash if it is to be kept.

    Parameters
    ----------
    link
        The link to the device, in a session.
    record
        The calibration record.
    keep
        Whether the device writes it to flash; otherwise it has it until its next reset.
    progress
        Called with the steps of "upload" and "write".

    Raises
    ------
    GeometryError
        It is no record, or the device has no room for it.
    DeviceError
        The device refuses it, as its map needs too many rows, or fails or does not answer.
    """
    if len(record) <= _CRC_BYTES or zlib.crc32(record[:-_CRC_BYTES]) != int.from_bytes(record[-_CRC_BYTES:], "little"):
        raise GeometryError("the calibration record does not end with its CRC: it is damaged")
    room = ask_calibration(link).room
    if len(record) > room:
        raise GeometryError(f"the calibration record has {len(record)} bytes, the device has room for {room}")
    crc   = int.from_bytes(record[-_CRC_BYTES:], "little")
    reply = _ask(link, MessageType.CALIBRATE, payloads.pack_update(len(record), crc))
    if reply.state == CalibrationState.DONE and keep and not reply.kept:
        # It is in use, and to be kept now: send it once more. Another announcement makes the device forget this one.
        _ask(link, MessageType.CALIBRATE, payloads.pack_update(len(record), crc ^ 1))
        reply = _ask(link, MessageType.CALIBRATE, payloads.pack_update(len(record), crc))
    if reply.state == CalibrationState.LOADING:
        upload_pieces(link, MessageType.RECORD, record, progress)
        reply = _ask(link, MessageType.ADOPT, payloads.pack_number(int(keep)))
    return _wait(link, reply, progress)


def read_calibration(link: Link) -> bytes | None:
    """Return the record of the calibration that the device uses; None if it uses none."""
    status = ask_calibration(link)
    if not status.width:
        return None
    calls = [link.submit(MessageType.RECALL, payloads.pack_number(length), offset=offset, reply_bytes=length)
             for offset in range(0, status.length, CHUNK_BYTES)
             for length in [min(CHUNK_BYTES, status.length - offset)]]
    link.wait(calls)
    record = b"".join(call.reply.payload for call in calls if call.reply is not None)
    if len(record) != status.length:
        raise DeviceError(f"the device sent {len(record)} bytes of its calibration instead of {status.length}")
    return record


def erase_calibration(link: Link) -> CalibrationStatus:
    """Have the device use no calibration, and erase the one in its flash."""
    return _ask(link, MessageType.FORGET)


def calibration_gap(status: CalibrationStatus, width: int, height: int, grid_crc: int) -> str:
    """Return why a device with that calibration does not rectify by a grid; empty if it does."""
    advice = "`litestereo calibration write` gives it this one"
    if not status.width:
        return f"the device has no calibration, {advice}"
    if (status.width, status.height) != (width, height):
        return f"the calibration of the device is for images of {status.width}x{status.height} pixels, {advice}"
    if status.grid_crc != grid_crc:
        return f"the device has the calibration of another grid, {status.grid_crc:08x}, {advice}"
    return ""


def _ask(link: Link, kind: MessageType, payload: bytes = b"") -> CalibrationStatus:
    return CalibrationStatus.unpack(link.call(kind, payload).payload)


def _wait(link: Link, reply: CalibrationStatus, progress: Progress | None) -> CalibrationStatus:
    give_up_at = time.monotonic() + _WRITE_LIMIT_S
    report(progress, "write", 0, 1)
    while reply.state != CalibrationState.DONE:
        if reply.state == CalibrationState.FAILED:
            raise failed_calibration(reply)
        if reply.state not in (CalibrationState.CHECKING, CalibrationState.WRITING):
            raise DeviceError("the device restarted while it checked the calibration: try again")
        if time.monotonic() > give_up_at:
            raise LinkTimeout(f"the device has not finished with the calibration within {_WRITE_LIMIT_S:g} s: restart "
                              "it, and try again")
        link.idle(_POLL_S)
        reply = ask_calibration(link)
    report(progress, "write", 1, 1)
    return reply
