#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""docs/commands.md names every option of every command, and every key of its JSON; and no option that is not there."""

from __future__ import annotations

import argparse
import json
import re
import types

import numpy as np
import pytest

from litestereo.host_tools import cli
from litestereo.host_tools.cameras.camera_info import ideal_cameras, write_camera_info
from litestereo.host_tools.cameras.rectify import FILES, Rectifier
from litestereo.host_tools.cli import update
from litestereo.host_tools.core.disparity_map import DisparityMap
from litestereo.host_tools.core.features import Capability
from litestereo.host_tools.core.geometry import StereoGeometry
from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.host_tools.data.sources import Shot
from litestereo.host_tools.export.recorder import recording
from litestereo.host_tools.protocol import payloads
from support import data_sets, rig
from support.command import run
from support.firmware import image
from support.pairs import generator, textured_pair
from support.paths import CHECKOUT
from support.videos import write_video

WIDTH, HEIGHT, SHIFT = 120, 60, 7
SMALL = ["--device", "model:", "--disparities", "16", "--block-size", "5"]

#: Commands that print JSON, with arguments for which most values exist.
JSON_COMMANDS = {
    "match":     ["left.png", "right.png", "-o", "out", *SMALL, "--calibration", "calibration",
                  "--ground-truth", "truth.png"],
    "stream":    ["left.avi", "right.avi", "-o", "maps", *SMALL, "--calibration", "calibration"],
    "play":      ["walk.mcap", "-o", "played"],
    "view":      ["left.avi", "right.avi", "--montage", "out.png", *SMALL],
    "measure":   ["left.avi", "right.avi", "--calibration", "calibration", "--true-distance", "2.5", *SMALL],
    "calibrate": ["boards/left", "boards/right", "--pattern", "chessboard", "9x6", "--square", "0.025",
                  "-o", "cameras"],
    "calibration": ["show", "calibration"],
    "rectify":   ["left.png", "right.png", "--calibration", "calibration", "-o", "rectified"],
    "eval":      ["data/teddy", "data/cones", *SMALL],
    "export":    ["data/teddy/disp_left_u16.png", "-o", "exported", "--format", "pfm"],
    "bench":     ["--size", "64x40", "--frames", "1", *SMALL],
    "info":      ["--device", "model:"],
    "update":    ["firmware.bin", "--device", "model:"],
}


def parsers():
    """Return the parser of each command."""
    (action,) = (action for action in cli._parser()._actions if isinstance(action, argparse._SubParsersAction))
    return dict(action.choices)


def sections():
    """Return the text of each section of the page, by its heading."""
    parts = re.split(r"(?m)^#+ +(.+)$", (CHECKOUT / "docs" / "commands.md").read_text(encoding="utf-8"))
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def names(text):
    """Return the words in code marks: options, keys."""
    return {word for mark in re.findall(r"`([^`]+)`", text) for word in re.findall(r"[\w-]+", mark)}


def keys(value):
    """Return the names of all objects in a JSON value."""
    if isinstance(value, dict):
        return set(value).union(*map(keys, value.values()))
    return set().union(*map(keys, value)) if isinstance(value, list) else set()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return a folder with a pair, its truth and cameras, data sets, pictures of a board, and a firmware."""
    folder      = tmp_path_factory.mktemp("commands")
    left, right = textured_pair(WIDTH, HEIGHT, generator(861), SHIFT)
    geometry    = StereoGeometry(WIDTH, HEIGHT, 200.0, 0.1, WIDTH/2, HEIGHT/2, WIDTH/2)
    truth       = np.full(left.shape, 256*SHIFT, np.uint16)
    data_sets.write(folder, {"left.png": left, "right.png": right, "truth.png": truth})
    for name, camera in zip(FILES, ideal_cameras(geometry), strict=True):
        write_camera_info(folder/"calibration"/name, camera)
    for name in ("data/teddy", "data/cones"):
        data_sets.write(folder/name, {"left.png": left, "right.png": right, "disp_left_u16.png": truth})
    settings = MatcherSettings(16, 5)
    cameras  = ideal_cameras(geometry)
    with recording(folder/"walk.mcap", settings, (Rectifier(*cameras).geometry, cameras), False) as recorder:
        recorder.add(Shot("0", left, right), DisparityMap(np.full(left.shape, 16*SHIFT, np.int16), settings, geometry))
    # One more picture of the left camera has no partner.
    write_video(folder/"left.avi",  [left]*3)
    write_video(folder/"right.avi", [right]*2)
    for number, (middle, degrees) in enumerate(rig.board_places(generator(862), 6)):
        rig.take(folder/"boards", f"{number:02}", [rig.flat(rig.chessboard(), 0.3, middle, degrees/2)])
    # This pair does not show the board.
    for side in ("left", "right"):
        data_sets.write(folder/"boards"/side, {"99.png": np.zeros((rig.HEIGHT, rig.WIDTH), np.uint8)})
    (folder/"firmware.bin").write_bytes(image())
    return folder


class FakeDevice:
    """A device that accepts a firmware."""
    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def info(self):
        return types.SimpleNamespace(name="a device", url="model:", firmware_version="0.1")

    def update_firmware(self, *_, **__):
        pass

    def trial(self):
        return payloads.Trial.CONFIRMED


@pytest.mark.parametrize("command", parsers())
def test_every_option_is_on_the_page(command):
    """In the section of the command, or among those of several commands; and the section names no others."""
    own    = names(sections()[command])
    shared = set().union(*(names(sections()[part]) for part in ("Options of several commands", "Matching", "Filters")))
    known  = {option for action in parsers()[command]._actions for option in action.option_strings} - {"--help", "-h"}
    assert {option for option in known if option not in own | shared} == set()
    assert {name for name in own if name.startswith("--")} - known == set()


@pytest.mark.parametrize("command", JSON_COMMANDS)
def test_every_key_of_json_is_on_the_page(command, folder, monkeypatch, capfd):
    """In the section of the command, or, for settings and metrics, in those that it refers to."""
    monkeypatch.chdir(folder)
    monkeypatch.setattr(update, "connect", lambda url: FakeDevice())
    # Frames without a partner are an error at the end.
    assert run(command, *JSON_COMMANDS[command], "--json") == (1 if "left.avi" in JSON_COMMANDS[command] else 0)
    out   = capfd.readouterr().out
    lines = out.splitlines() if command == "stream" else [out]
    found = set().union(*(keys(json.loads(line)) for line in lines))
    named = set().union(*(names(sections()[part]) for part in (command, "Matching", "Filters")))
    if command == "match":
        named |= names(sections()["eval"])
    assert {name for name in found if name not in named} == set()
    assert len(found) > 0 and "null" not in found


def test_every_counter_and_capability_is_described():
    """The names that depend on the device: the page has those of `info`, the protocol the counters of `stats`."""
    assert {known.name.lower() for known in Capability} <= names(sections()["info"])
    assert set(payloads.COUNTERS) <= names((CHECKOUT / "docs" / "protocol.md").read_text(encoding="utf-8"))
    assert "protocol.md#counters" in sections()["stats"]
    assert {trial.name.lower() for trial in payloads.Trial} <= names(sections()["update"])


def test_every_command_that_prints_json_is_tested():
    """`stats` has its names in the protocol."""
    printing = {name for name, parser in parsers().items()
                if any("--json" in action.option_strings for action in parser._actions)}
    assert printing == set(JSON_COMMANDS) | {"stats"}
