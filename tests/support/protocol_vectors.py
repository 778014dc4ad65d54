#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Test vectors of the link protocol, shared with the firmware's tests.

Writes tests/vectors/protocol.txt, one line per vector: name, message in hex, and its frame on a serial line in hex.
Run `python tests/support/protocol_vectors.py` after a change of the protocol.
"""

from __future__ import annotations

import random
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from litestereo.host_tools.core.settings import Parameter
from litestereo.host_tools.link.serial_framing import encode_frame
from litestereo.host_tools.protocol import payloads
from litestereo.host_tools.protocol.messages import CHUNK_BYTES, ErrorCode, Message, MessageType

VECTOR_FILE = Path(__file__).parents[1] / "vectors" / "protocol.txt"

SESSION = 0x13572468
NONCE   = 0xc0ffee01

CAPABILITIES = payloads.Capabilities(
    session=SESSION, nonce=NONCE, gateware_version=0x0102, firmware_version=0x0304, max_width=1024,
    max_height=768, max_disparities=64, min_block_size=5, max_block_size=21, features=0x5, max_pixels=786432,
    slots=2, chunk_size=CHUNK_BYTES, sys_clk_hz=100_000_000, name="LiteStereo",
)

#: Capabilities of a newer device, with more values after the fixed fields; the host tools do not know one number.
MORE_CAPABILITIES = replace(CAPABILITIES, more={1: 16, 2: 262136, 0xffff: 7})

STATUS = payloads.FrameStatus(state=payloads.FrameState.DONE, slot=1, error=0, clocks=123456,
                              first_row_clocks=2345, first_missing=0xffffffff)

RECTIFIED_STATUS = replace(STATUS, flags=5, grid_crc=0x89abcdef)

CALIBRATION = payloads.CalibrationStatus(state=payloads.CalibrationState.DONE, failure=0, kept=1, rows_needed=52,
                                         rows=64, width=640, height=480, grid_crc=0x89abcdef, length=10296, room=20224)

PROGRESS = payloads.UpdateProgress(state=payloads.UpdateState.WRITING, failure=0, done=20000, total=300000, room=262136)


def _types() -> Iterator[tuple[str, Message]]:
    """Yield every request with its reply, and every error."""
    number   = payloads.pack_number
    settings = payloads.pack_parameters({Parameter.DISPARITIES: 64, Parameter.BLOCK_SIZE: 9})
    counters = {name: 1000 + index for index, name in enumerate(payloads.COUNTERS)}
    map_row  = bytes(range(256)) * 2
    exchanges = [
        (MessageType.HELLO,      0, 0,    number(NONCE),                  CAPABILITIES.pack()),
        (MessageType.CONFIGURE,  0, 0,    settings,                       b""),
        (MessageType.OPEN,       7, 0,    payloads.pack_size(247, 166),   payloads.pack_opened(1, 41984)),
        (MessageType.UPLOAD,     7, 2048, bytes(range(256)) * 4,          number(79)),
        (MessageType.START,      7, 0,    b"",                            b""),
        (MessageType.STATUS,     7, 0,    b"",                            STATUS.pack()),
        (MessageType.READ,       7, 512,  number(len(map_row)),           map_row),
        (MessageType.RELEASE,    7, 0,    b"",                            b""),
        (MessageType.STATISTICS, 0, 0,    b"",                            payloads.pack_counters(counters)),
        (MessageType.BYE,        0, 0,    b"",                            b""),
        (MessageType.MISSING,    7, 0,    b"",                            bytes(range(11))),
        (MessageType.STREAM,     8, 0,    payloads.pack_size(247, 166),   payloads.pack_opened(1, 0)),
        (MessageType.PAIRS,      8, 3072, bytes(range(256)) * 4,          None),
        (MessageType.UPDATE,     0, 0,    payloads.pack_update(50000, 7), PROGRESS.pack()),
        (MessageType.IMAGE,      0, 1024, bytes(range(256)) * 4,          b""),
        (MessageType.WRITE,      0, 0,    b"",                            PROGRESS.pack()),
        (MessageType.PROGRESS,   0, 0,    b"",                            PROGRESS.pack()),
        (MessageType.RESTART,    0, 0,    b"",                            b""),
        (MessageType.CALIBRATE,  0, 0,    payloads.pack_update(10296, 7), CALIBRATION.pack()),
        (MessageType.RECORD,     0, 1024, bytes(range(256)) * 4,          b""),
        (MessageType.ADOPT,      0, 0,    number(1),                      CALIBRATION.pack()),
        (MessageType.CALIBRATION, 0, 0,   b"",                            CALIBRATION.pack()),
        (MessageType.RECALL,     0, 512,  number(len(map_row)),           map_row),
        (MessageType.FORGET,     0, 0,    b"",                            CALIBRATION.pack()),
    ]
    for sequence, (kind, frame_id, offset, payload, answer) in enumerate(exchanges, start=1):
        session = 0 if kind == MessageType.HELLO else SESSION
        request = Message(kind, session, sequence, frame_id, offset, payload)
        yield f"{kind.name.lower()}_request", request
        if answer is not None:
            yield f"{kind.name.lower()}_reply", request.reply(answer)
    for code in ErrorCode:
        payload = payloads.pack_error(code, MessageType.START, 0x100 + code)
        yield f"error_{code.name.lower()}", Message(MessageType.ERROR, SESSION, 100 + code, 7, 0, payload)


def _edges() -> Iterator[tuple[str, Message]]:
    """Yield payloads around the 254 bytes of a COBS block, zeros only, and header fields at their limits."""
    generator = random.Random(20140801)

    def upload(payload: bytes) -> Message:
        return Message(MessageType.UPLOAD, SESSION, 0x01020304, 0x05060708, 0x090a0b0c, payload)

    for length in (0, 1, 2, *range(225, 235), 253, 254, 255, 508, 509, 1023, 1024):
        yield f"nonzero_{length}", upload(bytes(generator.randrange(1, 256) for _ in range(length)))
    for length in (1, 254, 255, 1024):
        yield f"zeros_{length}", upload(bytes(length))
        yield f"ones_{length}", upload(b"\xff" * length)
    for length in (3, 600, 1024):
        yield f"random_{length}", upload(generator.randbytes(length))
    for gap in (253, 254, 255):
        yield f"zero_every_{gap}", upload((b"\x5a" * gap + b"\0") * 4)
    options = payloads.FrameOption.RECTIFIED | payloads.FrameOption.RIGHT
    opened  = payloads.pack_size(247, 166, options)
    yield "open_request_with_options", Message(MessageType.OPEN, SESSION, 1, 7, 0, opened)
    yield "status_reply_with_more", Message(MessageType.STATUS, SESSION, 2, 7, 0, b"").reply(RECTIFIED_STATUS.pack())
    yield "hello_reply_with_more", Message(MessageType.HELLO, 0, 1, 0, 0, b"").reply(MORE_CAPABILITIES.pack())
    largest = 0xffffffff
    yield "largest_fields", Message(MessageType.READ, largest, largest, largest, largest, b"\xff" * 4)
    yield "other_version", Message(MessageType.HELLO, 0, 1, 0, 0, payloads.pack_number(NONCE), version=2)


def vectors() -> dict[str, Message]:
    """Return every vector by its name, in the order of the file."""
    return dict([*_types(), *_edges()])


def vector_text() -> str:
    """Return the text of the file of vectors."""
    return "".join(f"{name} {message.encode().hex()} {encode_frame(message.encode()).hex()}\n"
                   for name, message in vectors().items())


if __name__ == "__main__":
    VECTOR_FILE.parent.mkdir(exist_ok=True)
    VECTOR_FILE.write_text(vector_text(), encoding="ascii")
