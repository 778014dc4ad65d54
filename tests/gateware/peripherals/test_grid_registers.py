#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Grids of the rectification as software loads them: register by register, over the bus."""

from __future__ import annotations

import pytest
from litex.gen import LiteXModule
from litex.soc.interconnect import csr_bus

from litestereo.gateware.common.parameters import FEATURES
from litestereo.gateware.peripherals.stereo_peripheral import ERROR_CONFIG, StereoPeripheral
from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.sim.cores.pin_core import PinCore
from litestereo.sim.models import rectification as model
from litestereo.sim.models.stereo_bm import stereo_bm
from support.memory import Memory, port_pins, slave
from support.pairs import byte_generator, generator, textured_pair
from support.peripheral_bench import MAX_RECTIFIED, PORTS, ROWS, built, registers
from support.rectification_maps import lens, maps_of

WIDTH, HEIGHT = 33, 17
SETTINGS      = MatcherSettings(16, 5)
BASES         = {"left_base": 0x1000, "right_base": 0x2000, "disparity_base": 0x3000, "left_out_base": 0x5000,
                 "right_out_base": 0x6000}
OPTIONS       = {"xsobel": 0, "subpixel": 1, "median": 2, "streamed": 3, "rectified": 4, "grid": 5, "left_out": 6,
                 "right_out": 7}


class Registered(LiteXModule):
    """The peripheral with a rectification, and its registers on a bus."""
    def __init__(self):
        make            = PORTS["wishbone-32"]
        self.ports      = dict(zip(("read", "write"), make(), strict=True))
        self.ports     |= {name: make()[1] for name in ("left", "right")}
        read, write, *images = self.ports.values()
        self.peripheral = StereoPeripheral(read, write, built((*FEATURES, "rectification")), 64,
                                           image_ports=tuple(images))
        self.bus        = csr_bus.Interface(data_width=32, address_width=14)
        self.bank       = csr_bus.CSRBank(self.peripheral.get_csrs(sort=True), bus=self.bus)


class Bench:
    """The peripheral with memory, driven by its registers alone."""
    def __init__(self):
        self.top    = top = Registered()
        inputs      = {name: getattr(top.bus, name) for name in ("adr", "we", "re", "dat_w")}
        outputs     = {"dat_r": top.bus.dat_r}
        for name, port in top.ports.items():
            more_inputs, more_outputs = port_pins(name, port)
            inputs  |= more_inputs
            outputs |= more_outputs
        self.core   = PinCore(top, inputs, outputs)
        self.memory = Memory(1 << 15, 4, byte_generator(50))
        self.slaves = [slave(self.core, name, port, self.memory) for name, port in top.ports.items()]

    def clock(self):
        for one in self.slaves:
            one.step()
        self.core.clock()

    def address(self, name):
        register = getattr(self.top.peripheral, f"_{name}")
        return self.top.bank.simple_csrs.index(register.simple_csrs[0])

    def write(self, name, value):
        self.core.set(adr=self.address(name), dat_w=value, we=1)
        self.clock()
        self.core.set(we=0)
        self.clock()

    def read(self, name):
        self.core.set(adr=self.address(name), re=1)
        self.clock()
        self.core.set(re=0)
        return self.core.get("dat_r")

    def load(self, number, grids, size=True):
        """Load a grid as a driver does; return whether a node was lost."""
        lost = 0
        for camera, grid in enumerate(grids):
            self.write("place", number << 16 | camera << 17)
            for column, row in grid.reshape(-1, 2).astype(int).tolist():
                self.write("node", (column & 0xffff) | (row & 0xffff) << 16)
            lost |= self.read("rectification") >> 2 & 1
        if size:
            self.write(f"grid{number}_size", WIDTH | HEIGHT << 16)
        return lost

    def begin(self, pair, **options):
        """Start a frame of a pair."""
        for name, image in zip(BASES, pair, strict=False):
            self.memory.bytes[BASES[name]:BASES[name] + image.size] = image.tobytes()
        values  = registers(WIDTH, HEIGHT, SETTINGS)
        options = {name: values.pop(name) for name in ("xsobel", "subpixel", "median")} | options
        for name, value in (BASES | values).items():
            self.write(name, value)
        self.write("options", sum(value << OPTIONS[name] for name, value in options.items()))
        self.write("control", 1)

    def end(self):
        """Wait for the end of the frame; return its error."""
        for _ in range(20000):
            status = self.read("status")
            if not status & 1:
                return status >> 8
        raise AssertionError("no end")

    def at(self, name, expected):
        """Assert what is in memory."""
        base = BASES[name]
        assert bytes(self.memory.bytes[base:base + expected.nbytes]) == expected.tobytes(), name


@pytest.fixture(scope="module")
def bench():
    bench = Bench()
    yield bench
    bench.core.close()


def drawn(salt):
    """Draw the grids of both cameras, and a pair; return them and the rectified pair."""
    rng   = generator(51, salt)
    grids = (lens(WIDTH, HEIGHT, rng), lens(WIDTH, HEIGHT, rng))
    pair  = textured_pair(WIDTH, HEIGHT, rng, 5)
    return grids, pair, [model.remap(*one) for one in zip(pair, maps_of(grids, WIDTH, HEIGHT), strict=True)]


def test_what_is_built(bench):
    """Software reads what was built."""
    assert bench.read("rows") == ROWS | MAX_RECTIFIED << 16
    assert bench.read("features") >> 10 == 1


@pytest.mark.parametrize("number", [0, 1])
def test_a_grid(bench, number):
    """A grid that was loaded is that of the frames which ask for it; both images come out."""
    grids, pair, rectified = drawn(number)
    assert bench.load(number, grids) == 0
    bench.begin(pair, rectified=1, grid=number, left_out=1, right_out=1)
    assert bench.end() == 0
    bench.at("disparity_base", stereo_bm(*rectified, SETTINGS))
    bench.at("left_out_base", rectified[0])
    bench.at("right_out_base", rectified[1])
    assert bench.read("rectification") == 0


def test_a_grid_that_is_not_whole(bench):
    """A grid has no size from its first new node on: a frame is refused until software writes the size again."""
    grids, pair, rectified = drawn(2)
    for number in (0, 1):
        assert bench.load(number, grids) == 0
    bench.write("place", 1 << 16)
    assert bench.read("grid0_size") == bench.read("grid1_size") == WIDTH | HEIGHT << 16
    bench.write("node", 0)
    assert bench.read("grid0_size") == WIDTH | HEIGHT << 16 and bench.read("grid1_size") == 0
    bench.begin(pair, rectified=1, grid=1)
    assert bench.end() == ERROR_CONFIG
    bench.begin(pair, rectified=1, grid=0)
    assert bench.end() == 0
    bench.at("disparity_base", stereo_bm(*rectified, SETTINGS))


def test_lost_nodes(bench):
    """A node beyond the last one, and one for the grid of the frame under way, are told until the next place."""
    grids, pair, rectified = drawn(3)
    assert bench.load(0, grids) == 0
    bench.write("place", bench.top.peripheral.rectification.rectifier.parameters.nodes - 1)
    bench.write("node", 0)
    assert bench.read("rectification") >> 2 == 0
    bench.write("node", 0)
    assert bench.read("rectification") >> 2 == 1
    assert bench.load(0, grids) == 0
    bench.begin(pair, rectified=1)
    assert bench.load(0, drawn(4)[0], size=False) == 1
    assert bench.end() == 0
    bench.at("disparity_base", stereo_bm(*rectified, SETTINGS))
    bench.begin(pair, rectified=1)
    assert bench.end() == ERROR_CONFIG
