#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""A device on a network, written in Python after docs/protocol.md, for tests that observe, set or break its state."""

from __future__ import annotations

import contextlib
import itertools
import selectors
import threading
import time
from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from litestereo.host_tools.core.errors import ProtocolError
from litestereo.host_tools.core.settings import MatcherSettings, Parameter
from litestereo.host_tools.protocol import payloads
from litestereo.host_tools.protocol.messages import CHUNK_BYTES, REPLY, ErrorCode, Message, MessageType
from litestereo.host_tools.protocol.payloads import FrameState

from .protocol_vectors import CAPABILITIES
from .udp_faults import HOLD_S, Faults
from .udp_proxy import udp_socket

Peer = tuple[str, int]

#: Most READs that are queued, and most of their replies that are sent between two polls for datagrams.
_READS   = 8
_AT_ONCE = 16

#: Length of a request's payload, where it is fixed.
_LENGTHS = {MessageType.HELLO: 4, MessageType.OPEN: 4, MessageType.READ: 4} | dict.fromkeys(
    (MessageType.START, MessageType.STATUS, MessageType.RELEASE, MessageType.STATISTICS, MessageType.BYE,
     MessageType.MISSING), 0)


def made_up_map(left: NDArray[np.uint8], right: NDArray[np.uint8], settings: MatcherSettings) -> NDArray[np.int16]:
    """Return the map that this device sends: it depends on each byte of the images and on each parameter."""
    return _made_up(left, right, settings.parameters)


def _made_up(left: NDArray[np.uint8], right: NDArray[np.uint8], parameters: Mapping[int, int]) -> NDArray[np.int16]:
    salt = sum(number*value for number, value in parameters.items())
    return (257*left.astype(np.int32) + 3*right[:, ::-1] + salt).astype(np.int16)


class Refusal(Exception):
    """An ERROR reply: code and detail."""


@dataclass
class _Frame:
    width:      int
    height:     int
    parameters: dict[int, int]
    slot:       int
    state:      int   = FrameState.LOADING
    done_at:    float = 0.0
    images:     bytearray = field(init=False)
    missing:    NDArray[np.bool_] = field(init=False)
    map:        bytes = b""

    def __post_init__(self) -> None:
        self.images  = bytearray(2*self.pitch)
        self.missing = np.ones(2*self.pitch // CHUNK_BYTES, bool)

    @property
    def pitch(self) -> int:
        return payloads.frame_pitch(self.width, self.height)

    def match(self) -> None:
        size     = self.width*self.height
        sides    = [np.frombuffer(self.images, np.uint8, size, base).reshape(self.height, self.width)
                    for base in (0, self.pitch)]
        self.map = _made_up(*sides, self.parameters).astype("<i2").tobytes()


class UdpDevice(threading.Thread):
    """The device; `counters` are those of its protocol, `requests` all that were received, in order.

    Requests of the types in `ignored` are recorded, and have no other effect.

    Parameters
    ----------
    silence_s
        Seconds of silence after which another host may take the session over.
    match_s
        Seconds that a match takes.
    datagram_s
        Seconds that each datagram takes, as in a slow simulation.
    """

    def __init__(self, to_device: Faults, to_host: Faults, slots: int, silence_s: float, match_s: float,
                 datagram_s: float) -> None:
        super().__init__(daemon=True)
        self.to_device  = to_device
        self.to_host    = to_host
        self.counters   = dict.fromkeys(payloads.COUNTERS, 0)
        self.requests:  list[Message] = []
        self.ignored:   set[int]  = set()
        self._slots     = slots
        self.more: dict[int, int] = {}  # Further capabilities; older firmware has none.
        self.features = 0xff           # Stages that it was built with.
        self._silence_s = silence_s
        self._match_s   = match_s
        self.datagram_s = datagram_s
        self._tokens    = itertools.count(0x1000)
        self._socket    = udp_socket()
        self._ended     = threading.Event()
        self._restart   = threading.Event()
        self.port       = self._socket.getsockname()[1]
        self.url        = f"udp://127.0.0.1:{self.port}"
        self._forget()

    def _forget(self) -> None:
        self._peer:   Peer | None = None
        self._token   = 0
        self._nonce   = -1
        self._alive   = False
        self._heard_at = 0.0
        self._frames: dict[int, _Frame] = {}
        self._parameters: dict[int, int] = {}
        self._reads:  deque[tuple[Peer, Message, int, int]] = deque()

    def run(self) -> None:
        """Serve until `stop` is called."""
        with selectors.DefaultSelector() as selector:
            selector.register(self._socket, selectors.EVENT_READ)
            while not self._ended.is_set():
                if self._restart.is_set():
                    self._forget()
                    self._restart.clear()
                selector.select(0 if self._reads else HOLD_S/4)
                self._poll_datagrams()
                for peer, datagram in self.to_device.overdue():
                    self._receive(peer, datagram)
                for _ in range(_AT_ONCE):
                    self._go_on_reading()
                self._put_out(self.to_host.overdue())
        self._socket.close()

    def reset(self) -> None:
        """Forget everything but the counters, as after a loss of power."""
        self._restart.set()
        while self._restart.is_set():
            time.sleep(0.001)

    def stop(self) -> None:
        """Stop the device, and wait until it has stopped."""
        self._ended.set()
        self.join(5)

    def _delay(self) -> None:
        if self.datagram_s > 0:
            time.sleep(self.datagram_s)

    def _poll_datagrams(self) -> None:
        with contextlib.suppress(BlockingIOError, ConnectionError):
            for _ in range(64):
                datagram, peer = self._socket.recvfrom(4096)
                for sender, one in self.to_device.carry(peer, datagram):
                    self._receive(sender, one)

    def _send(self, peer: Peer, message: Message) -> None:
        self._put_out(self.to_host.carry(peer, message.encode()))

    def _put_out(self, datagrams: list[tuple[Peer, bytes]]) -> None:
        for peer, datagram in datagrams:
            self.counters["datagrams_sent"] += 1
            self._delay()
            with contextlib.suppress(BlockingIOError, ConnectionError):
                self._socket.sendto(datagram, peer)

    def _receive(self, peer: Peer, datagram: bytes) -> None:
        self.counters["datagrams_received"] += 1
        self._delay()
        try:
            request = Message.decode(datagram)
        except ProtocolError:
            self.counters["datagrams_malformed"] += 1
            return
        if request.type & REPLY:
            return
        self.requests.append(request)
        if request.type in self.ignored:
            return
        if request.type == MessageType.UPLOAD:
            self._upload(peer, request)
            return
        self.counters["messages_received"] += 1
        try:
            self._admit(peer, request)
            answer = getattr(self, f"_{MessageType(request.type).name.lower()}")(peer, request)
        except Refusal as refused:
            code, detail = refused.args
            self.counters["requests_refused"] += 1
            payload = payloads.pack_error(code, request.type, detail)
            self._send(peer, replace(request, type=MessageType.ERROR, payload=payload))
            return
        if answer is not None:
            self._send(peer, request.reply(answer))

    def _admit(self, peer: Peer, request: Message) -> None:
        remaining_s = self._heard_at + self._silence_s - time.monotonic()
        if self._alive and peer != self._peer and remaining_s > 0:
            self.counters["sessions_refused"] += 1
            raise Refusal(ErrorCode.BUSY, int(1000*remaining_s))
        if request.type not in set(MessageType):
            raise Refusal(ErrorCode.TYPE, request.type)
        own = self._alive and (peer, request.session) == (self._peer, self._token)
        if request.type != MessageType.HELLO and not own:
            raise Refusal(ErrorCode.SESSION, 0)
        length = _LENGTHS.get(MessageType(request.type), len(request.payload))
        if len(request.payload) != length:
            raise Refusal(ErrorCode.LENGTH, length)
        if peer == self._peer:
            self._heard_at = time.monotonic()

    def _hello(self, peer: Peer, request: Message) -> bytes:
        nonce = payloads.unpack_number(request.payload)
        if (peer, nonce) != (self._peer, self._nonce):
            self.counters["frames_reclaimed"] += len(self._frames)
            self.counters["sessions"]         += 1
            self._forget()
            self._peer, self._nonce, self._token = peer, nonce, next(self._tokens)
            self._alive = True
            self._parameters = {int(number): value for number, value in MatcherSettings().parameters.items()}
            self._heard_at   = time.monotonic()
        return replace(CAPABILITIES, session=self._token, nonce=nonce, slots=self._slots, features=self.features,
                       max_disparities=128, max_pixels=512*CHUNK_BYTES, more=self.more).pack()

    def _bye(self, _: Peer, __: Message) -> bytes:
        self.counters["frames_released"] += len(self._frames)
        self._frames.clear()
        self._reads.clear()
        self._alive = False
        return b""

    def _configure(self, _: Peer, request: Message) -> bytes:
        for at in range(0, len(request.payload), 8):
            number, value = (int.from_bytes(request.payload[at + low:at + high], "little", signed=low > 0)
                             for low, high in ((0, 2), (4, 8)))
            if number not in set(Parameter):
                raise Refusal(ErrorCode.PARAMETER, number)
            self._parameters[number] = value
        return b""

    def _open_slot(self, request: Message) -> _Frame:
        width, height = (int.from_bytes(request.payload[at:at + 2], "little") for at in (0, 2))
        frame         = self._frames.get(request.frame_id)
        if frame is not None:
            if frame.state != FrameState.LOADING or (frame.width, frame.height) != (width, height):
                raise Refusal(ErrorCode.DUPLICATE, request.frame_id)
            return frame
        free = set(range(self._slots)) - {other.slot for other in self._frames.values()}
        if not free:
            raise Refusal(ErrorCode.NO_SLOT, self._slots)
        self.counters["frames_opened"] += 1
        self._frames[request.frame_id]  = _Frame(width, height, dict(self._parameters), min(free))
        return self._frames[request.frame_id]

    def _open(self, _: Peer, request: Message) -> bytes:
        frame = self._open_slot(request)
        return payloads.pack_opened(frame.slot, frame.pitch)

    def _frame(self, request: Message) -> _Frame:
        if request.frame_id not in self._frames:
            raise Refusal(ErrorCode.FRAME, request.frame_id)
        frame = self._frames[request.frame_id]
        if frame.state == FrameState.MATCHING and time.monotonic() >= frame.done_at:
            frame.match()
            frame.state = FrameState.DONE
            self.counters["frames_matched"] += 1
        return frame

    def _upload(self, peer: Peer, request: Message) -> None:
        if not self._alive or (peer, request.session) != (self._peer, self._token):
            self.counters["uploads_foreign"] += 1
            return
        frame        = self._frames.get(request.frame_id)
        chunk, rest  = divmod(request.offset, CHUNK_BYTES)
        if frame is None or frame.state != FrameState.LOADING or rest or chunk >= len(frame.missing):
            self.counters["uploads_unfit"] += 1
            return
        remaining = frame.width*frame.height - request.offset % frame.pitch
        if len(request.payload) != min(CHUNK_BYTES, remaining):
            self.counters["uploads_unfit"] += 1
            return
        self._heard_at = time.monotonic()
        self.counters["chunks_received" if frame.missing[chunk] else "chunks_repeated"] += 1
        if frame.missing[chunk]:
            frame.images[request.offset:request.offset + len(request.payload)] = request.payload
            frame.missing[chunk] = False

    def _missing(self, _: Peer, request: Message) -> bytes:
        return np.packbits(self._frame(request).missing, bitorder="little").tobytes()

    def _start(self, _: Peer, request: Message) -> bytes:
        frame = self._frame(request)
        if frame.missing.any():
            raise Refusal(ErrorCode.INCOMPLETE, int(np.argmax(frame.missing))*CHUNK_BYTES)
        if frame.state == FrameState.LOADING:
            busy_until    = max((other.done_at for other in self._frames.values()), default=0.0)
            frame.state   = FrameState.MATCHING
            frame.done_at = max(busy_until, time.monotonic()) + self._match_s
        return b""

    def _status(self, _: Peer, request: Message) -> bytes:
        if request.frame_id not in self._frames:
            return payloads.FrameStatus(FrameState.EMPTY, 0, 0, 0, 0, 0xffffffff).pack()
        frame  = self._frame(request)
        first  = int(np.argmax(frame.missing))*CHUNK_BYTES if frame.missing.any() else 0xffffffff
        pixels = frame.width*frame.height
        return payloads.FrameStatus(frame.state, frame.slot, 0, pixels, pixels // 2, first).pack()

    def _read(self, peer: Peer, request: Message) -> None:
        frame  = self._frame(request)
        length = payloads.unpack_number(request.payload)
        if frame.state != FrameState.DONE:
            raise Refusal(ErrorCode.STATE, frame.state)
        if length == 0:
            raise Refusal(ErrorCode.LENGTH, CHUNK_BYTES)
        if request.offset % CHUNK_BYTES or request.offset + length > len(frame.map):
            raise Refusal(ErrorCode.OFFSET, request.offset)
        if len(self._reads) >= _READS:
            raise Refusal(ErrorCode.BUSY, _READS)
        self._reads.append((peer, request, request.offset, request.offset + length))

    def _go_on_reading(self) -> None:
        if not self._reads:
            return
        peer, request, offset, end = self._reads.popleft()
        upto = min(offset + CHUNK_BYTES, end)
        part = self._frames[request.frame_id].map[offset:upto]
        if upto < end:
            self._reads.appendleft((peer, request, upto, end))
        self._send(peer, replace(request.reply(part), offset=offset))

    def _release(self, _: Peer, request: Message) -> bytes:
        if self._frames.pop(request.frame_id, None) is not None:
            self.counters["frames_released"] += 1
            self._reads = deque(read for read in self._reads if read[1].frame_id != request.frame_id)
        return b""

    def _statistics(self, _: Peer, __: Message) -> bytes:
        return payloads.pack_counters(self.counters)


@contextlib.contextmanager
def udp_device(to_device: Faults | None = None, to_host: Faults | None = None, *, slots: int = 4,
               silence_s: float = 5.0, match_s: float = 0.0, datagram_s: float = 0.0) -> Iterator[UdpDevice]:
    """Run the device on a network with these faults; by default the network has none."""
    device = UdpDevice(to_device or Faults(), to_host or Faults(), slots, silence_s, match_s, datagram_s)
    device.start()
    try:
        yield device
    finally:
        device.stop()
