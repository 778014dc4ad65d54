#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Messages and payloads against the committed vectors and the tables of docs/protocol.md."""

import itertools
import re
import struct
import zlib
from dataclasses import replace

import pytest

from litestereo.host_tools.core.errors import LiteStereoError, ProtocolError, SessionLost
from litestereo.host_tools.core.features import CAPABILITY_TEXTS, Capability, named_capabilities
from litestereo.host_tools.core.settings import Parameter
from litestereo.host_tools.link.serial_framing import MAX_ENCODED_BYTES, Demultiplexer, encode_frame
from litestereo.host_tools.protocol import messages as protocol
from litestereo.host_tools.protocol import payloads
from litestereo.host_tools.protocol.messages import ErrorCode, Message, MessageType
from litestereo.host_tools.protocol.refusals import (
    failed_calibration,
    failed_frame,
    failed_update,
    refusal,
    spoiled_frame,
)
from support.pairs import byte_generator
from support.paths import CHECKOUT
from support.protocol_vectors import (
    CALIBRATION,
    CAPABILITIES,
    MORE_CAPABILITIES,
    PROGRESS,
    STATUS,
    VECTOR_FILE,
    vector_text,
    vectors,
)

DOCUMENT = CHECKOUT / "docs" / "protocol.md"


def table(heading: str) -> list[list[str]]:
    """Rows of the first table below a heading of the document, code marks removed."""
    section = re.split(rf"^#+ {heading}$", DOCUMENT.read_text(), flags=re.MULTILINE)[1]
    rows    = []
    for line in section.splitlines():
        if line.startswith("|"):
            rows.append([cell.strip().replace("`", "") for cell in line.strip("|").split("|")])
        elif rows:
            break
    return rows[2:]


def test_vectors_are_those_of_the_generator():
    assert VECTOR_FILE.read_text() == vector_text(), "run python tests/support/protocol_vectors.py"


def test_vectors_cover_every_type_and_error():
    messages = vectors().values()
    types    = {message.type for message in messages}
    requests = {kind for kind in MessageType if kind != MessageType.ERROR}
    replies  = {kind | protocol.REPLY for kind in requests - {MessageType.PAIRS}}
    assert types == requests | replies | {MessageType.ERROR}
    errors = [message for message in messages if message.type == MessageType.ERROR]
    codes  = {payloads.unpack_error(message.payload)[0] for message in errors}
    assert codes == set(ErrorCode)
    assert {0, protocol.CHUNK_BYTES} <= {len(message.payload) for message in messages}


def test_every_vector_decodes_to_its_message():
    for line, (name, message) in zip(VECTOR_FILE.read_text().splitlines(), vectors().items(), strict=True):
        vector_name, plain, framed = line.split()
        assert vector_name == name
        assert Message.decode(bytes.fromhex(plain)) == message
        assert Demultiplexer().feed(bytes.fromhex(framed)) == [message]
        assert len(framed) // 2 <= MAX_ENCODED_BYTES + 2


def test_layout_by_hand():
    """The header's fields are where the document puts them."""
    body  = bytes.fromhex("4c53 01 04 78563412 05000000 07000000 00040000 03000000".replace(" ", "")) + b"abc"
    plain = body + struct.pack("<I", zlib.crc32(body))
    assert Message(MessageType.UPLOAD, 0x12345678, 5, 7, 1024, b"abc").encode() == plain


def test_changed_bytes_never_decode():
    rng   = byte_generator(2)
    plain = Message(MessageType.UPLOAD, 1, 2, 3, 4, bytes(range(64))).encode()
    for position in range(len(plain)):
        broken = bytearray(plain)
        broken[position] ^= rng.randrange(1, 256)
        with pytest.raises(ProtocolError):
            Message.decode(bytes(broken))
    for length in range(len(plain)):
        with pytest.raises(ProtocolError):
            Message.decode(plain[:length])


@pytest.mark.parametrize("change", [b"XS", b"LS"])
def test_wrong_magic_or_length_with_a_right_crc_is_refused(change):
    body = change + Message(MessageType.START).encode()[2:-4] + (b"extra" if change == b"LS" else b"")
    with pytest.raises(ProtocolError):
        Message.decode(body + struct.pack("<I", zlib.crc32(body)))


def test_what_does_not_fit_a_message_is_refused():
    with pytest.raises(ProtocolError):
        Message(MessageType.UPLOAD, payload=bytes(1025)).encode()
    with pytest.raises(ProtocolError):
        Message(MessageType.UPLOAD, offset=1 << 32).encode()
    largest = Message(MessageType.UPLOAD, payload=bytes(1024)).encode()
    assert len(largest) == protocol.MAX_MESSAGE_BYTES == 1052


def test_payloads_come_back():
    assert len(CAPABILITIES.pack()) == 52
    assert payloads.Capabilities.unpack(CAPABILITIES.pack()) == CAPABILITIES
    assert len(STATUS.pack()) == 16
    assert payloads.FrameStatus.unpack(STATUS.pack()) == STATUS
    assert payloads.UpdateProgress.unpack(PROGRESS.pack()) == PROGRESS
    assert payloads.CalibrationStatus.unpack(CALIBRATION.pack()) == CALIBRATION
    rectified = replace(STATUS, flags=5, grid_crc=0xfedcba98)
    assert rectified.pack() == STATUS.pack() + bytes.fromhex("0500000098badcfe")
    assert payloads.FrameStatus.unpack(rectified.pack()) == rectified
    assert payloads.unpack_number(payloads.pack_number(0xfedcba98)) == 0xfedcba98
    assert payloads.unpack_opened(payloads.pack_opened(1, 41984)) == (1, 41984)
    counters = {name: index for index, name in enumerate(payloads.COUNTERS)}
    assert payloads.unpack_counters(payloads.pack_counters(counters)) == counters
    assert payloads.pack_parameters({Parameter.BLOCK_SIZE: 9}) == bytes.fromhex("0200000009000000")
    assert payloads.pack_size(247, 166) == bytes.fromhex("f700a600")
    assert payloads.pack_size(247, 166, payloads.FrameOption.RIGHT) == bytes.fromhex("f700a60004000000")


def test_a_newer_device_may_append_and_an_older_may_lack_counters():
    assert payloads.unpack_counters(b"\1\0\0\0")  == {"messages_received": 1}
    longer = payloads.unpack_counters(bytes(4*len(payloads.COUNTERS)) + b"\7\0\0\0")
    assert longer[f"counter_{len(payloads.COUNTERS)}"] == 7
    assert payloads.Capabilities.unpack(CAPABILITIES.pack() + b"more") == CAPABILITIES


def test_short_payloads_are_refused():
    for unpack in (payloads.Capabilities.unpack, payloads.FrameStatus.unpack, payloads.unpack_number,
                   payloads.UpdateProgress.unpack, payloads.CalibrationStatus.unpack,
                   payloads.unpack_opened, payloads.unpack_error):
        with pytest.raises(ProtocolError):
            unpack(b"\0\0")


@pytest.mark.parametrize(("width", "height", "pitch"), [(32, 32, 1024), (33, 32, 2048), (1, 1, 1024),
                                                        (247, 166, 41984)])
def test_pitch_is_the_image_in_whole_chunks(width, height, pitch):
    assert payloads.frame_pitch(width, height) == pitch


def test_documented_types():
    documented = {row[1]: int(row[0], 16) for row in table("Types")}
    errors     = {name: number for name, number in documented.items() if "ERROR" in name}
    assert list(errors.values()) == [MessageType.ERROR]
    assert {name: number for name, number in documented.items() if name not in errors} == {
        kind.name: kind.value for kind in MessageType if kind != MessageType.ERROR}


def test_documented_errors():
    assert {row[1]: int(row[0]) for row in table("Errors")} == {code.name: code.value for code in ErrorCode}


def test_documented_parameters():
    documented = {row[1].upper(): int(row[0]) for row in table("Parameters")}
    assert documented == {parameter.name: parameter.value for parameter in Parameter}


def test_documented_counters():
    rows = table("Counters")
    assert [int(row[0]) for row in rows] == list(range(len(rows)))
    assert [row[1] for row in rows] == list(payloads.COUNTERS)


def test_documented_header():
    sizes  = [(int(row[0]), int(row[1])) for row in table("Message")[:8]]
    names  = [row[2] for row in table("Message")[:8]]
    assert names == ["magic", "version", "type", "session", "sequence", "frame_id", "offset", "length"]
    assert sizes[-1] == (20, 4)
    assert all(offset + size == following for (offset, size), (following, _) in itertools.pairwise(sizes))


def test_documented_capabilities_and_status():
    sizes = {"u8": 1, "u16": 2, "u32": 4, "16 bytes": 16}
    for heading, payload in (("Capabilities", CAPABILITIES.pack()), ("Frame status", STATUS.pack()),
                             ("Progress", PROGRESS.pack()), ("Calibration state", CALIBRATION.pack())):
        rows   = table(heading)
        offset = 0
        for row in rows:
            assert int(row[0]) == offset, row
            offset += sizes[row[1]]
        assert offset == len(payload)
    names  = [row[2].split(",")[0] for row in table("Capabilities")]
    packed = CAPABILITIES.pack()
    for row, name in zip(table("Capabilities"), names, strict=True):
        value = packed[int(row[0]):int(row[0]) + sizes[row[1]]]
        field = getattr(CAPABILITIES, name.split()[0])
        assert value == (field.encode().ljust(16, b"\0") if isinstance(field, str) else
                         field.to_bytes(len(value), "little")), name


def test_documented_further_capabilities():
    documented = {row[1].strip("`"): int(row[0]) for row in table("Further capabilities")}
    assert documented == {one.name.lower(): one.value for one in Capability}
    assert set(CAPABILITY_TEXTS) == set(Capability)


def test_further_capabilities():
    """They come after the 52 bytes; unknown numbers are kept apart, and a torn pair is ignored."""
    payload = MORE_CAPABILITIES.pack()
    assert payload[52:60] == bytes([1, 0, 0, 0, 16, 0, 0, 0])
    assert len(payload) == 52 + 3*8
    for torn in range(8):
        assert payloads.Capabilities.unpack(payload + bytes(torn)) == MORE_CAPABILITIES
    assert named_capabilities(MORE_CAPABILITIES.more) == {"dma_alignment": 16, "update_bytes": 262136}
    assert replace(CAPABILITIES, more={1: 0}).pack() == CAPABILITIES.pack()


def test_older_firmware_sends_no_list():
    assert payloads.Capabilities.unpack(CAPABILITIES.pack()).more == {}
    assert named_capabilities({}) == {}


def test_an_older_host_reads_the_fixed_fields():
    """As it did: at least 52 bytes, of which it unpacks the first."""
    payload = MORE_CAPABILITIES.pack()
    assert len(payload) >= 52
    assert struct.unpack_from("<IIHHHHHBBIIHHI16s", payload) == struct.unpack("<IIHHHHHBBIIHHI16s", CAPABILITIES.pack())


@pytest.mark.parametrize("code", list(ErrorCode))
def test_every_refusal_is_one_clear_line(code):
    reply = Message(MessageType.ERROR, frame_id=7, payload=payloads.pack_error(code, MessageType.START, 2))
    text  = str(refusal(reply))
    assert "\n" not in text and len(text) > 30
    assert isinstance(refusal(reply), SessionLost) == (code in (ErrorCode.SESSION, ErrorCode.BUSY))
    assert isinstance(failed_frame(7, code), LiteStereoError)


@pytest.mark.parametrize("failure", [*payloads.UpdateFailure, 99])
def test_every_failure_of_an_update_is_one_clear_line(failure):
    text = str(failed_update(failure))
    assert "\n" not in text and len(text) > 40


@pytest.mark.parametrize("request_type", [MessageType.UPDATE, MessageType.IMAGE, MessageType.WRITE,
                                          MessageType.PROGRESS])
def test_refusals_of_updates_speak_of_updates(request_type):
    def text(code, detail):
        return str(refusal(Message(MessageType.ERROR, payload=payloads.pack_error(code, request_type, detail))))
    assert "no flash" in text(ErrorCode.TYPE, request_type)
    assert "an update is writing" in text(ErrorCode.STATE, payloads.UpdateState.WRITING)
    assert "too long" in text(ErrorCode.SIZE, 6)


@pytest.mark.parametrize("failure", [*payloads.CalibrationFailure, 99])
def test_every_failure_of_a_calibration_is_one_clear_line(failure):
    text = str(failed_calibration(replace(CALIBRATION, failure=failure, rows_needed=77, rows=64)))
    assert "\n" not in text and len(text) > 40
    assert ("77 rows" in text and "keeps 64" in text) == (failure == payloads.CalibrationFailure.ROWS)
    assert str(spoiled_frame(7, "why")).endswith("frame 7: why")


@pytest.mark.parametrize("request_type", [MessageType.CALIBRATE, MessageType.RECORD, MessageType.ADOPT,
                                          MessageType.CALIBRATION, MessageType.RECALL, MessageType.FORGET])
def test_refusals_of_calibrations_speak_of_calibrations(request_type):
    def text(code, detail):
        return str(refusal(Message(MessageType.ERROR, payload=payloads.pack_error(code, request_type, detail))))
    assert "built without rectification" in text(ErrorCode.TYPE, request_type)
    assert "a calibration is checking" in text(ErrorCode.STATE, payloads.CalibrationState.CHECKING)
    assert "no flash for a calibration" in text(ErrorCode.FLASH, 0)
    assert "has no calibration" in text(ErrorCode.CALIBRATION, 0)
    assert "images of 640x480 pixels" in text(ErrorCode.CALIBRATION, 640 << 16 | 480)
    if request_type == MessageType.CALIBRATE:
        assert "the calibration is too long" in text(ErrorCode.SIZE, 6)


@pytest.mark.parametrize(("heading", "states", "failures"), [
    ("Progress", payloads.UpdateState, payloads.UpdateFailure),
    ("Calibration state", payloads.CalibrationState, payloads.CalibrationFailure)])
def test_documented_states(heading, states, failures):
    fields = {row[2].split(",")[0].split(" ")[0].rstrip(":"): row[2] for row in table(heading)}
    for name, numbers in (("state", states), ("failure", failures)):
        documented = {word.upper(): int(number) for number, word in re.findall(r"(\d) (\w+)", fields[name])}
        assert documented == {member.name: member.value for member in numbers}


def test_a_refusal_of_unknown_code_still_says_something():
    assert "error 99" in str(refusal(Message(MessageType.ERROR, payload=payloads.pack_error(99, 0x77, 5))))


def test_frame_is_delimited_on_both_sides():
    plain = Message(MessageType.BYE).encode()
    assert encode_frame(plain)[0] == encode_frame(plain)[-1] == 0
    assert 0 not in encode_frame(plain)[1:-1]
