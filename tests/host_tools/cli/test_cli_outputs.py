#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""No command replaces a file that it reads, or one of another kind; reruns are fine, and --force replaces."""

import shutil

import cv2
import numpy as np
import pytest

from litestereo.host_tools.cameras.camera_info import ideal_cameras, read_camera_info, write_camera_info
from litestereo.host_tools.cameras.rectify import FILES
from litestereo.host_tools.core.geometry import StereoGeometry
from litestereo.host_tools.core.images import write_disparity
from litestereo.host_tools.core.settings import MatcherSettings
from support import rig
from support.command import error_line, run
from support.data_sets import write
from support.expected import expected_map
from support.pairs import generator, textured_pair

SMALL    = ["--device", "model:", "--disparities", 16]
GEOMETRY = StereoGeometry(96, 40, 100.0, 0.06, 48.0, 20.0, 48.0)


@pytest.fixture(autouse=True)
def no_device_in_the_environment(monkeypatch):
    monkeypatch.delenv("LITESTEREO_DEVICE", raising=False)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A pair by the names of results, pairs in folders, a calibration, a map and a data set."""
    left, right = textured_pair(96, 40, generator(250), 5)
    for place in (tmp_path, tmp_path/"teddy"):
        write(place, {"left.png": left, "right.png": right})
    for side, image in (("left", left), ("right", right)):
        write(tmp_path/"set"/side, {"01.png": image})
    write(tmp_path/"teddy", {"disp_left_u16.png": np.full(left.shape, 256*5, np.uint16)})
    for name, camera in zip(FILES, ideal_cameras(GEOMETRY), strict=True):
        write_camera_info(tmp_path/"cal"/name, camera)
    write_disparity(tmp_path/"map", expected_map(left, right, MatcherSettings(16)), MatcherSettings(16))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def contents(folder_):
    return {path.relative_to(folder_): path.read_bytes() for path in folder_.rglob("*") if path.is_file()}


#: Commands of which a result would replace an input.
OVER_INPUTS = [
    ["rectify", "left.png", "right.png", "--calibration", "cal", "-o", "cal"],
    ["rectify", "left.png", "right.png", "--calibration", "cal", "-o", "."],
    ["rectify", "set/left", "set/right", "--calibration", "cal", "-o", "set"],
    ["rectify", "set", "set", "--calibration", "cal", "-o", "set/../set"],
    ["export", "map/disparity.png", "-o", "map", "--format", "png"],
    ["export", "map/disparity.pfm", "-o", "map", "--format", "png", "--format", "pfm"],
    ["export", "map/disparity.npy", "-o", "map", "--format", "depth-png", "--left", "map/depth.png", "--focal", 9,
     "--baseline", 1],
    ["match", "map/disparity_color.png", "right.png", "-o", "map", *SMALL],
    ["match", "left.png", "right.png", "-o", "map", "--ground-truth", "map/disparity.png", *SMALL],
    ["match", "left.png", "right.png", "-o", "map", "--ground-truth", "map/disparity.pfm", *SMALL],
    ["stream", "map/disparity_0.png", "right.png", "-o", "map", *SMALL],
    ["view", "left.png", "right.png", "--montage", "left.png", *SMALL],
    ["view", "set", "--montage", "set/right/01.png", *SMALL],
    ["view", "left.png", "right.png", "--montage", "cal/left.yaml", "--calibration", "cal", *SMALL],
    ["eval", "teddy", "--csv", "teddy/left.png", *SMALL],
    ["eval", "teddy", "--csv", "teddy/calib.txt", *SMALL],
]


@pytest.mark.parametrize("arguments", OVER_INPUTS, ids=lambda arguments: " ".join(map(str, arguments)))
def test_an_input_is_not_replaced(arguments, folder, capfd):
    shutil.copy(folder/"left.png", folder/"map"/"depth.png")
    if "stream" in arguments:
        # A single pair is called by its left image: its map would be this file.
        shutil.copy(folder/"left.png", folder/"map"/"disparity_disparity_0.png")
        (folder/"map"/"disparity_0.png").symlink_to("disparity_disparity_0.png")
    if "teddy/calib.txt" in arguments:
        camera = "[99 0 48; 0 99 20; 0 0 1]"
        (folder/"teddy"/"calib.txt").write_text(f"cam0={camera}\ncam1={camera}\nwidth=96\nheight=40\nbaseline=100\n"
                                                "ndisp=16\n")
    before = contents(folder)
    assert run(*arguments) == 1
    assert "is an input of this command" in error_line(capfd)
    assert contents(folder) == before


def test_force_replaces_inputs(folder):
    assert run("rectify", "set/left", "set/right", "--calibration", "cal", "-o", "set", "--force") == 0
    assert run("export", "map/disparity.png", "-o", "map", "--format", "png", "--force") == 0
    assert run("view", "left.png", "right.png", "--montage", "left.png", "--force", *SMALL) == 0
    assert cv2.imread("left.png").shape == (2*40 + 2*24, 192, 3)


#: Commands, and results of theirs.
COMMANDS = [
    (["match", "left.png", "right.png", "-o", "out", "--calibration", "cal", *SMALL],
     ["disparity.npy", "disparity.pfm", "disparity.png", "disparity_color.png", "depth.npy", "cloud.ply"]),
    (["rectify", "left.png", "right.png", "-o", "out", "--calibration", "cal"],
     ["left.png", "right.png", "left.yaml", "right.yaml"]),
    (["rectify", "set/left", "set/right", "-o", "out", "--calibration", "cal"],
     ["left/01.png", "right/01.png", "left.yaml"]),
    (["stream", "set", "-o", "out", "--calibration", "cal", *SMALL], ["disparity_01.png", "depth_01.npy"]),
    (["stream", "set", "-o", "out", "--format", "npy", *SMALL], ["disparity_01.npy"]),
    (["stream", "set", "-o", "out", "--format", "pfm", *SMALL], ["disparity_01.pfm"]),
    (["export", "map/disparity.npy", "-o", "out", *sum((["--format", name] for name in (
        "pfm", "png", "depth-npy", "depth-png", "ply")), []), "--focal", 100, "--baseline", 0.1],
     ["disparity.pfm", "disparity.png", "depth.npy", "depth.png", "cloud.ply"]),
    (["view", "set", "--montage", "out/still.png", *SMALL], ["still.png"]),
    (["view", "set", "--save", "out/still.rrd", *SMALL], ["still.rrd"]),
    (["eval", "teddy", "--csv", "out/table.csv", *SMALL], ["table.csv"]),
]


@pytest.mark.parametrize(("arguments", "results"), COMMANDS, ids=lambda words: " ".join(map(str, words[:3])))
def test_reruns_and_files_of_another_kind(arguments, results, folder, capfd):
    """At first a photo is where one of the results is to be: nothing at all is written. Then all are, and again."""
    if "--save" in arguments:
        pytest.importorskip("rerun", reason="Rerun is in the extra `view`")
    for result in results:
        for photo in ("left.png", "teddy/disp_left_u16.png"):
            (folder/"out"/result).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(folder/photo, folder/"out"/result)
            before = contents(folder)
            assert run(*arguments) == 1, result
            assert f"out/{result}: is there already" in error_line(capfd)
            assert contents(folder) == before
        (folder/"out"/result).unlink()
    shutil.copy(folder/"left.png", folder/"out"/results[0])
    assert run(*arguments, "--force") == 0
    written = contents(folder)
    assert all((folder/"out"/result).stat().st_size for result in results)
    assert run(*arguments) == 0
    assert contents(folder).keys() == written.keys()
    assert not any(path.suffix == ".part" for path in folder.rglob("*"))


def test_two_results_of_one_name(folder, capfd):
    pytest.importorskip("rerun", reason="Rerun is in the extra `view`")
    for more in ([], ["--force"]):
        assert run("view", "set", "--montage", "x.png", "--save", "./x.png", *SMALL, *more) == 1
        assert "two results" in error_line(capfd)


def test_a_calibration_is_not_replaced_by_cameras_of_rectified_images(folder, tmp_path, capfd):
    """Nor the other way round; a calibration by a newer one is."""
    boards = rig.board_places(generator(251), 6)
    for number, (middle, degrees) in enumerate(boards):
        rig.take(tmp_path/"boards", f"{number:02}", [rig.flat(rig.chessboard(), 12*0.025, middle, degrees/2)])
    words = ["calibrate", "boards/left", "boards/right", "--pattern", "chessboard", "9x6", "--square", 0.025, "-o"]
    assert run(*words, "real") == 0
    assert run(*words, "real") == 0
    real = contents(folder/"real")
    capfd.readouterr()
    assert run("rectify", "left.png", "right.png", "--calibration", "cal", "-o", "real") == 1
    assert "real/left.yaml: is there already" in error_line(capfd)
    assert run(*words, "cal") == 1
    assert "cal/left.yaml: is there already" in error_line(capfd)
    assert contents(folder/"real") == real
    # One folder given twice has both sides in it.
    both = folder/"all"
    both.mkdir()
    for side in ("left", "right"):
        for path in (folder/"boards"/side).iterdir():
            shutil.copy(path, both/f"{side}-{path.name}")
    assert run("calibrate", both, both, *words[3:], "one") == 0
    cameras = [[read_camera_info(folder/name/file).projection for file in FILES] for name in ("real", "one")]
    assert np.allclose(cameras[0], cameras[1])


@pytest.mark.parametrize("command", ["match", "rectify", "stream", "view"])
def test_an_image_is_not_matched_with_itself(command, folder, capfd):
    (folder/"link.png").symlink_to("left.png")
    more = {"rectify": ["--calibration", "cal", "-o", "out"], "match": ["-o", "out", *SMALL],
            "view": ["--montage", "m.png", *SMALL]}.get(command, SMALL)
    for second in ("left.png", "link.png", "set/../left.png"):
        assert run(command, "left.png", second, *more) == 1
        assert "left and right image at the same time" in error_line(capfd)
        assert not (folder/"out").exists()


@pytest.mark.parametrize("arguments", [arguments for arguments, _ in COMMANDS if "--save" not in arguments],
                         ids=lambda words: " ".join(map(str, words[:3])))
def test_a_name_that_is_too_long(arguments, folder, capfd):
    words = [str(word).replace("out", "o"*300) for word in arguments]
    assert run(*words) == 1
    assert "File name too long" in error_line(capfd)
