#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""`litestereo view`: what is in a recording when it is loaded again, viewers over the network, and stills."""

import json
import signal
import socket
import subprocess
import sys
import urllib.request

import cv2
import numpy as np
import pytest

from litestereo.host_tools.cameras.camera_info import ideal_cameras, write_camera_info
from litestereo.host_tools.cameras.rectify import FILES
from litestereo.host_tools.core.extras import install_command
from litestereo.host_tools.core.geometry import StereoGeometry
from litestereo.host_tools.core.images import color_image
from litestereo.host_tools.core.settings import MatcherSettings
from support.command import error_line, run
from support.expected import expected_map
from support.interruptible import interruptible
from support.pairs import generator, textured_pair

rerun = pytest.importorskip("rerun", reason="Rerun is in the extra `view`")

COMMAND  = [sys.executable, "-c", "import sys; from litestereo.host_tools.cli import main; sys.exit(main())"]
SETTINGS = MatcherSettings(16, 9)
GEOMETRY = StereoGeometry(96, 40, 100.0, 0.06, 48.0, 20.0, 48.0)
FRAMES   = 4


@pytest.fixture(autouse=True)
def no_device_in_the_environment(monkeypatch):
    monkeypatch.delenv("LITESTEREO_DEVICE", raising=False)


@pytest.fixture(scope="module")
def images():
    rng = generator(140)
    return [textured_pair(96, 40, rng, shift) for shift in range(4, 4 + FRAMES)]


@pytest.fixture(scope="module")
def data(tmp_path_factory, images):
    """The pairs, and a calibration that leaves them as they are."""
    folder = tmp_path_factory.mktemp("view")
    for side, name in enumerate(("left", "right")):
        (folder/name).mkdir()
        for number, pair in enumerate(images):
            cv2.imwrite(str(folder/name/f"{number}.png"), pair[side])
    for name, camera in zip(FILES, ideal_cameras(GEOMETRY), strict=True):
        write_camera_info(folder/"calibration"/name, camera)
    return folder


def view(folder, *more):
    return ["view", folder/"left", folder/"right", "--device", "model:", "--disparities", 16, *more]


def loaded(path):
    """Rows of a recording: by entity and component, the values by their frames."""
    from rerun.chunk import RrdReader

    reader = RrdReader(path)
    assert [(entry.kind, entry.application_id) for entry in reader.recordings()] == [("recording", "litestereo")]
    rows   = {}
    for chunk in reader.stream():
        batch = chunk.to_record_batch()
        if "frame" not in batch.schema.names:
            continue
        assert "taken" in batch.schema.names
        frames = batch.column("frame").to_pylist()
        for name in set(batch.schema.names) - {"frame", "taken", "log_time", "rerun.controls.RowId"}:
            values = batch.column(name).to_pylist()
            rows.setdefault((chunk.entity_path, name), {}).update(zip(frames, values, strict=True))
    return rows


def test_a_recording_holds_every_frame(data, images, tmp_path, capfd):
    assert run(*view(data, "--save", tmp_path/"new"/"out.rrd", "--calibration", data/"calibration")) == 0
    out, err = capfd.readouterr()
    assert err == "" and f"frames   {FRAMES} in" in out and "out.rrd" in out
    rows = loaded(tmp_path/"new"/"out.rrd")
    for entity, name in (("/left", "Image:buffer"), ("/right", "Image:buffer"), ("/disparity", "Image:buffer"),
                         ("/depth", "DepthImage:buffer"), ("/world/points", "Points3D:positions"),
                         ("/world/points", "Points3D:colors"), ("/rate/recent_frames_per_s", "Scalars:scalars"),
                         ("/rate/latency_ms", "Scalars:scalars")):
        assert sorted(rows[entity, name]) == list(range(FRAMES)), (entity, name)
    for number, (left, right) in enumerate(images):
        map_  = expected_map(left, right, SETTINGS)
        valid = map_ > SETTINGS.invalid
        for entity, image in (("/left", left), ("/right", right), ("/disparity", color_image(map_, SETTINGS))):
            assert bytes(rows[entity, "Image:buffer"][number][0]) == image.tobytes()
        depth = np.frombuffer(bytes(rows["/depth", "DepthImage:buffer"][number][0]), np.float32).reshape(40, 96)
        known = valid & (map_ > 0)
        assert np.array_equal(depth > 0, known)
        assert depth[known] == pytest.approx(100*0.06*16/map_[known], rel=1e-5)
        points = np.array(rows["/world/points", "Points3D:positions"][number])
        assert points[:, 2] == pytest.approx(depth[known]) and len(points) == known.sum() > 1000


def test_without_a_calibration_there_is_no_depth(data, tmp_path):
    assert run(*view(data, "--save", tmp_path/"out.rrd", "--frames", 2)) == 0
    rows = loaded(tmp_path/"out.rrd")
    assert sorted(rows["/left", "Image:buffer"]) == [0, 1]
    assert not [entity for entity, _ in rows if "depth" in entity or "points" in entity]


def test_a_recording_ends_well_at_an_error(data, tmp_path, capfd):
    """The third pair is damaged: the two before it are there."""
    for side in ("left", "right"):
        (tmp_path/side).mkdir()
        for number in range(3):
            content = (data/side/f"{number}.png").read_bytes()
            (tmp_path/side/f"{number}.png").write_bytes(content if number < 2 else content[:2000])
    assert run(*view(tmp_path, "--save", tmp_path/"out.rrd")) == 1
    assert "left/2.png: is not an image" in error_line(capfd)
    assert sorted(loaded(tmp_path/"out.rrd")["/left", "Image:buffer"]) == [0, 1]


def test_most_points_of_a_cloud(data, tmp_path):
    assert run(*view(data, "--save", tmp_path/"out.rrd", "--calibration", data/"calibration", "--max-points", 100)) == 0
    counts = [len(points) for points in loaded(tmp_path/"out.rrd")["/world/points", "Points3D:positions"].values()]
    assert 50 < min(counts) <= max(counts) <= 100


@pytest.mark.parametrize("calibrated", [False, True])
def test_montage(calibrated, data, images, tmp_path, monkeypatch, capfd):
    """The last frame, for people without Rerun."""
    monkeypatch.setitem(sys.modules, "rerun", None)
    more = ["--calibration", data/"calibration"] if calibrated else []
    assert run(*view(data, "--montage", tmp_path/"out.png", "--json", *more)) == 0
    summary = json.loads(capfd.readouterr().out)
    assert summary["frames"] == FRAMES and summary["files"] == [str(tmp_path/"out.png")]
    picture   = cv2.imread(str(tmp_path/"out.png"))
    left, right = images[-1]
    assert picture.shape == (2*(40 + 24), 2*96, 3)
    assert np.array_equal(picture[24:64, :96, 0], left) and np.array_equal(picture[24:64, 96:, 2], right)
    assert np.array_equal(picture[88:, :96], color_image(expected_map(left, right, SETTINGS), SETTINGS))
    assert picture[88:, 96:].any() == calibrated


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as server:
        return server.getsockname()[1]


def test_a_viewer_that_runs(data):
    """What is sent to a viewer arrives: here at the SDK's own server."""
    port   = free_port()
    server = rerun.RecordingStream("server")
    url    = server.serve_grpc(grpc_port=port)
    assert run(*view(data, "--connect", url)) == 0
    server.disconnect()


def test_browsers_are_served_until_ctrl_c(data):
    port = free_port()
    with interruptible([*COMMAND, *map(str, view(data, "--serve", port))], stdout=subprocess.PIPE,
                       stderr=subprocess.PIPE) as running:
        note = running.stderr.readline()
        assert f"http://127.0.0.1:{port + 1}/" in note
        with urllib.request.urlopen(f"http://127.0.0.1:{port + 1}/", timeout=10) as page:
            assert page.status == 200 and b"html" in page.read(2000).lower()
        running.send_signal(signal.SIGINT)
        out, _ = running.communicate(timeout=20)
    assert running.returncode == 0 and "frames   " in out


@pytest.mark.parametrize(("more", "status", "text"), [
    (["--connect", "rerun+http://127.0.0.1:1/proxy"], 1, "no viewer listens at 127.0.0.1:1"),
    (["--connect", "localhost"], 1, "not the URL of a viewer"),
    (["--connect", "rerun+http://[1.2.3.4]:1"], 1, "not the URL of a viewer"),
    (["--save", "left/0.png/out.rrd"], 1, "cannot be written"),
    (["--montage", "left/0.png/out.png"], 1, "cannot be written"),
    (["--save", "a.rrd", "--serve"], 2, "not allowed with"),
    (["--serve", "70000"], 2, "at most 65534"),
    (["--calibration", "left"], 1, "no such file"),
])
def test_mistakes(more, status, text, data, monkeypatch, capfd):
    monkeypatch.chdir(data)
    assert run(*view(data, *more)) == status
    assert text in error_line(capfd)


def test_no_display_and_no_rerun(data, monkeypatch, capfd):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setattr(sys, "platform", "linux")
    assert run(*view(data)) == 1
    assert "no display" in error_line(capfd)
    monkeypatch.setitem(sys.modules, "rerun", None)
    assert run(*view(data)) == 1
    assert error_line(capfd).endswith(f"not installed: {install_command('view')}\n")


def test_a_recording_without_frames_does_not_replace_an_older_one(data, tmp_path, capfd):
    """The first pair is damaged: what was recorded before is still there."""
    assert run(*view(data, "--save", tmp_path/"out.rrd", "--frames", 2)) == 0
    for side in ("left", "right"):
        (tmp_path/side).mkdir()
        (tmp_path/side/"0.png").write_bytes((data/side/"0.png").read_bytes()[:2000])
    capfd.readouterr()
    assert run(*view(tmp_path, "--save", tmp_path/"out.rrd", "--calibration", data/"calibration")) == 1
    assert "is not an image" in error_line(capfd)
    assert sorted(loaded(tmp_path/"out.rrd")["/left", "Image:buffer"]) == [0, 1]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["left", "out.rrd", "right"]
