#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Measures the throughput of frames over Ethernet in the full system, in clocks of the wire.

Host and device share the device's time, so the figures depend on its clocks alone; see `PacedChannel`.
"""

from __future__ import annotations

import contextlib
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...host_tools.core.errors import LiteStereoError
from ...host_tools.core.settings import MatcherSettings
from ...host_tools.devices.udp.udp_device import UdpDevice
from ...host_tools.protocol.messages import CHUNK_BYTES, REPLY, MessageType
from ...soc.boards import soc_class
from ...soc.boards.board_soc import BoardSoC
from ..models.pattern import LEFT_SEED, RIGHT_SEED, pattern
from ..models.stereo_bm import stereo_bm
from ..system.capture import Captured, read_capture
from ..system.simulation import SYS_CLK_HZ, start_simulation
from .memory import Shares, read_shares
from .paced_channel import PacedChannel, time_of

WIDTH, HEIGHT = 640, 480
SETTINGS      = MatcherSettings(disparities=64, block_size=9)

#: Frames that are sent; the clocks of the first one and of the last two do not count.
FRAMES = 8

#: Clocks of the wire for a full chunk: message, UDP, IP and Ethernet headers, and preamble, FCS and gap.
CHUNK_CLOCKS = CHUNK_BYTES + 28 + 8 + 20 + 14 + 24

#: Messages that carry images.
CHUNKS = (MessageType.UPLOAD, MessageType.PAIRS)

#: Seconds until a datagram of the device has reached the program on the host: card, interrupt, system.
HOST_LATENCY_S = 20e-6

#: Longest wait for the firmware to start, in seconds of this computer, which may be busy.
START_LIMIT_S = 3600.0

#: Clock of gigabit Ethernet, a byte per clock, and that of the Colorlight i5's SoC and SDRAM.
WIRE_HZ, BOARD_HZ = 125_000_000, 60_000_000


@dataclass(frozen=True)
class EthernetCase:
    """Memory of the SoC or a board, its clock, how frames are sent (stored or streamed), and the clock of the wire."""
    name:       str
    ram:        str
    sys_hz:     int
    mode:       str
    wire_hz:    int             = WIRE_HZ
    matcher_hz: int             = 0 #: clock of the matcher, if it is not the SoC's
    settings:   MatcherSettings = SETTINGS
    width:      int             = WIDTH
    height:     int             = HEIGHT

    def simulated_hz(self, clock_hz: int) -> int:
        """Return a clock of the case in the simulation, where that of the SoC is `SYS_CLK_HZ`."""
        # Rounded down, so that the period in ps, rounded down too, is as exact as that of the SoC.
        return clock_hz*SYS_CLK_HZ//self.sys_hz


CASES = [
    EthernetCase("integrated-ram",           "integrated-ram", WIRE_HZ,  "stored"),
    EthernetCase("sdram-at-60-mhz",          "sdram",          BOARD_HZ, "stored"),
    EthernetCase("sdram-at-60-mhz-streamed", "sdram",          BOARD_HZ, "streamed"),
]

#: Clock of the wire at 100 Mbit/s, in bytes: that of boards without gigabit Ethernet.
SLOW_WIRE_HZ, SLOW_BOARDS = 12_500_000, ("arty",)


def board_cases(board: str) -> list[EthernetCase]:
    """Return the cases of a board's SoC at its own clocks: stored frames, and streamed ones if it takes them.

    Raises
    ------
    LiteStereoError
        The board has no Ethernet.
    """
    base   = soc_class(board)
    preset = base.preset
    if base.make_ethernet_phy is BoardSoC.make_ethernet_phy:
        raise LiteStereoError(f"the {board} has no Ethernet: choose another board")
    settings = MatcherSettings(disparities=min(SETTINGS.disparities, preset.disparities),
                               block_size=min(SETTINGS.block_size, preset.max_block_size))
    wire_hz  = SLOW_WIRE_HZ if board in SLOW_BOARDS else WIRE_HZ
    modes    = {board: "stored"} | ({f"{board}-streamed": "streamed"} if preset.streaming else {})
    return [EthernetCase(name, board, preset.sys_clk_freq, mode, wire_hz, preset.matcher_hz, settings)
            for name, mode in modes.items()]


@dataclass(frozen=True)
class Flow:
    """What the wire carried per clock in the steady state, in both directions at the same time."""
    upload_bytes_per_clock:   float
    download_bytes_per_clock: float
    clocks_per_frame:         float
    repeated:                 int    #: chunks that were sent more than once
    shares:                   Shares #: of the memory's time


def measure_flow(case: EthernetCase) -> Flow:
    """Stream `FRAMES` frames through a simulated device, check each map, and count what the wire carried.

    Raises
    ------
    LiteStereoError
        The device refused or failed, or a map is wrong.
    """
    # Successive frames differ, so that a wrong frame is noticed.
    size          = case.width, case.height
    pairs         = [(pattern(*size, LEFT_SEED + 2*n), pattern(*size, RIGHT_SEED + 2*n)) for n in range(2)]
    expected      = [stereo_bm(left, right, case.settings) for left, right in pairs]
    byte_clock_hz = case.simulated_hz(case.wire_hz)
    with tempfile.TemporaryDirectory() as folder:
        capture, counts = Path(folder) / "wire.pcap", Path(folder) / "memory.bin"
        with (start_simulation(case.ram, byte_clock_hz=byte_clock_hz, capture=capture, memory_counts=counts,
                               timeout_s=START_LIMIT_S,
                               matcher_clock_hz=case.simulated_hz(case.matcher_hz),
                               paced_latency=round(HOST_LATENCY_S*case.wire_hz)) as simulation,
              contextlib.closing(PacedChannel(simulation.paced, case.wire_hz)) as channel, time_of(channel),
              UdpDevice("sim:", channel, streamed=case.mode == "streamed") as device):
            results = device.stream((pairs[n % 2] for n in range(FRAMES)), case.settings)
            for number, result in enumerate(results):
                if not np.array_equal(result.disparity, expected[number % 2]):
                    raise LiteStereoError(f"map {number} of {case.name} is wrong")
        captured = list(read_capture(capture))
        begin, end = steady(captured)
        shares = read_shares(counts, case.ram, begin/byte_clock_hz, end/byte_clock_hz)
        return flow(captured, begin, end, shares)


def steady(captured: list[Captured]) -> tuple[int, int]:
    """Return the clocks at which the uploads of two frames end, with whole frames between them."""
    complete = {entry.message.frame_id: entry.clock
                for entry in captured if entry.to_device and entry.message.type in CHUNKS}
    begin, *_, end = sorted(complete.values())[1:-2]
    return begin, end


def flow(captured: list[Captured], begin: int, end: int, shares: Shares) -> Flow:
    """Return the figures of a capture between two clocks of `steady`."""
    uploads  = [entry for entry in captured if entry.to_device and entry.message.type in CHUNKS]
    complete = {entry.message.frame_id: entry.clock for entry in uploads}
    inside  = [entry for entry in captured if begin < entry.clock <= end]
    chunks  = {(entry.message.frame_id, entry.message.offset): len(entry.message.payload)
               for entry in uploads if begin < entry.clock <= end}
    parts   = {(entry.message.frame_id, entry.message.offset): len(entry.message.payload)
               for entry in inside if not entry.to_device and entry.message.type == MessageType.READ | REPLY}
    sent    = sum(entry.message.type in CHUNKS and entry.to_device for entry in inside)
    clocks  = end - begin
    frames  = sum(begin < clock <= end for clock in complete.values())
    return Flow(sum(chunks.values())/clocks, sum(parts.values())/clocks, clocks/frames, sent - len(chunks), shares)


def ethernet_figures(cases: list[EthernetCase]) -> list[dict[str, str | float]]:
    """Measure the cases; return the figures: name, value and unit."""
    rows: list[dict[str, str | float]] = []
    for case in cases:
        result = measure_flow(case)
        name   = f"{case.width}x{case.height}/{case.name}"
        most   = CHUNK_BYTES/CHUNK_CLOCKS
        rows += [
            {"name": f"ethernet_upload_bytes_per_clock/{name}", "value": round(result.upload_bytes_per_clock, 3),
             "unit": "bytes"},
            {"name": f"ethernet_download_bytes_per_clock/{name}", "value": round(result.download_bytes_per_clock, 3),
             "unit": "bytes"},
            {"name": f"ethernet_upload_of_what_the_wire_carries/{name}",
             "value": round(100*result.upload_bytes_per_clock/most, 1), "unit": "%"},
            {"name": f"ethernet_frames_per_second_at_{case.wire_hz/1e6:g}_mhz/{name}",
             "value": round(case.wire_hz/result.clocks_per_frame, 1), "unit": "frames/s"},
            {"name": f"ethernet_chunks_sent_again/{name}", "value": result.repeated, "unit": "chunks"},
        ]
        rows += [{"name": f"memory_time_share/{event}/{name}", "value": round(100*share, 2), "unit": "%"}
                 for event, share in result.shares.items()]
    return rows
