#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The boards' frame buffer, from memory to the pins of the simulated PHY: a small screen shows a drawn map, pixel by
pixel, from a memory that is as slow as a busy one."""

import numpy as np
import pytest
from litedram.common import LiteDRAMNativePort
from litex.gen import LiteXModule
from litex.soc.cores.video import VideoFrameBuffer, VideoTimingGenerator
from migen import ClockDomainsRenamer, Record

from litestereo.sim.cores.pin_core import PinCore
from litestereo.sim.socs.video_model import VideoPHYModel
from litestereo.soc.boards.board_soc import PIXEL_DOMAIN, SCREEN_FIFO_BYTES
from litestereo.soc.parts.screen_arbiter import ScreenArbiter
from support.firmware_build import build_tests
from support.pairs import generator
from support.screen import PADS, drawn_picture, expected_picture

WIDTH, HEIGHT = 64, 12
TIMINGS = {"pix_clk": 25e6, "h_active": WIDTH, "h_blanking": 20, "h_sync_offset": 4, "h_sync_width": 8,
           "v_active": HEIGHT, "v_blanking": 5, "v_sync_offset": 1, "v_sync_width": 2}
CLOCKS_PER_PIXEL = 3
PICTURE_CLOCKS   = (WIDTH + 20)*(HEIGHT + 5)


@pytest.fixture(scope="module")
def programs():
    """Return the folder of the firmware's test programs, compiled for this computer."""
    return build_tests()


class Chain(LiteXModule):
    """The parts of BoardSoC.add_screen at a port of the memory, next to another master that always wants to read; the
    registers are Signals here."""
    def __init__(self):
        port  = LiteDRAMNativePort("read", address_width=20, data_width=16)
        other = LiteDRAMNativePort("read", address_width=20, data_width=16)
        self.pads = Record(PADS)
        self.phy  = VideoPHYModel(self.pads, PIXEL_DOMAIN, CLOCKS_PER_PIXEL)
        self.vtg  = ClockDomainsRenamer(PIXEL_DOMAIN)(VideoTimingGenerator(TIMINGS))
        self.vfb  = VideoFrameBuffer(port, WIDTH, HEIGHT, fifo_depth=SCREEN_FIFO_BYTES, clock_domain=PIXEL_DOMAIN,
                                     format="mono8")
        self.arbiter = ScreenArbiter(self.vfb.dma, SCREEN_FIFO_BYTES//2)
        self.port    = self.arbiter.add_gate(port, is_screen=True)
        self.other   = self.arbiter.add_gate(other, is_screen=False)
        self.comb += [
            self.vtg.source.connect(self.vfb.vtg_sink),
            self.vfb.source.connect(self.phy.sink),
            other.cmd.valid.eq(1),
        ]


class Screen:
    """The chain in Verilator, with a memory in Python that serves the other master first, and a monitor at its pins.

    Parameters
    ----------
    pictures
        Pictures in memory by their addresses in bytes, uint8.
    away
        Clocks without any access after each `burst` of words, as when a memory refreshes itself or writes.
    """
    def __init__(self, pictures, away, burst=64):
        chain     = Chain()
        port, dma = chain.port, chain.vfb.dma
        registers = {"base": dma._base.storage, "enable": dma._enable.storage}
        self.core = PinCore(chain,
            {"cmd_ready": port.cmd.ready, "rdata_valid": port.rdata.valid, "rdata": port.rdata.data, **registers},
            {"other": chain.other.cmd.valid, "cmd_valid": port.cmd.valid, "addr": port.cmd.addr, "we": port.cmd.we,
             **{name: getattr(chain.pads, name) for name, _ in PADS}})
        self.words    = {base//2 + index: int(word) for base, picture in pictures.items()
                         for index, word in enumerate(picture.reshape(-1).view("<u2"))}
        self.away, self.burst = away, burst
        self.served, self.others, self.until, self.time = 0, 0, 0, 0
        self.coming   = []
        self.was_clk  = 0
        self.core.set(base=0, enable=0, cmd_ready=0, rdata_valid=0)

    def clock(self):
        """Run a clock of the system; return what a monitor receives, if it is a pixel clock too."""
        core = self.core
        data = self.coming.pop(0)[1] if self.coming and self.coming[0][0] <= self.time else None
        core.set(rdata_valid=data is not None, rdata=data or 0)
        ready = self.time >= self.until and not core.get("other")
        core.set(cmd_ready=ready)
        self.others += core.get("other")
        if ready and core.get("cmd_valid"):
            assert not core.get("we")
            self.coming.append((self.time + 6, self.words[core.get("addr")]))
            self.served += 1
            if self.served % self.burst == 0:
                self.until = self.time + self.away
        core.clock()
        self.time += 1
        clk, self.was_clk, before = core.get("clk"), core.get("clk"), self.was_clk
        return {name: core.get(name) for name, _ in PADS} if clk and not before else None

    def picture(self, limit=3*PICTURE_CLOCKS):
        """Return the next whole picture, a list for each row, and its clocks between two vertical syncs."""
        syncs, was_vsync, was_de, rows, clocks = 0, 1, 0, [], 0
        for _ in range(CLOCKS_PER_PIXEL*limit):
            pins = self.clock()
            if pins is None:
                continue
            if pins["vsync"] and not was_vsync:
                syncs += 1
                if syncs == 2:
                    return rows, clocks
            clocks += syncs
            if syncs and pins["de"]:
                assert pins["r"] == pins["g"] == pins["b"]
                if not was_de:
                    rows.append([])
                rows[-1].append(pins["r"])
            was_vsync, was_de = pins["vsync"], pins["de"]
        raise AssertionError("no picture")


@pytest.mark.parametrize("away", [0, 100])
def test_shows_the_map(programs, away):
    """Every picture but the first shows each pixel of the map, and the other map once its address is set."""
    rng      = generator(91)
    maps     = [(rng.integers(-1, 128, (9, 50))*16).astype(np.int16) for _ in range(2)]
    size     = (WIDTH, HEIGHT)
    pictures = {0x1000*(index + 1): drawn_picture(programs, one, 128, size=size) for index, one in enumerate(maps)}
    screen   = Screen(pictures, away)
    screen.core.set(base=0x1000, enable=1)
    screen.picture()
    for base, one in ((0x1000, maps[0]), (0x2000, maps[1])):
        screen.core.set(base=base)
        screen.picture()
        for _ in range(2):
            begin = screen.time
            rows, clocks = screen.picture()
            # The picture itself, and the one whose end was awaited.
            assert screen.time - begin == 2*PICTURE_CLOCKS*CLOCKS_PER_PIXEL
            assert rows == expected_picture(one, 128, size=size).tolist()
            assert clocks == PICTURE_CLOCKS
    # A word of two pixels takes six clocks, of which it uses one; the other master gets two thirds even with pauses.
    assert screen.others > screen.time*2//3


def test_a_memory_that_is_too_slow(programs):
    """The test above would notice: with a memory too slow, no picture is shown in time."""
    screen = Screen({0x1000: drawn_picture(programs, np.full((9, 50), 99, np.int16), 128, size=(WIDTH, HEIGHT))}, 2000)
    screen.core.set(base=0x1000, enable=1)
    rows, clocks = screen.picture(30*PICTURE_CLOCKS)
    assert clocks > PICTURE_CLOCKS
    assert {len(row) for row in rows} > {WIDTH}
