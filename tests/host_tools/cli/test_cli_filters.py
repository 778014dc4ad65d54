#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""`--filter` of `match`, `stream`, `view` and `eval`: the files, the figures, the cameras, and mistakes."""

from __future__ import annotations

import json

import cv2
import numpy as np
import pytest

from litestereo.host_tools.cameras.camera_info import ideal_cameras, write_camera_info
from litestereo.host_tools.cameras.rectify import FILES
from litestereo.host_tools.core.disparity_map import DisparityMap
from litestereo.host_tools.core.filters import FilterChain
from litestereo.host_tools.core.geometry import StereoGeometry
from litestereo.host_tools.core.images import color_image, disparity_pixels
from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.host_tools.evaluation.metrics import measure_map
from support import data_sets
from support.command import error_line, run
from support.expected import expected_map
from support.pairs import generator, textured_pair

WIDTH, HEIGHT, SHIFT, FRAMES = 97, 43, 7, 4
SETTINGS = MatcherSettings(16, 5, min_disparity=2)
GEOMETRY = StereoGeometry(WIDTH, HEIGHT, 100.0, 0.06, 48.0, 21.0, 48.0)
MATCHING = ["--device", "model:", "--disparities", 16, "--block-size", 5, "--min-disparity", 2]
CHAIN    = ["speckle:window=3", "decimation:filter_magnitude=2", "spatial", "temporal:holes_fill=8", "hole_filling"]


@pytest.fixture(autouse=True)
def no_device_in_the_environment(monkeypatch):
    monkeypatch.delenv("LITESTEREO_DEVICE", raising=False)


@pytest.fixture(scope="module")
def images():
    """Pairs of one scene with noise."""
    rng   = generator(1300)
    scene = textured_pair(WIDTH, HEIGHT, rng, SHIFT)
    return [tuple(np.clip(image + rng.normal(0, 20, image.shape), 0, 255).astype(np.uint8) for image in scene)
            for _ in range(FRAMES)]


@pytest.fixture
def folder(tmp_path, images, monkeypatch):
    """A folder with the pairs, a truth, and cameras that rectify nothing."""
    for side, name in enumerate(("left", "right")):
        data_sets.write(tmp_path/name, {f"{number}.png": pair[side] for number, pair in enumerate(images)})
    truth = np.full((HEIGHT, WIDTH), 256*SHIFT, np.uint16)
    data_sets.write(tmp_path/"set", {"left.png": images[0][0], "right.png": images[0][1], "disp_left_u16.png": truth})
    for name, camera in zip(FILES, ideal_cameras(GEOMETRY), strict=True):
        write_camera_info(tmp_path/"calibration"/name, camera)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def options(texts):
    return [word for text in texts for word in ("--filter", text)]


def filtered(images, texts, geometry=None):
    """Return the filtered maps of pairs that follow each other."""
    chain = FilterChain.parse(texts)
    return [chain.process(DisparityMap(expected_map(left, right, SETTINGS), SETTINGS, geometry))
            for left, right in images]


def test_match(folder, images, capfd):
    """Files, JSON and metrics are of the filtered map, and depth and points are in its larger pixels."""
    more = ["--calibration", "calibration", "--ground-truth", "set/disp_left_u16.png", "--json"]
    assert run("match", "left/0.png", "right/0.png", "-o", "out", *MATCHING, *options(CHAIN), *more) == 0
    out, err = capfd.readouterr()
    assert "the filter temporal changes nothing here: it needs several frames of one scene" in err
    (map_,) = filtered(images[:1], CHAIN, GEOMETRY)
    assert np.array_equal(np.load("out/disparity.npy"), map_.disparity)
    assert np.array_equal(cv2.imread("out/disparity_color.png"), color_image(map_.disparity, map_.settings))
    assert np.array_equal(np.load("out/depth.npy"), map_.depth_m(), equal_nan=True)
    # The disparity of the scene is 7 pixels, and its depth does not change with the size of the pixels.
    assert np.nanmedian(map_.depth_m()) == pytest.approx(100*0.06/SHIFT, rel=0.05)
    cloud = (folder/"out"/"cloud.ply").read_bytes()
    assert f"element vertex {np.isfinite(map_.depth_m()).sum()}\n".encode() in cloud
    printed = json.loads(out)
    assert (printed["width"], printed["height"], printed["decimated_by"]) == (WIDTH//2, HEIGHT//2, 2)
    assert printed["geometry"]["focal_px"] == 50 and printed["geometry"]["baseline_m"] == 0.06
    assert printed["disparities"] == 16 and printed["min_disparity"] == 2
    assert [one["filter"] for one in printed["filters"]] == [text.partition(":")[0] for text in CHAIN]
    truth = np.full((HEIGHT, WIDTH), SHIFT, np.float32)
    rated = measure_map(map_.in_images(truth.shape), truth)
    assert printed["quality"]["bad_2_0"] == rated["bad_2_0"] and printed["quality"]["density"] == rated["density"]


def test_match_says_what_a_decimated_map_is(folder, capfd):
    assert run("match", "left/0.png", "right/0.png", "-o", "out", *MATCHING, "--filter", "decimation",
               "--calibration", "calibration") == 0
    out = capfd.readouterr().out
    assert "size        48x21 pixels" in out
    assert "decimated   by 2: cameras 48x21 pixels, focal length 50.00 pixels, baseline 60.00 mm" in out
    # What uses the cameras of the images afterwards is refused.
    assert run("export", "out/disparity.npy", "-o", "exported", "--format", "ply", "--min-disparity", 1,
               "--calibration", "calibration") == 1
    assert "48x21" in error_line(capfd)


def test_threshold_removes_what_is_far(folder, images, capfd):
    assert run("match", "left/0.png", "right/0.png", "-o", "out", *MATCHING, "--calibration", "calibration",
               "--filter", "threshold:min_distance=0.8,max_distance=0.9") == 0
    depth = np.load("out/depth.npy")
    assert 0.8 <= np.nanmin(depth) < np.nanmax(depth) <= 0.9
    assert np.isfinite(depth).sum() > 1000


@pytest.mark.parametrize("texts", [CHAIN, ["temporal:holes_fill=8"]])
def test_stream(folder, images, texts, capfd):
    """Each frame's map is filtered with those before it."""
    assert run("stream", "left", "right", "-o", "maps", "--format", "npy", *MATCHING, *options(texts), "--json",
               "--calibration", "calibration") == 0
    out, err = capfd.readouterr()
    assert err == ""
    lines = [json.loads(line) for line in out.splitlines()]
    maps  = filtered(images, texts, GEOMETRY)
    for number, map_ in enumerate(maps):
        assert np.array_equal(np.load(f"maps/disparity_{number}.npy"), map_.disparity)
        assert np.array_equal(np.load(f"maps/depth_{number}.npy"), map_.depth_m(), equal_nan=True)
        assert lines[number]["valid_of_all"] == pytest.approx(100*map_.valid.mean())
    assert lines[-1]["summary"]["decimated_by"] == maps[-1].factor
    assert [one["filter"] for one in lines[-1]["summary"]["filters"]] == [text.partition(":")[0] for text in texts]
    assert not np.array_equal(maps[-1].disparity, filtered(images[-1:], texts)[0].disparity)


def test_view(folder, images, capfd):
    """A still has the decimated map in the size of the images."""
    assert run("view", "left", "right", "--montage", "out.png", *MATCHING, *options(CHAIN), "--calibration",
               "calibration") == 0
    assert "decimated by 2: cameras 48x21 pixels" in capfd.readouterr().out
    map_    = filtered(images, CHAIN)[-1]
    colours = color_image(map_.disparity, map_.settings).repeat(2, axis=0).repeat(2, axis=1)
    picture = cv2.imread("out.png")
    assert picture.shape == (2*(HEIGHT + 24), 2*WIDTH, 3)
    below   = picture[HEIGHT + 48:, :WIDTH]
    assert np.array_equal(below[:42, :96], colours) and not below[42:].any() and not below[:, 96:].any()


def test_view_in_rerun(folder, images, tmp_path):
    """Points are those of the decimated map."""
    pytest.importorskip("rerun", reason="Rerun is in the extra `view`")
    from rerun.chunk import RrdReader

    assert run("view", "left", "right", "--save", "out.rrd", *MATCHING, *options(CHAIN), "--calibration",
               "calibration") == 0
    counts = []
    for chunk in RrdReader(tmp_path/"out.rrd").stream():
        batch = chunk.to_record_batch()
        if chunk.entity_path == "/world/points" and "Points3D:positions" in batch.schema.names:
            counts += [len(points) for points in batch.column("Points3D:positions").to_pylist()]
    assert sorted(counts) == sorted(int(np.isfinite(map_.depth_m()).sum())
                                    for map_ in filtered(images, CHAIN, GEOMETRY))


@pytest.mark.parametrize("jobs", [1, 2])
def test_eval(folder, images, jobs, capfd):
    """Every pair begins anew, and a decimated map is rated in the images."""
    texts = ["decimation:filter_magnitude=3", "temporal:holes_fill=8", "hole_filling:holes_fill=2"]
    data_sets.write(folder/"sets"/"again", {name: cv2.imread(f"set/{name}", cv2.IMREAD_UNCHANGED)
                                            for name in ("left.png", "right.png", "disp_left_u16.png")})
    (folder/"set").rename(folder/"sets"/"set")
    assert run("eval", "sets", *MATCHING, "--opencv", "bm", *options(texts), "--json", "--jobs", jobs) == 0
    printed = json.loads(capfd.readouterr().out)
    (map_,) = filtered(images[:1], texts)
    truth   = np.full((HEIGHT, WIDTH), SHIFT, np.float32)
    expected = measure_map(map_.in_images(truth.shape), truth)
    rows = [row for row in printed["results"] if row["region"] == "all"]
    assert len(rows) == 4
    for row in rows:
        assert row["bad_2_0"] == expected["bad_2_0"] and row["density"] == expected["density"]
        assert row["rms"] == pytest.approx(expected["rms"])
    assert [one["filter"] for one in printed["filters"]] == ["decimation", "temporal", "hole_filling"]
    # Without filters the map is another one.
    unfiltered = measure_map(disparity_pixels(expected_map(*images[0], SETTINGS), SETTINGS.invalid), truth)
    assert unfiltered["density"] != expected["density"]


@pytest.mark.parametrize(("arguments", "text"), [
    (["--filter", "gauss"], "argument --filter: there is no filter 'gauss', there are decimation, spatial, temporal, "
                            "hole_filling, threshold, speckle"),
    (["--filter", "spatial:sigma=3"], "the filter spatial has no parameter 'sigma', it has filter_magnitude=2, "),
    (["--filter", "decimation:filter_magnitude=9"],
     "filter_magnitude of the filter decimation must be a whole number from 2 to 8, not 9"),
    (["--filter", "threshold"], "the filter threshold needs the cameras: "),
])
@pytest.mark.parametrize("command", ["match", "stream", "view", "eval"])
def test_mistakes_are_one_line_before_anything_is_done(folder, command, arguments, text, capfd):
    places = {"match": ["left/0.png", "right/0.png", "-o", "out"], "stream": ["left", "right", "-o", "out"],
              "view": ["left", "right", "--montage", "out"], "eval": ["set"]}
    # Nothing answers at this address: the mistake is found before the device is asked.
    assert run(command, *places[command], "--device", "tcp://127.0.0.1:1", *arguments) == 2
    assert text in error_line(capfd)
    assert not (folder/"out").exists()


def test_a_map_too_small_to_decimate(folder, capfd):
    assert run("match", "left/0.png", "right/0.png", "-o", "out", *MATCHING,
               *options(["decimation:filter_magnitude=8", "decimation:filter_magnitude=6"])) == 1
    assert "a map of 12x5 pixels cannot be decimated by 6" in error_line(capfd)
    assert not (folder/"out").exists()


@pytest.mark.parametrize("command", ["match", "stream", "view", "eval"])
def test_help_has_every_filter(command, capfd):
    assert run(command, "--help") == 0
    out = capfd.readouterr().out
    assert "--filter NAME[:key=value,...]" in out and "  spatial: smooth surfaces" in out
    assert "    filter_smooth_alpha=0.5  0.25 to 1: share" in out
