#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""`litestereo stream`: every source, what is written and told, and how it ends."""

import json
import signal
import subprocess
import sys

import cv2
import numpy as np
import pytest

from litestereo.host_tools.cameras.camera_info import ideal_cameras, write_camera_info
from litestereo.host_tools.cameras.rectify import FILES
from litestereo.host_tools.core.geometry import StereoGeometry
from litestereo.host_tools.core.settings import MatcherSettings
from support.command import error_line, run
from support.expected import expected_map
from support.interruptible import interruptible
from support.native_device import native_udp_device
from support.pairs import generator, textured_pair
from support.videos import FakeCapture, write_video

COMMAND  = [sys.executable, "-c", "import sys; from litestereo.host_tools.cli import main; sys.exit(main())"]
SETTINGS = MatcherSettings(16, 9)
FRAMES   = 5


@pytest.fixture(autouse=True)
def no_device_in_the_environment(monkeypatch):
    monkeypatch.delenv("LITESTEREO_DEVICE", raising=False)


@pytest.fixture(scope="module")
def images():
    """Five pairs, each with its own disparity."""
    rng = generator(130)
    return [textured_pair(96, 40, rng, shift) for shift in range(3, 3 + FRAMES)]


@pytest.fixture(scope="module")
def data(tmp_path_factory, images):
    """The pairs as folders and as videos."""
    folder = tmp_path_factory.mktemp("stream")
    for side, name in enumerate(("left", "right")):
        (folder/"pairs"/name).mkdir(parents=True)
        for number, pair in enumerate(images):
            cv2.imwrite(str(folder/"pairs"/name/f"{name}_{number + 8}.png"), pair[side])
        write_video(folder/f"{name}.avi", [pair[side] for pair in images])
    write_video(folder/"both.avi", [np.hstack(pair) for pair in images])
    (folder/"text.avi").write_text("no video")
    return folder


def stream(*source, device="model:"):
    return ["stream", *source, "--device", device, "--disparities", 16]


def told(capfd):
    """The lines of --json: frames, and the summary."""
    out, err = capfd.readouterr()
    assert err == ""
    *frames, last = map(json.loads, out.splitlines())
    assert [frame["frame"] for frame in frames] == list(range(len(frames)))
    assert last["summary"]["frames"] == len(frames)
    return frames, last["summary"]


def test_folders_through_a_device_on_a_network(data, images, tmp_path, capfd):
    with native_udp_device() as port:
        assert run(*stream(data/"pairs"/"left", data/"pairs"/"right", device=f"udp://127.0.0.1:{port}"), "--json",
                   "-o", tmp_path/"maps", "--format", "npy") == 0
    frames, summary = told(capfd)
    # 10 comes after 9.
    assert [frame["name"] for frame in frames] == ["8", "9", "10", "11", "12"]
    for frame, pair in zip(frames, images, strict=True):
        assert np.array_equal(np.load(frame["file"]), expected_map(*pair, SETTINGS))
        assert 0 < frame["latency_s"] < 10 and frame["clocks"] == 96*40
        assert frame["valid_of_all"] == pytest.approx(100*np.mean(expected_map(*pair, SETTINGS) > -16))
    assert summary["frames_per_s"] == pytest.approx(FRAMES/summary["seconds"])
    assert 0 < summary["latency_p50_s"] <= summary["latency_p95_s"] <= summary["latency_p99_s"] < 10


def test_one_folder_and_the_summary_for_people(data, capfd):
    assert run(*stream(data/"pairs")) == 0
    out, err = capfd.readouterr()
    assert err == ""
    for text in ("device   reference model", "frames   5 in", "frames/s", "latency  50 % within", "99 % within"):
        assert text in out


@pytest.mark.parametrize("names", [["both.avi"], ["left.avi", "right.avi"]])
def test_videos(names, data, images, tmp_path, capfd):
    """Motion JPEG at its best loses a little: the disparities are the same, as whole pixels."""
    assert run(*stream(*(data/name for name in names)), "--json", "-o", tmp_path, "--format", "pfm") == 0
    frames, _ = told(capfd)
    assert [frame["name"] for frame in frames] == [f"{number:06}" for number in range(FRAMES)]
    for number, frame in enumerate(frames):
        map_ = cv2.imread(frame["file"], cv2.IMREAD_UNCHANGED)
        assert np.isfinite(map_).mean() > 0.4
        assert np.median(map_[np.isfinite(map_)]) == pytest.approx(3 + number, abs=0.1)


@pytest.mark.parametrize("cameras", [["camera:0", "camera:2"], ["camera:5"]])
def test_cameras(cameras, images, monkeypatch, capfd):
    monkeypatch.setattr(cv2, "VideoCapture", FakeCapture)
    monkeypatch.setattr(FakeCapture, "scenes", {0: images[2][0], 2: images[2][1], 5: np.hstack(images[2])})
    assert run(*stream(*cameras), "--frames", 3, "--json") == 0
    frames, summary = told(capfd)
    assert summary["frames"] == 3 and FakeCapture.opened == []
    assert frames[2]["valid_of_all"] == pytest.approx(100*np.mean(expected_map(*images[2], SETTINGS) > -16))


def test_a_camera_that_is_unplugged(images, monkeypatch, capfd):
    monkeypatch.setattr(cv2, "VideoCapture", FakeCapture)
    monkeypatch.setattr(FakeCapture, "scenes", {0: images[0][0], 1: images[0][1]})
    monkeypatch.setattr(FakeCapture, "frames", 2)
    assert run(*stream("camera:0", "camera:1")) == 1
    assert "gives no more frames" in error_line(capfd) and FakeCapture.opened == []
    assert run(*stream("camera:0", "camera:7")) == 1
    assert "camera:7: cannot be opened" in error_line(capfd) and FakeCapture.opened == []


def test_a_calibration_gives_depth(data, images, tmp_path, capfd):
    geometry = StereoGeometry(96, 40, 100.0, 0.06, 48.0, 20.0, 48.0)
    for name, camera in zip(FILES, ideal_cameras(geometry), strict=True):
        write_camera_info(tmp_path/name, camera)
    assert run(*stream(data/"pairs"), "--calibration", tmp_path, "-o", tmp_path/"maps", "--json", "--frames", 2) == 0
    frames, _ = told(capfd)
    for number, frame in enumerate(frames):
        assert frame["median_depth_m"] == pytest.approx(100*0.06/(3 + number), rel=0.01)
        depth = np.load(tmp_path/"maps"/f"depth_{frame['name']}.npy")
        assert np.nanmedian(depth) == pytest.approx(frame["median_depth_m"])
        assert cv2.imread(frame["file"], cv2.IMREAD_UNCHANGED).dtype == np.uint16


def test_a_calibration_for_another_size(data, tmp_path, capfd):
    """Found out with the first pair, when the device is there already: it is let go of."""
    for name, camera in zip(FILES, ideal_cameras(StereoGeometry(97, 40, 100.0, 0.06, 48.0, 20.0, 48.0)), strict=True):
        write_camera_info(tmp_path/name, camera)
    with native_udp_device() as port:
        for _ in range(2):
            assert run(*stream(data/"pairs", device=f"udp://127.0.0.1:{port}"), "--calibration", tmp_path) == 1
            assert "96x40 pixels, the calibration is for 97x40" in error_line(capfd)


def test_ctrl_c_ends_a_stream_well(tmp_path):
    """Of many frames the first ones are matched; the process ends with a summary of those."""
    left, right = textured_pair(96, 40, generator(131))
    write_video(tmp_path/"both.avi", [np.hstack([left, right])]*3000)
    with interruptible([*COMMAND, *map(str, stream(tmp_path/"both.avi")), "--json"], stdout=subprocess.PIPE,
                       stderr=subprocess.PIPE) as running:
        first = [running.stdout.readline() for _ in range(3)]
        running.send_signal(signal.SIGINT)
        out, err = running.communicate(timeout=20)
    assert (running.returncode, err) == (0, "")
    *frames, last = map(json.loads, [*first, *out.splitlines()])
    assert 3 <= last["summary"]["frames"] == len(frames) < 3000


@pytest.mark.parametrize(("source", "more", "status", "text"), [
    (["none"], [], 1, "no such file or folder"),
    (["pairs/left"], [], 1, "no partner"),
    (["pairs/left/left_8.png"], [], 2, "its right one is missing"),
    (["both.avi", "pairs"], [], 2, "a source is of one kind"),
    (["camera:front"], [], 2, "as camera:0"),
    (["text.avi"], [], 1, "not a video"),
    (["both.avi", "both.avi", "both.avi"], [], 2, "one or two names"),
    (["both.avi"], ["--frames", "0"], 2, "at least 1"),
    (["both.avi"], ["-o", "text.avi"], 1, "need a folder"),
    (["both.avi"], ["--calibration", "none"], 1, "no such folder"),
    (["left.avi"], ["--disparities", "64"], 1, "too small"),
])
def test_mistakes(source, more, status, text, data, monkeypatch, capfd):
    monkeypatch.chdir(data)
    assert run(*stream(*source), *more) == status
    assert text in error_line(capfd)


def test_folders_without_pairs(tmp_path, capfd):
    (tmp_path/"left").mkdir()
    (tmp_path/"right").mkdir()
    assert run(*stream(tmp_path)) == 1
    assert "no pairs of images" in error_line(capfd)
    cv2.imwrite(str(tmp_path/"left"/"a.png"), np.zeros((40, 96), np.uint8))
    cv2.imwrite(str(tmp_path/"right"/"a.png"), np.zeros((40, 95), np.uint8))
    assert run(*stream(tmp_path)) == 1
    assert "a: the images must be of one size" in error_line(capfd)
