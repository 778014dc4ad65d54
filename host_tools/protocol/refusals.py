#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""ERROR replies as exceptions, in words."""

from __future__ import annotations

from ..core.errors import DeviceRefused, LiteStereoError, ProtocolError, SessionLost, UpdateFailed
from ..core.settings import Parameter
from . import payloads
from .messages import VERSION, ErrorCode, Message, MessageType

_SIZES = {
    1: "it is wider than the device's lines",
    2: "it is higher than the device allows",
    3: "it has more pixels than the device's memory holds",
    4: "it is too narrow for the disparities and the block size",
    5: "it is too low for the block size",
    6: "the firmware is too long for the device's flash",
}


#: Types of requests that belong to an update.
_UPDATE_TYPES = {MessageType.UPDATE, MessageType.IMAGE, MessageType.WRITE, MessageType.PROGRESS, MessageType.RESTART}

#: Types of requests that belong to a calibration.
_CALIBRATION_TYPES = {MessageType.CALIBRATE, MessageType.RECORD, MessageType.ADOPT, MessageType.CALIBRATION,
                      MessageType.RECALL, MessageType.FORGET}

#: Reasons why an update failed, in words.
_FAILURES: dict[int, str] = {
    payloads.UpdateFailure.CHECKSUM:  "it arrived damaged, try again",
    payloads.UpdateFailure.FOREIGN:   "it is for another board or another bitstream, write both with `make flash`",
    payloads.UpdateFailure.PROTECTED: "its flash is write-protected, unprotect it by cable with openFPGALoader "
                                      "--unprotect-flash",
    payloads.UpdateFailure.TIMEOUT:   "the flash did not finish; it still holds a good image",
    payloads.UpdateFailure.VERIFY:    "the flash did not keep what was written; it still holds a good image",
}

#: Reasons why a device does not use a calibration, or has not kept it, in words.
_CALIBRATION_FAILURES: dict[int, str] = {
    payloads.CalibrationFailure.CHECKSUM: "it arrived damaged, try again",
    payloads.CalibrationFailure.FORMAT:   "it is no calibration record that its firmware knows, use host tools and "
                                          "firmware of one release",
    payloads.CalibrationFailure.SIZE:     "it cannot rectify images of that size, see `litestereo info`",
    payloads.CalibrationFailure.FOLDED:   "its map folds over",
    payloads.CalibrationFailure.FLASH:    "its flash does not keep it; it is in use until the next reset",
}


def version_mismatch(device_version: int) -> ProtocolError:
    """Return the error for a device that speaks another version of the protocol."""
    return ProtocolError(f"the device speaks link protocol version {device_version}, this host version "
                         f"{VERSION}: install the host tools and the firmware of one release")


def refusal(reply: Message) -> LiteStereoError:
    """Return the exception for an ERROR reply; raise ProtocolError if its payload is too short."""
    code, request_type, detail = payloads.unpack_error(reply.payload)
    if code == ErrorCode.VERSION:
        return version_mismatch(detail)
    if code == ErrorCode.SESSION:
        return SessionLost("the device ended this session: another host connected to it, or it restarted; "
                           "connect again")
    if code == ErrorCode.BUSY and request_type != MessageType.HELLO:
        return SessionLost("another host has taken the device over while this one was silent: connect again")
    known   = request_type in set(MessageType)
    request = MessageType(request_type).name if known else f"request {request_type:#04x}"
    reason  = _reason(code, reply.frame_id, detail)
    if code == ErrorCode.STATE and request_type in _UPDATE_TYPES:
        reason = f"an update is {_name(payloads.UpdateState, detail)}"
    if code == ErrorCode.TYPE and request_type in _UPDATE_TYPES - {MessageType.RESTART}:
        reason = "it has no flash for firmware"
    if code == ErrorCode.STATE and request_type in _CALIBRATION_TYPES:
        reason = f"a calibration is {_name(payloads.CalibrationState, detail)}"
    if code == ErrorCode.SIZE and request_type == MessageType.CALIBRATE:
        reason = "the calibration is too long for the device's memory"
    if code == ErrorCode.TYPE and request_type in _CALIBRATION_TYPES:
        reason = "it was built without rectification"
    return DeviceRefused(f"the device refused {request}: {reason}", code, detail)


def _parameter(number: int) -> str:
    return Parameter(number).name.lower() if number in set(Parameter) else f"parameter {number}"


def _reason(code: int, frame_id: int, detail: int) -> str:
    reasons = {
        ErrorCode.TYPE:       f"its firmware does not know type {detail:#04x}, update it",
        ErrorCode.LENGTH:     f"a payload of {detail} bytes was expected",
        ErrorCode.PARAMETER:  f"its firmware does not know {_parameter(detail)}, update it",
        ErrorCode.RANGE:      f"{_parameter(detail)} is out of its range, see `litestereo info`",
        ErrorCode.NO_SLOT:    f"all of its {detail} frame slots are in use",
        ErrorCode.FRAME:      f"it does not know frame {frame_id}",
        ErrorCode.STATE:      f"frame {frame_id} is {_name(payloads.FrameState, detail)}",
        ErrorCode.OFFSET:     f"there is nothing of that length at offset {detail}",
        ErrorCode.INCOMPLETE: f"frame {frame_id} lacks the chunk at offset {detail}",
        ErrorCode.SIZE:       f"{_SIZES.get(detail, 'the size of the image')}, see `litestereo info`",
        ErrorCode.MATCHER:    f"the accelerator reported error {detail}",
        ErrorCode.TIMEOUT:    f"the accelerator did not finish within {detail} clocks",
        ErrorCode.FEATURE:    f"it was not built for {_built(detail)}, see `litestereo info`",
        ErrorCode.BUSY:       f"another host is using it; if that host stays silent it is free in {detail/1000:.1f} s",
        ErrorCode.DUPLICATE:  f"frame {detail} is already in use",
        ErrorCode.CALIBRATION: _calibration(detail),
        ErrorCode.FLASH:      "it has no flash for a calibration, or the flash does not keep it",
    }
    return reasons.get(ErrorCode(code), "") if code in set(ErrorCode) else f"error {code}, detail {detail}"


def _built(detail: int) -> str:
    return f"that value of {_parameter(detail)}" if detail else "rectification"


def _calibration(detail: int) -> str:
    if not detail:
        return "it has no calibration, write one first"
    return f"its calibration is for images of {detail >> 16}x{detail & 0xffff} pixels"


def _name(states: type[payloads.FrameState] | type[payloads.UpdateState] | type[payloads.CalibrationState],
          number: int) -> str:
    return states(number).name.lower() if number in set(states) else f"in state {number}"


def failed_update(failure: int) -> UpdateFailed:
    """Return the exception for an update that the device has given up."""
    reason = _FAILURES.get(failure, f"failure {failure}")
    return UpdateFailed(f"the device did not accept the firmware: {reason}", failure, 0)


def failed_calibration(status: payloads.CalibrationStatus) -> DeviceRefused:
    """Return the exception for a calibration that the device does not use, or has not kept."""
    reason = _CALIBRATION_FAILURES.get(status.failure, f"failure {status.failure}")
    if status.failure == payloads.CalibrationFailure.ROWS:
        reason = (f"it needs {status.rows_needed} rows of the images at once, the device keeps {status.rows}: mount "
                  "the cameras straighter, or use smaller images")
    return DeviceRefused(f"the device did not accept the calibration: {reason}", status.failure, 0)


def spoiled_frame(frame_id: int, reason: str) -> DeviceRefused:
    """Return the exception for a frame that the device has not rectified as it was asked to."""
    return DeviceRefused(f"the device could not rectify frame {frame_id}: {reason}", 0, 0)


def failed_frame(frame_id: int, error: int) -> DeviceRefused:
    """Return the exception for a frame whose match has failed with an error code."""
    name = ErrorCode(error).name.lower() if error in set(ErrorCode) else "unknown"
    return DeviceRefused(f"the device could not match frame {frame_id}: error {error} ({name}); "
                         "see `litestereo stats`", error, 0)
