#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Each board's SoC in litex_sim: it boots from its flash, passes its self-test, matches a real pair and drawn ones
as cv2.StereoBM does with the board's stages, shows the map if there is a screen, and accepts other firmware over its
link."""

from __future__ import annotations

import os
import time
from dataclasses import replace

import numpy as np
import pytest

from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.host_tools.devices.connect import connect
from litestereo.sim.system.build import build_firmware, build_soc
from litestereo.sim.system.simulation import start_simulation
from litestereo.soc.boards import BOARDS, soc_class
from litestereo.soc.flow.sources import flash_image
from support.data import stereo_pair
from support.expected import expected_map
from support.opencv import same_as_opencv
from support.pairs import generator, textured_pair
from support.screen import CLOCKS, LINES, expected_picture, shown_picture
from support.settings import OpenCVDraws

pytestmark = pytest.mark.system

#: Boards whose simulators are built, minutes each; `make boards-sim` builds all.
CHOSEN = os.environ.get("LITESTEREO_BOARDS", "colorlight_i5").split()

#: Settings that each board is tried with, per mode of transfer: `make boards-sim` draws more.
DRAWN = 20 if "LITESTEREO_BOARDS" in os.environ else 4

#: Boards with Ethernet, which is faster than the serial line. LiteDRAM's models of DDR2 and DDR3 need no training.
ETHERNET = ("colorlight_i5", "colorlight_i9", "ecpix5", "arty")


def url_of(board, simulation):
    """Return the URL of the board's faster link."""
    return f"udp://127.0.0.1:{simulation.udp_port}" if board in ETHERNET else \
        f"tcp://127.0.0.1:{simulation.port}"


def drawn_pairs(preset, salt):
    """Yield drawn settings within a preset, and a small pair for each; the first setting has all stages at work."""
    rng   = generator(salt)
    # Wider images take long on a serial line.
    draws = OpenCVDraws(rng, block_size=preset.max_block_size, disparities=preset.disparities, min_disparity=40,
                        prefilter_cap=preset.max_prefilter_cap)
    for index in range(DRAWN):
        settings = draws.settings()
        if index == 0:
            settings = replace(settings, disparities=preset.disparities, block_size=preset.max_block_size,
                               min_disparity=5, prefilter_cap=31, uniqueness_ratio=5, texture_threshold=200,
                               disp12_max_diff=1)
        width  = settings.min_disparity + settings.disparities + settings.block_size + int(rng.integers(24, 48))
        height = settings.block_size + int(rng.integers(1, 16))
        shift  = settings.min_disparity + int(rng.integers(settings.disparities))
        left, right = textured_pair(width, height, rng, shift)
        # Noise, so that blocks tie less often and the left-right check has something to find.
        yield left, np.clip(right + rng.integers(-20, 21, right.shape), 0, 255).astype(np.uint8), settings


#: Settings that switch a stage of cv2.StereoBM off.
OFF = {"texture": {"texture_threshold": 0}, "uniqueness": {"uniqueness_ratio": 0}, "subpixel": {"subpixel": False},
       "left_right": {"disp12_max_diff": -1}, "min_disparity": {"min_disparity": 0}}


def within(preset, settings):
    """Return the settings without the stages that a preset lacks."""
    off = [values for stage, values in OFF.items() if stage not in preset.features]
    return replace(settings, **{name: value for values in off for name, value in values.items()})


def assert_same(device, preset, salt):
    """Check that maps of drawn pairs equal those of cv2.StereoBM, or of the model if the preset lacks a stage."""
    for left, right, drawn in drawn_pairs(preset, salt):
        settings  = within(preset, drawn)
        disparity = device.compute(left, right, settings).disparity
        if settings == drawn:
            same_as_opencv(disparity, left, right, settings)
        assert np.array_equal(disparity, expected_map(left, right, settings))


def assert_shows(simulation, disparity, settings, limit_s=600):
    """Check that pictures are black, or show the map, or in one case a part; none has waited for the memory."""
    path     = simulation.folder / "screen.ppm"
    expected = expected_picture(disparity, settings.disparities)
    deadline = time.monotonic() + limit_s
    mixed    = set()
    while True:
        shown = shown_picture(path)
        assert (shown.rgb.shape, shown.lines) == ((480, 640, 3), LINES)
        # The first picture does not start a whole number of lines after power-up.
        assert shown.clocks == CLOCKS or shown.number == 1
        assert (shown.rgb == shown.rgb[..., :1]).all()
        picture = shown.rgb[..., 0]
        if np.array_equal(picture, expected):
            break
        assert ((picture == expected) | (picture == 0)).all()
        if picture.any():
            mixed.add(shown.number)
        assert len(mixed) <= 1
        assert time.monotonic() < deadline
        time.sleep(0.5)
    assert "[video2file]" not in simulation.log()


@pytest.mark.long
@pytest.mark.parametrize("board", BOARDS)
def test_board(board):
    """Boot program, RAM and preset are the board's; pins and clocks are the simulator's.

    One run covers the self-test, a real pair, drawn pairs and settings with all stages that the preset has, stored and
    streamed, and an update. The update resets the whole SoC through its register; the boot program then reads the
    flash, which has kept its contents.
    """
    if board not in CHOSEN:
        pytest.skip(f"not in LITESTEREO_BOARDS: {' '.join(CHOSEN)}")
    preset   = soc_class(board).preset
    settings = within(preset, MatcherSettings(preset.disparities, preset.max_block_size, disp12_max_diff=1))
    pair        = stereo_pair("motorcycle")
    left, right = (np.ascontiguousarray(image[200:240, 100:420]) for image in (pair.left, pair.right))
    other       = flash_image(build_firmware(build_soc(board), 0x0102).read_bytes())
    with start_simulation(board, timeout_s=900) as simulation:
        url, console = url_of(board, simulation), f"tcp://127.0.0.1:{simulation.port}"
        with connect(console) as device:
            assert "selftest: passed" in device.console("selftest", 1800)
        if preset.streaming and board in ETHERNET:
            with connect(f"{url}?mode=streamed") as device:
                assert_same(device, preset, 1)
        with connect(url) as device:
            assert_same(device, preset, 2)
            disparity = device.compute(left, right, settings).disparity
            assert np.array_equal(disparity, expected_map(left, right, settings))
            if preset.with_screen:
                assert_shows(simulation, disparity, settings)
            assert device.info().firmware_version == "0.1"
            assert device.update_firmware(other, restart_limit_s=1800).firmware_version == "1.2"
        with connect(console) as device:
            assert device.info().firmware_version == "1.2"
            assert "flash: id 0xef4018, 2 images of 262144 bytes" in device.console("info", 900)
