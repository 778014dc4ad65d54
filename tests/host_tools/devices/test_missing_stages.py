#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Stages that a device was built without: every command and the interface for programs say so, in the same way."""

import json
import warnings

import cv2
import numpy as np
import pytest

from litestereo.host_tools.core.errors import UnsupportedError
from litestereo.host_tools.core.features import ALL_STAGES, DESCRIPTIONS, Feature
from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.host_tools.devices import connect as module
from litestereo.host_tools.devices.base import choose_settings
from support.command import error_line, run
from support.devices import device_without
from support.expected import expected_map
from support.pairs import generator, textured_pair

#: Stages that are on by default, and those that are off by then.
BY_DEFAULT = {
    Feature.XSOBEL:     ["xsobel", "texture"],
    Feature.TEXTURE:    ["texture"],
    Feature.UNIQUENESS: ["uniqueness"],
    Feature.SUBPIXEL:   ["subpixel"],
    Feature.TEXTURE | Feature.UNIQUENESS: ["texture", "uniqueness"],
}


def test_drawn_devices_and_settings():
    """The settings suit the device; what was given is as given; and what is off by default only is named."""
    rng     = generator(270)
    options = {"prefilter": ("none", "xsobel"), "texture_threshold": (0, 10), "uniqueness_ratio": (0, 15),
               "disp12_max_diff": (-1, 1), "subpixel": (False, True), "min_disparity": (0, 5), "median": (False, True)}
    refused = 0
    for _ in range(400):
        missing = Feature(int(rng.integers(int(ALL_STAGES) + 1)) & int(rng.integers(int(ALL_STAGES) + 1)))
        missing = missing & ~Feature.RAW if missing & Feature.XSOBEL else missing
        info    = device_without(missing).info()
        given   = {name: values[rng.integers(2)] for name, values in options.items() if rng.random() < 0.25}
        try:
            choice = choose_settings([info], given)
        except UnsupportedError:
            refused += 1
            continue
        for name, value in given.items():
            assert getattr(choice.settings, name) == value
        wanted = MatcherSettings(**given)
        left   = choice.settings.features & missing
        # What is still needed was asked for: `check` refuses it.
        assert not left or left & MatcherSettings(**given).features
        assert choice.missing == wanted.features & ~choice.settings.features
        assert choice.lacking == choice.missing & missing
        assert len(choice.notices) == bin(int(choice.missing)).count("1")
        if choice.missing:
            with pytest.raises(UnsupportedError):
                choose_settings([info], given, strict=True)
        else:
            assert choose_settings([info], given, strict=True) == choice
    assert 10 < refused < 200


def test_several_devices_have_equal_settings():
    infos  = [device_without(Feature.TEXTURE, 32, 11).info(), device_without(Feature.UNIQUENESS, 48, 7).info()]
    choice = choose_settings(infos)
    assert (choice.settings.disparities, choice.settings.block_size) == (32, 7)
    assert choice.missing == Feature.TEXTURE | Feature.UNIQUENESS
    assert choose_settings([]).settings == MatcherSettings()
    for info in infos:
        assert info.default_settings() == choose_settings([info]).settings


@pytest.fixture
def pair(tmp_path, monkeypatch):
    monkeypatch.delenv("LITESTEREO_DEVICE", raising=False)
    monkeypatch.chdir(tmp_path)
    images = textured_pair(96, 40, generator(271), 5)
    for name, image in zip(("left", "right"), images, strict=True):
        cv2.imwrite(f"{name}.png", image)
    cv2.imwrite("disp_left_u16.png", np.full(images[0].shape, 256*5, np.uint16))
    return images


def told(out):
    """What JSON says of the stages, wherever it is."""
    last = json.loads(out if out.startswith("{\n") else out.splitlines()[-1])
    last = last.get("summary", last)
    return last["settings"][0]["stages_off"] if "settings" in last else last["stages_off"]


@pytest.mark.parametrize("missing", BY_DEFAULT, ids=str)
@pytest.mark.parametrize("command", [
    ["match", "left.png", "right.png", "-o", "out"],
    ["stream", "left.png", "right.png"],
    ["view", "left.png", "right.png", "--montage", "out.png"],
    ["eval", "."],
    ["bench", "--size", "100x20", "--frames", 1],
], ids=lambda command: command[0])
def test_commands(command, missing, pair, monkeypatch, capfd):
    monkeypatch.setattr(module, "open_model", lambda url: device_without(missing))
    words = [*command, "--device", "model:", "--disparities", 16, "--json"]
    assert run(*words) == 0
    out, err = capfd.readouterr()
    assert told(out) == BY_DEFAULT[missing]
    names = [DESCRIPTIONS[stage] for stage in Feature if stage.name.lower() in BY_DEFAULT[missing]]
    assert [line.split(" is off: the device was built without ")[0] for line in err.splitlines()] == [
        f"litestereo: note: {name}" for name in names]
    assert run(*words, "--strict") == 1
    assert "was built without" in error_line(capfd)
    # Nothing is left out that was asked to be off.
    off = {"xsobel": ["--prefilter", "none"], "texture": ["--texture-threshold", 0],
           "uniqueness": ["--uniqueness-ratio", 0], "subpixel": ["--no-subpixel"]}
    assert run(*words, "--strict", *(word for name in BY_DEFAULT[missing] for word in off[name])) == 0
    out, err = capfd.readouterr()
    assert (told(out), err) == ([], "")


def test_programs(pair):
    with device_without(Feature.UNIQUENESS) as device:
        with pytest.warns(RuntimeWarning, match="uniqueness test"):
            result = device.compute(*pair)
        assert np.array_equal(result.disparity, expected_map(*pair, MatcherSettings(uniqueness_ratio=0)))
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            device.compute(*pair)
            device.compute(*pair, device.info().default_settings())
    with device_without(Feature.MEDIAN | Feature.LEFT_RIGHT) as device, warnings.catch_warnings():
        warnings.simplefilter("error")
        device.compute(*pair)
