#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""`litestereo measure`: maps of files, pairs, several frames, text and JSON, and mistakes."""

from __future__ import annotations

import json

import numpy as np
import pytest

from litestereo.host_tools.cameras.camera_info import ideal_cameras, write_camera_info
from litestereo.host_tools.cameras.rectify import FILES
from litestereo.host_tools.core.geometry import StereoGeometry
from litestereo.host_tools.core.images import disparity_pixels
from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.host_tools.evaluation.flat_target import FIGURES, TEMPORAL_FIGURES, Region, RegionMeter
from support import data_sets
from support.command import error_line, run
from support.expected import expected_map
from support.pairs import generator, textured_pair

WIDTH, HEIGHT, SHIFT = 120, 60, 8
SETTINGS = MatcherSettings(16, 5)
GEOMETRY = StereoGeometry(WIDTH, HEIGHT, 200.0, 0.1, 59.5, 29.5, 59.5)
MATCHING = ["--device", "model:", "--disparities", 16, "--block-size", 5]
#: Depth of the target in metres.
DEPTH_M  = 200*0.1/SHIFT


@pytest.fixture(autouse=True)
def no_device_in_the_environment(monkeypatch):
    monkeypatch.delenv("LITESTEREO_DEVICE", raising=False)


@pytest.fixture(scope="module")
def images():
    rng   = generator(1500)
    scene = textured_pair(WIDTH, HEIGHT, rng, SHIFT)
    return [tuple(np.clip(image + rng.normal(0, 12, image.shape), 0, 255).astype(np.uint8) for image in scene)
            for _ in range(3)]


@pytest.fixture
def folder(tmp_path, images, monkeypatch):
    """A folder with pairs of a flat target, their maps, and cameras that rectify nothing."""
    for side, name in enumerate(("left", "right")):
        data_sets.write(tmp_path/name, {f"{number}.png": pair[side] for number, pair in enumerate(images)})
    for number, pair in enumerate(images):
        np.save(tmp_path/f"map{number}.npy", expected_map(*pair, SETTINGS))
    for name, camera in zip(FILES, ideal_cameras(GEOMETRY), strict=True):
        write_camera_info(tmp_path/"calibration"/name, camera)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def expected(images, region=None, true_m=None):
    """Return the figures of the maps of pairs."""
    meter = RegionMeter(region, true_m)
    for left, right in images:
        meter.add(disparity_pixels(expected_map(left, right, SETTINGS), SETTINGS.invalid), GEOMETRY)
    return {name: None if np.isnan(value) else pytest.approx(value) for name, value in meter.figures().items()}


def measured(capfd, *arguments):
    assert run("measure", *arguments, "--json") == 0
    out, err = capfd.readouterr()
    return json.loads(out), err


def test_a_source(folder, images, capfd):
    """All frames of a folder; a device rectifies or the host, and both figures and noise are of these frames."""
    printed, err = measured(capfd, "left", "right", *MATCHING, "--calibration", "calibration", "--true-distance", 2.4)
    assert err == ""
    figures = expected(images, None, 2.4)
    assert {name: printed[name] for name in figures} == figures
    assert printed["frames"] == 3 and printed["region"] == {"x": 36, "y": 18, "width": 48, "height": 24}
    assert printed["depth_m"] == pytest.approx(DEPTH_M, rel=0.02) and printed["temporal_noise_px"] > 0
    assert printed["z_accuracy_percent"] == pytest.approx(100*(DEPTH_M/2.4 - 1), abs=1)
    assert printed["rectification"]["where"] == "device" and printed["device"] is not None


def test_a_pair_with_cameras_by_numbers(folder, images, capfd):
    printed, _ = measured(capfd, "left/0.png", "right/0.png", *MATCHING, "--focal", 200, "--baseline", 0.1,
                          "--region", 30, 10, 60, 40)
    figures = expected(images[:1], Region(30, 10, 60, 40))
    assert {name: printed[name] for name in figures} == figures
    assert printed["temporal_noise_m"] is None and printed["rectification"] is None


def test_frames_and_filters(folder, images, capfd):
    """Of a decimated map depth and distances stay, and the region is the same part of the scene."""
    printed, _ = measured(capfd, "left", "right", *MATCHING, "--focal", 200, "--baseline", 0.1, "--frames", 2,
                          "--filter", "decimation", "--region", 40, 10, 60, 40)
    assert printed["frames"] == 2 and printed["decimated_by"] == 2
    assert printed["region"] == {"x": 20, "y": 5, "width": 30, "height": 20}
    assert printed["depth_m"] == pytest.approx(DEPTH_M, rel=0.02)
    assert printed["plane_distance_m"] == pytest.approx(DEPTH_M, rel=0.02)


@pytest.mark.parametrize("cameras", [["--calibration", "calibration"], ["--focal", 200, "--baseline", 0.1]])
def test_maps(folder, images, cameras, capfd):
    """The same figures as those of the pairs; several maps are frames."""
    printed, err = measured(capfd, "--map", "map0.npy", "map1.npy", "map2.npy", *cameras)
    assert err == ""
    figures = expected(images)
    assert {name: printed[name] for name in figures} == figures and printed["frames"] == 3
    assert printed["device"] is None


def test_text(folder, capfd):
    assert run("measure", "left", "right", *MATCHING, "--calibration", "calibration", "--true-distance", 2.5,
               "--filter", "decimation") == 0
    lines = dict(line.split(maxsplit=1) for line in capfd.readouterr().out.splitlines())
    assert lines["frames"] == "3" and lines["region"] == "24x12 pixels at column 18, row 9"
    assert lines["depth"].endswith(" m, median") and lines["noise"].endswith("pixels, over time")
    assert lines["decimated"].startswith("by 2: cameras 60x30 pixels")
    assert lines["rectified"].startswith("on the device")
    assert lines["Z"].startswith("accuracy") and lines["Z"].endswith("% of 2.5 m")


@pytest.mark.parametrize(("arguments", "status", "text"), [
    # The three likeliest ones: no cameras, a region outside of the images, a target without texture.
    (["--map", "map0.npy"], 2, "measure needs the cameras: give --calibration, --calib, or --focal with --baseline"),
    (["left", "right", *MATCHING, "--calibration", "calibration", "--region", 100, 0, 40, 20], 1,
     "the region of 40x20 pixels at column 100, row 0 is not within the map of 120x60 pixels"),
    (["flat", "flat2", *MATCHING, "--calibration", "calibration"], 1,
     "no pixel of the region of 48x24 pixels at column 36, row 18 has a depth: is the target in it"),
    # Others.
    ([], 2, "give either a source of pairs, one or two names, or --map"),
    (["left", "right", "--map", "map0.npy"], 2, "give either a source"),
    (["left", "right", "--calibration", "calibration"], 2, "a source needs --device"),
    (["left", "right", *MATCHING], 2, "measure needs the cameras"),
    (["--map", "map0.npy", "--calibration", "calibration", "--filter", "spatial"], 2, "leave --filter out"),
    (["--map", "map0.npy", "small.npy", "--focal", 200, "--baseline", 0.1], 1,
     "small.npy: is 40x20 pixels, other than map0.npy"),
    (["--map", "small.npy", "--calibration", "calibration"], 1, "the map has 40x20 pixels, the cameras 120x60"),
    (["--map", "map0.npy", "--focal", 200], 2, "--focal and --baseline need each other"),
    (["--map", "none.npy", "--focal", 200, "--baseline", 0.1], 1, "there is no such file"),
    (["--map", "map0.npy", "--focal", 200, "--baseline", 0.1, "--region", 0, 0, 0, 9], 2, "a region has"),
    (["--map", "map0.npy", "--focal", 200, "--baseline", 0.1, "--true-distance", 0], 2, "above 0"),
])
def test_mistakes_are_one_line(folder, arguments, status, text, capfd):
    blank = np.full((HEIGHT, WIDTH), 128, np.uint8)
    data_sets.write(folder/"flat", {"0.png": blank})
    data_sets.write(folder/"flat2", {"0.png": blank})
    np.save("small.npy", np.load("map0.npy")[:20, :40])
    assert run("measure", *arguments) == status
    assert text in error_line(capfd)


def test_pairs_of_different_sizes(folder, images, capfd):
    """They have no pixels in common, and noise over time needs these."""
    for side, name in enumerate(("left", "right")):
        data_sets.write(folder/name, {"1.png": images[0][side][:50]})
    assert run("measure", "left", "right", *MATCHING, "--focal", 200, "--baseline", 0.1) == 1
    assert "is 120x50 pixels, other than the pairs before it" in error_line(capfd)


def test_help_has_every_figure(capfd):
    assert run("measure", "--help") == 0
    out = capfd.readouterr().out
    assert all(f"  {name:18}  " in out for name in (*FIGURES, *TEMPORAL_FIGURES))
