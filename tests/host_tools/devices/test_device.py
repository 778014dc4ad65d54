#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Settings, checks against a device's sizes, and the devices in this process."""

import itertools
import sys
import types
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from litestereo.gateware.common.parameters import MatcherParameters
from litestereo.host_tools.core.errors import DeviceError, ImageError, SettingsError, UnsupportedError, UrlError
from litestereo.host_tools.core.features import ALL_STAGES, Feature
from litestereo.host_tools.core.settings import MatcherSettings, Parameter
from litestereo.host_tools.devices.base import DeviceInfo, choose_settings
from litestereo.host_tools.devices.connect import connect
from litestereo.sim.models.stereo_bm import stereo_bm
from support.expected import expected_map
from support.pairs import generator, textured_pair
from support.scripted_device import scripted_server
from support.udp_device import udp_device


def test_default_settings():
    settings = MatcherSettings()
    assert (settings.disparities, settings.block_size, settings.minimum_size) == (64, 9, (72, 9))
    assert settings.invalid == -16
    assert list(settings.parameters.values()) == [64, 9, 0, 1, 31, 10, 15, -1, 1, 0]
    assert list(settings.parameters) == list(Parameter)


@pytest.mark.parametrize("disparities", [0, -16, 8, 15, 17, 63])
def test_disparities_are_a_multiple_of_16(disparities):
    with pytest.raises(SettingsError, match="multiple of 16"):
        MatcherSettings(disparities=disparities)


@pytest.mark.parametrize("block_size", [-5, 0, 3, 4, 6, 10])
def test_block_size_is_odd_and_at_least_5(block_size):
    with pytest.raises(SettingsError, match="odd"):
        MatcherSettings(block_size=block_size)


@pytest.mark.parametrize(("width", "height", "settings", "error"), [
    (101, 50, MatcherSettings(32, 9), ImageError),
    (100, 8193, MatcherSettings(32, 9), ImageError),
    (39, 50, MatcherSettings(32, 9), ImageError),
    (100, 8, MatcherSettings(32, 9), ImageError),
    (100, 50, MatcherSettings(48, 9), UnsupportedError),
    (100, 50, MatcherSettings(32, 13), UnsupportedError),
    (100, 50, MatcherSettings(32, 11), None),
    (40, 9, MatcherSettings(32, 9), None),
])
def test_what_does_not_suit_the_device_is_refused(width, height, settings, error):
    with connect("model:?max_width=100&disparities=32&max_block_size=11") as device:
        if error is None:
            device.info().check(width, height, settings)
            return
        with pytest.raises(error) as caught:
            device.info().check(width, height, settings)
        assert "\n" not in str(caught.value)
        image = np.zeros((height, width), np.uint8)
        with pytest.raises(error):
            device.compute(image, image, settings)


def test_pixels_in_all_are_limited_too():
    with connect("model:") as device:
        small = replace(device.info(), max_pixels=9999)
    with pytest.raises(ImageError, match="9999"):
        small.check(100, 100, MatcherSettings())


def test_default_settings_of_a_small_device():
    with connect("model:?disparities=32&max_block_size=7") as device:
        assert device.info().default_settings() == MatcherSettings(32, 7)
    with connect("model:") as device:
        assert device.info().default_settings() == MatcherSettings(64, 9)


def test_model_device_is_the_model():
    left, right = textured_pair(90, 40, generator(40))
    steps       = []
    with connect("model:") as device:
        result  = device.compute(left, right, MatcherSettings(32, 7), lambda *step: steps.append(step))
        results = list(device.stream([(left, right), (right, left)], MatcherSettings(16, 5)))
        assert device.statistics() == {"frames_matched": 3}
        with pytest.raises(DeviceError, match="console"):
            device.console("help")
    assert np.array_equal(result.disparity, expected_map(left, right, MatcherSettings(32, 7)))
    assert result.disparity.dtype == np.int16
    assert result.clocks is None and result.first_row_clocks is None and result.match_s > 0
    assert np.array_equal(results[1].disparity, expected_map(right, left, MatcherSettings(16, 5)))
    assert steps == [("match", 0, 1), ("match", 1, 1)]


@pytest.mark.parametrize(("left", "right"), [
    (np.zeros((9, 80), np.uint8), np.zeros((9, 81), np.uint8)),
    (np.zeros((9, 80, 3), np.uint8), np.zeros((9, 80, 3), np.uint8)),
    (np.zeros((9, 80), np.uint16), np.zeros((9, 80), np.uint16)),
])
def test_pairs_must_be_grey_and_of_one_size(left, right):
    with connect("model:") as device, pytest.raises(ImageError):
        device.compute(left, right)


def replace_module(monkeypatch, name, **content):
    module = types.ModuleType(name)
    vars(module).update(content)
    monkeypatch.setitem(sys.modules, name, module)


class FakeCosim:
    """The interface of the gateware's simulation, around the model."""

    built  = None
    closed = False
    trace  = None

    def __init__(self, parameters, trace=None):
        FakeCosim.trace = trace
        FakeCosim.built = (parameters.max_width, parameters.disparities, parameters.max_block_size)

    def match_settings(self, left, right, settings):
        if left.max() == 0:
            raise RuntimeError("it stopped\nshort")
        return stereo_bm(left, right, settings), left.size + 100, 50

    def close(self):
        FakeCosim.closed = True


def test_cosim_device_is_built_as_its_url_says(monkeypatch):
    replace_module(monkeypatch, "litestereo.sim.cores.cosim", CosimMatcher=FakeCosim,
                   MatcherParameters=MatcherParameters)
    left, right = textured_pair(60, 20, generator(41))
    with connect("cosim:?disparities=32&max_width=320&max_block_size=11") as device:
        assert FakeCosim.built == (320, 32, 11)
        result = device.compute(left, right)
        assert (result.clocks, result.first_row_clocks) == (60*20 + 100, 50)
        assert result.settings == MatcherSettings(32, 9)
        with pytest.raises(DeviceError, match=r"failed: it stopped short"):
            device.compute(np.zeros_like(left), right)
    assert FakeCosim.closed
    connect("cosim:").close()
    assert FakeCosim.built == (1024, 64, 21)
    assert FakeCosim.trace is None
    connect("cosim:?trace=waves/a%20b.vcd&disparities=32").close()
    assert FakeCosim.trace == Path("waves/a b.vcd")


def test_a_cosim_that_cannot_be_built_is_one_line(monkeypatch):
    def fail(*_):
        raise RuntimeError("verilator failed:\nsee log")

    replace_module(monkeypatch, "litestereo.sim.cores.cosim", CosimMatcher=fail, MatcherParameters=MatcherParameters)
    with pytest.raises(DeviceError, match="cannot be built: verilator failed: see log"):
        connect("cosim:")


@pytest.mark.parametrize("url", ["model:?width=3", "cosim:?disparities=x", "cosim:?disparities=8",
                                 "model:?max_width=0", "cosim:?ram=sdram", "cosim:?trace=wave.txt",
                                 "cosim:?trace=left.png", "cosim:?trace=fst", "model:?trace=wave.fst"])
def test_wrong_options_are_refused(url):
    with pytest.raises(UrlError):
        connect(url)


@pytest.mark.parametrize("number", range(30))
def test_what_a_device_lacks_of_opencv(number):
    """Drawn at the limits: with what it does not lack, cv2.StereoBM's defaults on VGA pictures are accepted."""
    rng    = generator(42, number)
    width, height = (int(rng.choice([size - 1, size, size + 1])) for size in (640, 480))
    pixels = int(rng.choice([640*480 - 1, 640*480, 10**6]))
    stages = Feature(int(rng.integers(256)) if rng.integers(2) else 0x7d)
    info   = DeviceInfo("model:", "a device", width, height, pixels, int(rng.choice([48, 64, 80])), 5,
                        int(rng.choice([19, 21, 23])), features=int(stages))
    lacks  = info.lacks
    assert lacks.stages == ALL_STAGES & ~stages & ~(Feature.RAW | Feature.MEDIAN)
    settings = MatcherSettings(64, 21, min_disparity=1, disp12_max_diff=1)
    wanted   = [lacks.stages, lacks.disparities, lacks.block_size, lacks.size]
    assert wanted[1:] in [[limit if short else None for limit, short in zip((64, 21, (640, 480)), shorts, strict=True)]
                          for shorts in itertools.product((False, True), repeat=3)]
    if any(wanted):
        with pytest.raises((UnsupportedError, ImageError)):
            info.check(640, 480, settings)
    else:
        info.check(640, 480, settings)


@pytest.mark.parametrize(("more", "expected"), [
    ({}, {}),
    ({1: 16, 2: 262136}, {"dma_alignment": 16, "update_bytes": 262136}),
    ({1: 16, 2: 262136, 3: 36}, {"dma_alignment": 16, "update_bytes": 262136, "max_prefilter_cap": 36}),
    ({2: 5, 0x1234: 7}, {"update_bytes": 5}),
], ids=["older firmware", "firmware of today", "a smaller cap", "newer firmware"])
def test_capabilities(more, expected):
    """Those that are known here, by name: unknown numbers are skipped, absent ones are not in it."""
    with udp_device() as there:
        there.more = more
        with connect(there.url) as device:
            assert device.info().capabilities == expected
            assert device.info().max_disparities == 128
            assert device.info().max_prefilter_cap == more.get(3, 63)


@pytest.mark.parametrize("most", [31, 36, 62, 0])
def test_a_smaller_cap(most):
    """A larger prefilter cap is refused with the limit, where it has an effect; defaults have the largest at most."""
    info  = DeviceInfo("model:", "a device", 640, 480, 640*480, 64, 5, 21, capabilities={"max_prefilter_cap": most})
    limit = most or 63
    info.check(640, 480, MatcherSettings(prefilter_cap=limit))
    assert info.default_settings().prefilter_cap == 31
    assert choose_settings([info], default=MatcherSettings(prefilter_cap=63)).settings.prefilter_cap == limit
    if most:
        info.check(640, 480, MatcherSettings(prefilter_cap=most + 1, prefilter="none", texture_threshold=0))
        with pytest.raises(UnsupportedError, match=f"a device has prefilter caps up to {most}, not {most + 1}"):
            info.check(640, 480, MatcherSettings(prefilter_cap=most + 1))


class SimulationError(Exception):
    """What a simulation that cannot start raises."""


class Simulation:
    """The interface of a simulated system's handle."""

    def __init__(self, port, udp_port=0):
        self.port, self.udp_port = port, udp_port
        self.closed = False

    def close(self):
        self.closed = True


def test_sim_device_is_started_with_its_options_and_stopped(monkeypatch):
    started = []
    with scripted_server(None) as url:
        def start_simulation(ram="integrated", slots=2):
            started.append((ram, slots, Simulation(int(url.rsplit(":", 1)[1]))))
            return started[-1][-1]

        replace_module(monkeypatch, "litestereo.sim.system.simulation", start_simulation=start_simulation,
                       SimulationError=SimulationError)
        # The scripted server hangs up, so the connection fails; the simulation must be stopped all the same.
        with pytest.raises(DeviceError, match="closed the connection|lost"):
            connect("sim:?ram=sdram&slots=3&link=serial")
    assert started[0][:2] == ("sdram", 3)
    assert started[0][2].closed
    with pytest.raises(UrlError, match="unknown option, the options are link, mode, ram, slots"):
        connect("sim:?speed=9")
    with pytest.raises(UrlError, match="link is udp or serial, not 'ipx'"):
        connect("sim:?link=ipx")


def test_sim_device_is_reached_by_its_ethernet(monkeypatch):
    with udp_device() as there:
        simulation = Simulation(0, there.port)
        replace_module(monkeypatch, "litestereo.sim.system.simulation", start_simulation=lambda: simulation,
                       SimulationError=SimulationError)
        with connect("sim:") as device:
            assert device.info().url == "sim:"
            assert not simulation.closed
        assert simulation.closed


@pytest.mark.parametrize("error", [OSError("no\ncompiler"), SimulationError("no\ncompiler")])
def test_a_simulation_that_cannot_start_is_one_line(monkeypatch, error):
    def fail():
        raise error

    replace_module(monkeypatch, "litestereo.sim.system.simulation", start_simulation=fail,
                   SimulationError=SimulationError)
    with pytest.raises(DeviceError, match="cannot be started: no compiler"):
        connect("sim:")
