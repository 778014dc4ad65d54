#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What `add_cameras` adds to a SoC, and what it refuses."""

from __future__ import annotations

import re
from types import SimpleNamespace

import pytest
from litex.build.generic_platform import Pins
from litex.build.sim import SimPlatform
from litex.gen import LiteXModule
from litex.soc.integration.soc_core import SoCCore
from litex.soc.interconnect import wishbone
from migen import ClockDomain, Signal
from migen.fhdl.tools import list_targets

from litestereo.gateware.cameras.parameters import CameraParameters
from litestereo.gateware.common.parameters import FEATURES, MatcherParameters
from litestereo.sim.socs.ethernet_model import EthernetPHYModel
from litestereo.soc.parts.add_cameras import CamerasMixin
from litestereo.soc.parts.add_frame_link import FrameLinkMixin
from litestereo.soc.parts.add_stereo import StereoMixin

CLOCK_HZ = int(60e6)
MATCHER  = MatcherParameters(max_width=48, disparities=16, max_block_size=5, features=(*FEATURES, "cameras"))
CAMERAS  = CameraParameters(max_width=48, max_height=32, skew_pixels=64)
PLAIN    = MatcherParameters(max_width=48, disparities=16, max_block_size=5)
PIXEL_HZ = 25e6


class SoC(CamerasMixin, StereoMixin, FrameLinkMixin, SoCCore):
    """A SoC without a CPU, with a port of the Ethernet model."""
    def __init__(self) -> None:
        platform = SimPlatform("SIM", [("sys_clk", 0, Pins(1)), ("eth_clk", 0, Pins(1))])
        self.cd_sys = ClockDomain()
        SoCCore.__init__(self, platform, clk_freq=CLOCK_HZ, cpu_type=None, with_uart=False, with_timer=False, ident="",
                         integrated_sram_size=4096)
        self.comb += self.cd_sys.clk.eq(platform.request("sys_clk"))
        self.bus.add_master("test", wishbone.Interface(data_width=32, addressing="word"))

    def add_wire(self) -> None:
        """Add a frame link that streams."""
        pads = LiteXModule()
        for side in ("source", "sink"):
            for name, bits in [("valid", 1), ("ready", 1), ("data", 8)]:
                setattr(pads, f"{side}_{name}", Signal(bits))
        self.ethphy = EthernetPHYModel(self.platform.request("eth_clk"), pads)
        self.add_frame_link(self.ethphy)


def pads(*without: str, data: int = 8, **more: int) -> SimpleNamespace:
    """Return the pads of a sensor."""
    bits = {"data": data, "href": 1, "vsync": 1, "pclk": 1} | more
    return SimpleNamespace(**{name: Signal(width, name=f"pad_{name}") for name, width in bits.items()
                              if name not in without})


def lines(*without: str) -> SimpleNamespace:
    """Return the pads of I2C."""
    return SimpleNamespace(**{name: Signal(name=f"pad_{name}") for name in ("scl", "left_sda", "right_sda")
                              if name not in without})


def soc_with(matcher: MatcherParameters | None = MATCHER) -> SoC:
    """Return a SoC with a matcher."""
    soc = SoC()
    if matcher:
        soc.add_stereo(matcher)
    return soc


def test_patterns():
    """Without sensors there are registers, and both test patterns have one clock."""
    soc = soc_with()
    soc.add_cameras(CAMERAS)
    soc.finalize()
    names = {csr.name for csr in soc.csr.regions["cameras"].obj}
    assert {"control", "left_stamp", "right_bin", "ev_pending"} <= names
    targets = list_targets(soc.get_fragment().comb)
    assert {camera.pixel_clk for camera in soc.cameras.cameras} <= targets
    assert soc.stereo.pairs.valid in targets and soc.cameras.open in targets


def test_sensors():
    """Pads get their signals, as far as there are such pads; the matcher's largest width is the default."""
    soc   = soc_with()
    left  = pads(reset_n=1, sleep=1)
    right = pads(trigger=1)
    # As a board's toolchain; that of the simulation has no constraints.
    periods = {}
    soc.platform.toolchain.add_period_constraint = lambda platform, pad, period, *_, **__: periods.update({pad: period})
    soc.add_cameras(sensors=(left, right), i2c=lines(), pixel_clk_freq=PIXEL_HZ)
    assert soc.cameras.parameters.max_width == 48
    assert periods == {left.pclk: 40.0, right.pclk: 40.0}
    soc.finalize()
    targets = list_targets(soc.get_fragment().comb)
    assert {left.reset_n, left.sleep, right.trigger} <= targets


def test_the_frame_link_goes_through_the_cameras():
    """Its pairs reach the matcher by way of the cameras, which choose."""
    soc = soc_with()
    soc.add_cameras(CAMERAS)
    soc.add_wire()
    targets = list_targets(soc.get_fragment().comb)
    assert soc.cameras.others.valid in targets and soc.frame_link.pairs.ready in targets


@pytest.mark.parametrize("matcher, options, message", [
    (None,    {},                                               "cameras need a matcher: there is no stereo; call"),
    (MATCHER, {"stereo": "other"},                              "there is no other"),
    (PLAIN,   {},                                               "a matcher with the feature cameras"),
    (MATCHER, {"name": "two words"},                            "C identifier"),
    (MATCHER, {"parameters": CameraParameters(max_width=49)},   "at most that of the matcher, 48, not 49"),
    (MATCHER, {"sensors": pads()},                              "the pads of two sensors"),
    (MATCHER, {"sensors": [pads()]},                            "the pads of two sensors"),
    (MATCHER, {"sensors": [pads(), pads("href", "pclk")]},      "the right sensor needs .*: href, pclk is missing"),
    (MATCHER, {"sensors": [pads(data=10), pads()]},             "the left sensor needs 8 pads of data, not 10"),
    (MATCHER, {"sensors": [pads(), pads()]},                    "below that of sys, 60000000, not None"),
    (MATCHER, {"sensors": [pads(), pads()], "pixel_clk_freq": 60e6}, "below that of sys"),
    (MATCHER, {"sensors": [pads(), pads()], "pixel_clk_freq": 0},    "below that of sys"),
    (MATCHER, {"i2c": lines("left_sda")},                       "left_sda is missing"),
])
def test_refusals(matcher, options, message):
    """Wrong arguments are refused with one line that says what is wrong."""
    soc = soc_with(matcher)
    with pytest.raises(ValueError, match=message) as refused:
        soc.add_cameras(**options)
    assert "\n" not in str(refused.value)
    assert not hasattr(soc, "cameras")


def test_twice_and_too_late():
    """Cameras are added once, and before a frame link that streams."""
    soc = soc_with()
    soc.add_cameras(CAMERAS)
    with pytest.raises(ValueError, match="stereo has cameras already"):
        soc.add_cameras(CAMERAS, name="others")
    soc = soc_with()
    soc.add_wire()
    with pytest.raises(ValueError, match=re.escape("add the cameras before the frame link")):
        soc.add_cameras(CAMERAS)
