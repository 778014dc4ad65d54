#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Payloads of the link protocol's messages, packed and unpacked; docs/protocol.md specifies them."""

from __future__ import annotations

import enum
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from ..core.errors import ProtocolError
from ..core.settings import Parameter
from .messages import CHUNK_BYTES

_NUMBER       = struct.Struct("<I")
_PARAMETER    = struct.Struct("<HHi")
_SIZE         = struct.Struct("<HH")
_OPENED       = struct.Struct("<HHI")
_CAPABILITIES = struct.Struct("<IIHHHHHBBIIHHI16s")
_CAPABILITY   = struct.Struct("<HHI")
_STATUS       = struct.Struct("<BBHIII")
_STATUS_MORE  = struct.Struct("<HHI")
_ERROR        = struct.Struct("<HBBI")
_UPDATE       = struct.Struct("<II")
_PROGRESS     = struct.Struct("<BBBBIII")
_OPTIONS      = struct.Struct("<HH")
_CALIBRATION  = struct.Struct("<BBBBHHHHIII")

#: Names of the STATISTICS counters, in the order of the protocol.
COUNTERS = (
    "messages_received",
    "messages_sent",
    "bytes_received",
    "framing_errors",
    "crc_errors",
    "header_errors",
    "requests_refused",
    "receive_timeouts",
    "sessions",
    "frames_opened",
    "frames_matched",
    "frames_failed",
    "frames_released",
    "frames_reclaimed",
    "chunks_received",
    "chunks_repeated",
    "chunks_while_matching",
    "matcher_interrupts",
    "matcher_timeouts",
    "console_lines",
    "sessions_refused",
    "datagrams_received",
    "datagrams_sent",
    "datagrams_malformed",
    "datagrams_overrun",
    "mailbox_overrun",
    "uploads_foreign",
    "uploads_unfit",
)


def _unpack(layout: struct.Struct, payload: bytes, what: str) -> tuple[Any, ...]:
    if len(payload) < layout.size:
        raise ProtocolError(f"the device's {what} is {len(payload)} bytes long instead of {layout.size}")
    return layout.unpack_from(payload)


@dataclass(frozen=True)
class Capabilities:
    """Reply to HELLO: what a device is; sizes in pixels, versions as major x 256 + minor.

    `more` has the values that come after the fixed fields, by their numbers, and those that are unknown here too. A
    device with an older firmware sends none.
    """

    session:          int
    nonce:            int
    gateware_version: int
    firmware_version: int
    max_width:        int
    max_height:       int
    max_disparities:  int
    min_block_size:   int
    max_block_size:   int
    features:         int
    max_pixels:       int
    slots:            int
    chunk_size:       int
    sys_clk_hz:       int
    name:             str
    more:             Mapping[int, int] = field(default_factory=dict, hash=False)

    def pack(self) -> bytes:
        """Return the payload: 52 bytes, and 8 for each of the further values that is not 0."""
        fixed = _CAPABILITIES.pack(self.session, self.nonce, self.gateware_version, self.firmware_version,
                                   self.max_width, self.max_height, self.max_disparities, self.min_block_size,
                                   self.max_block_size, self.features, self.max_pixels, self.slots,
                                   self.chunk_size, self.sys_clk_hz, self.name.encode("ascii"))
        return fixed + b"".join(_CAPABILITY.pack(number, 0, value) for number, value in sorted(self.more.items())
                                if value)

    @classmethod
    def unpack(cls, payload: bytes) -> Capabilities:
        """Return the capabilities of a payload; raise ProtocolError if it is too short."""
        *numbers, name = _unpack(_CAPABILITIES, payload, "list of capabilities")
        rest  = payload[_CAPABILITIES.size:]
        whole = len(rest)//_CAPABILITY.size*_CAPABILITY.size
        more  = {number: value for number, _, value in _CAPABILITY.iter_unpack(rest[:whole])}
        return cls(*(*numbers, name.split(b"\0")[0].decode("ascii", "replace"), more))


class FrameState(enum.IntEnum):
    """States of a frame in the device."""

    EMPTY    = 0
    LOADING  = 1
    READY    = 2
    MATCHING = 3
    DONE     = 4
    FAILED   = 5


class FrameOption(enum.IntFlag):
    """What a frame asks for when it is opened."""

    RECTIFIED = 1
    LEFT      = 2
    RIGHT     = 4


class FrameFlag(enum.IntFlag):
    """What a device tells of a frame that it rectified."""

    RECTIFIED = 1
    ROW_GONE  = 2
    FOLDED    = 4


@dataclass(frozen=True)
class FrameStatus:
    """Reply to STATUS.

    `first_missing` is the offset of a chunk in the upload space, or in the pairs of a streamed frame; NO_OFFSET if none
    is missing. `flags`, of `FrameFlag`, and `grid_crc`, the CRC of the grid by which the frame was rectified, are those
    of a frame that was opened with options; otherwise 0.
    """

    state:            int
    slot:             int
    error:            int
    clocks:           int
    first_row_clocks: int
    first_missing:    int
    flags:            int = 0
    grid_crc:         int = 0

    def pack(self) -> bytes:
        """Return the payload: 16 bytes, and 8 for flags and CRC if these are not 0."""
        more = _STATUS_MORE.pack(self.flags, 0, self.grid_crc) if self.flags or self.grid_crc else b""
        return _STATUS.pack(self.state, self.slot, self.error, self.clocks, self.first_row_clocks,
                            self.first_missing) + more

    @classmethod
    def unpack(cls, payload: bytes) -> FrameStatus:
        """Return the status of a payload; raise ProtocolError if it is too short."""
        fixed = _unpack(_STATUS, payload, "frame status")
        if len(payload) < _STATUS.size + _STATUS_MORE.size:
            return cls(*fixed)
        flags, _, grid_crc = _STATUS_MORE.unpack_from(payload, _STATUS.size)
        return replace(cls(*fixed), flags=flags, grid_crc=grid_crc)


class UpdateState(enum.IntEnum):
    """States of an update of the firmware."""

    EMPTY    = 0
    LOADING  = 1
    CHECKING = 2
    WRITING  = 3
    DONE     = 4
    FAILED   = 5


class UpdateFailure(enum.IntEnum):
    """Reasons why an update has failed."""

    CHECKSUM  = 1
    FOREIGN   = 2
    PROTECTED = 3
    TIMEOUT   = 4
    VERIFY    = 5


class Trial(enum.IntEnum):
    """Outcomes of the trial of the newest firmware."""

    UNKNOWN   = 0
    RUNNING   = 1
    CONFIRMED = 2
    FELL_BACK = 3


@dataclass(frozen=True)
class UpdateProgress:
    """Reply to UPDATE, WRITE and PROGRESS; `room` is the longest possible program in bytes, `trial` a `Trial`."""

    state:   int
    failure: int
    done:    int
    total:   int
    room:    int
    trial:   int = Trial.UNKNOWN

    def pack(self) -> bytes:
        """Return the payload, 16 bytes."""
        return _PROGRESS.pack(self.state, self.failure, self.trial, 0, self.done, self.total, self.room)

    @classmethod
    def unpack(cls, payload: bytes) -> UpdateProgress:
        """Return the progress of a payload; raise ProtocolError if it is too short."""
        state, failure, trial, _, done, total, room = _unpack(_PROGRESS, payload, "progress of an update")
        return cls(state, failure, done, total, room, trial)


class CalibrationState(enum.IntEnum):
    """States of the calibration that was announced to a device."""

    EMPTY    = 0
    LOADING  = 1
    CHECKING = 2
    WRITING  = 3
    DONE     = 4
    FAILED   = 5


class CalibrationFailure(enum.IntEnum):
    """Reasons why a device does not use a calibration, or has not kept it."""

    CHECKSUM = 1
    FORMAT   = 2
    SIZE     = 3
    FOLDED   = 4
    ROWS     = 5
    FLASH    = 6


@dataclass(frozen=True)
class CalibrationStatus:
    """Reply to CALIBRATE, ADOPT, CALIBRATION and FORGET.

    `state` and `failure` are of the announced calibration; `rows_needed` is of the one that was checked last, `rows` of
    the device. `kept` (in flash), `width` and `height` in pixels, `grid_crc` and `length` in bytes are of the one in
    use, all 0 without one; `room` is the longest possible calibration in bytes.
    """

    state:       int
    failure:     int
    kept:        int
    rows_needed: int
    rows:        int
    width:       int
    height:      int
    grid_crc:    int
    length:      int
    room:        int

    def pack(self) -> bytes:
        """Return the payload, 24 bytes."""
        return _CALIBRATION.pack(self.state, self.failure, self.kept, 0, self.rows_needed, self.rows, self.width,
                                 self.height, self.grid_crc, self.length, self.room)

    @classmethod
    def unpack(cls, payload: bytes) -> CalibrationStatus:
        """Return the state of a payload; raise ProtocolError if it is too short."""
        state, failure, kept, _, *rest = _unpack(_CALIBRATION, payload, "state of its calibration")
        return cls(state, failure, kept, *rest)


def pack_update(length: int, crc: int) -> bytes:
    """Return the payload of UPDATE and CALIBRATE: the length of the program or calibration in bytes, and its CRC-32."""
    return _UPDATE.pack(length, crc)


def pack_number(number: int) -> bytes:
    """Return a payload of one u32: the nonce of HELLO, the length of READ, the missing chunks of UPLOAD's reply."""
    return _NUMBER.pack(number)


def unpack_number(payload: bytes) -> int:
    """Return the u32 of a payload; raise ProtocolError if it is too short."""
    (number,) = _unpack(_NUMBER, payload, "number")
    return int(number)


def pack_parameters(parameters: Mapping[Parameter, int]) -> bytes:
    """Return the payload of CONFIGURE."""
    return b"".join(_PARAMETER.pack(parameter, 0, value) for parameter, value in parameters.items())


def pack_size(width: int, height: int, options: int = 0) -> bytes:
    """Return the payload of OPEN and STREAM, sizes in pixels; `options` of `FrameOption`."""
    return _SIZE.pack(width, height) + (_OPTIONS.pack(options, 0) if options else b"")


def pack_opened(slot: int, pitch: int) -> bytes:
    """Return the payload of the reply to OPEN, or to STREAM, for which the pitch is 0."""
    return _OPENED.pack(slot, 0, pitch)


def unpack_opened(payload: bytes) -> tuple[int, int]:
    """Return slot and pitch (bytes) of OPEN's reply; raise ProtocolError if it is too short."""
    slot, _, pitch = _unpack(_OPENED, payload, "reply to OPEN")
    return slot, pitch


def pack_error(code: int, request_type: int, detail: int) -> bytes:
    """Return the payload of ERROR."""
    return _ERROR.pack(code, request_type, 0, detail)


def unpack_error(payload: bytes) -> tuple[int, int, int]:
    """Return code, request type and detail of ERROR; raise ProtocolError if it is too short."""
    code, request_type, _, detail = _unpack(_ERROR, payload, "error")
    return code, request_type, detail


def pack_counters(counters: Mapping[str, int]) -> bytes:
    """Return the payload of STATISTICS' reply."""
    return b"".join(_NUMBER.pack(counters[name]) for name in COUNTERS)


def unpack_counters(payload: bytes) -> dict[str, int]:
    """Return counters by name; those that a newer device has appended are called `counter_<index>`."""
    values = [value for (value,) in _NUMBER.iter_unpack(payload[:len(payload) // 4 * 4])]
    return {COUNTERS[index] if index < len(COUNTERS) else f"counter_{index}": value
            for index, value in enumerate(values)}


def frame_pitch(width: int, height: int) -> int:
    """Return the bytes from the left to the right image in the upload space: the image size in whole chunks."""
    return -(-width * height // CHUNK_BYTES) * CHUNK_BYTES
