#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""From pictures of a board to metres: a made-up pair of cameras, calibrated, rectified, matched."""

import json
import re

import cv2
import numpy as np
import pytest

from litestereo.host_tools.cameras.board import make_board
from litestereo.host_tools.cameras.camera_info import read_camera_info
from litestereo.host_tools.cameras.find import find_board
from litestereo.host_tools.cameras.rectify import read_calibration
from litestereo.host_tools.core.images import read_grey
from support import rig
from support.command import error_line, run
from support.pairs import generator

PAIRS = 12


def noise(rng, width, height):
    """A picture to match by: blobs of some pixels."""
    picture = cv2.GaussianBlur(rng.integers(0, 256, (height, width)).astype(np.float32), (0, 0), 1.2)
    return cv2.normalize(picture, None, 10, 245, cv2.NORM_MINMAX).astype(np.uint8)


@pytest.fixture(scope="module")
def boards(tmp_path_factory):
    """Folder with left/ and right/ of a chessboard in twelve places."""
    folder, rng = tmp_path_factory.mktemp("boards"), generator(120)
    for number, (middle, degrees) in enumerate(rig.board_places(rng, PAIRS)):
        rig.take(folder, f"{number:02}", [rig.flat(rig.chessboard(), 12*rig.SQUARE_M, middle, degrees)])
    return folder


@pytest.fixture(scope="module")
def calibration(boards):
    """Folder with the cameras."""
    folder = boards/"calibration"
    assert run("calibrate", boards/"left", boards/"right", "--pattern", "chessboard", "9x6", "--square", rig.SQUARE_M,
               "-o", folder, "--json") == 0
    return folder


@pytest.fixture(scope="module")
def scene():
    """A plane with a box in front of it, of which two sides are seen."""
    rng   = generator(121)
    front = rig.flat(noise(rng, 300, 300), 0.3, np.array([0.16, 0.05, 0.8]), np.zeros(3))
    side  = rig.Surface(front.corner, np.array([0.02, 0, 0.3]), front.down, noise(rng, 300, 300))
    return [rig.flat(noise(rng, 2400, 1800), 2.4, np.array([0.05, 0, 1.25]), np.array([0, 20, 0])), front, side]


@pytest.fixture(scope="module")
def photos(boards, scene):
    """Files of the scene as the cameras take it."""
    return rig.take(boards/"scene", "scene", scene)


def test_the_cameras_come_back(calibration):
    left, right = (read_camera_info(calibration/name) for name in ("left.yaml", "right.yaml"))
    for camera, truth in zip((left, right), rig.cameras(), strict=True):
        assert camera.camera_matrix == pytest.approx(truth.matrix, rel=0.01)
        assert camera.distortion[:2] == pytest.approx(truth.distortion[:2], abs=0.06)
        assert camera.distortion[4] == 0
    geometry = read_calibration(calibration).geometry
    assert geometry.baseline_m == pytest.approx(rig.BASELINE_M, rel=0.003)
    assert geometry.focal_px == pytest.approx(rig.FOCAL_PX, rel=0.02)


def test_the_report(boards, capfd):
    arguments = ["calibrate", boards/"left", boards/"right", "--pattern", "chessboard", "9x6", "--square", 0.025, "-o",
                 boards/"report"]
    assert run(*arguments, "--json") == 0
    told = json.loads(capfd.readouterr().out)
    assert [pair["name"] for pair in told["pairs"]] == [f"{number:02}" for number in range(PAIRS)]
    assert 0 < told["epipolar_px"] < 0.1 and 0 < told["reprojection_px"] < 0.15
    assert all(0 < pair["epipolar_px"] < 0.2 and pair["corners"] == 54 for pair in told["pairs"])
    assert told["bad_pairs"] == []
    grids = read_calibration(boards/"report").pair.grids
    assert told["no_grid"] is None
    assert {name: told["grid"][name] for name in ("crc", "max_px", "rms_px", "rows", "delay_rows")} == {
        "crc": f"{grids.crc:08x}", "max_px": grids.error.max_px, "rms_px": grids.error.rms_px, "rows": grids.rows,
        "delay_rows": grids.delay_rows}
    assert "ulx3s" in told["grid"]["boards"] and "colorlight_i5" not in told["grid"]["boards"]
    assert run(*arguments) == 0
    out = capfd.readouterr().out
    for text in ("reprojection  0.0", "epipolar      0.0", "12 used, 12 in all", "baseline ", "left.yaml",
                 f"grid          {grids.crc:08x}, error {grids.error.max_px:.3f} pixels at most",
                 f"rows          {grids.rows} at once, delay {grids.delay_rows} rows",
                 f"boards        none has a rectifier yet; block RAM to spare for it: "
                 f"{', '.join(told['grid']['boards'])}"):
        assert text in out


@pytest.mark.parametrize("device", ["model:", "cosim:"])
def test_depth_in_metres(device, calibration, scene, photos, tmp_path, capfd):
    """Depth of every pixel but at edges, by the rays of the camera that made the picture."""
    assert run("match", *photos, "-o", tmp_path, "--device", device, "--calibration", calibration, "--speckle-window",
               100, "--speckle-range", 16, "--json") == 0
    summary   = json.loads(capfd.readouterr().out)
    depth     = np.load(tmp_path/"depth.npy")
    rectifier = read_calibration(calibration)
    truth     = true_depth(rectifier, scene)
    # A block that lies across an edge has no one depth.
    block     = np.ones((13, 13), np.uint8)
    smooth    = cv2.dilate(truth, block) - cv2.erode(truth, block) < 0.1
    compared  = smooth & np.isfinite(depth)
    errors    = np.abs(depth[compared]/truth[compared] - 1)
    assert compared.sum() > 0.6*depth.size and truth[compared].min() < 0.85 and truth[compared].max() > 1.4
    assert np.mean(errors) < 0.004 and np.mean(errors < 0.01) > 0.97
    for part in (truth < 0.81, truth > 1):
        assert np.median(depth[compared & part]/truth[compared & part]) == pytest.approx(1, abs=0.005)
    assert summary["depth_m"]["median"] == pytest.approx(np.nanmedian(depth))
    assert [name.rsplit("/", 1)[1] for name in summary["files"][-2:]] == ["depth.npy", "cloud.ply"]
    # The cloud is the same depth, with the grey of the rectified image.
    head, data = (tmp_path/"cloud.ply").read_bytes().split(b"end_header\n", 1)
    vertices   = np.frombuffer(data, [("xyz", "<f4", 3), ("rgb", "u1", 3)])
    known      = np.isfinite(depth)
    assert b"element vertex %d\n" % known.sum() in head
    assert vertices["xyz"][:, 2] == pytest.approx(depth[known])
    left = read_grey(photos[0])[0]
    assert np.array_equal(vertices["rgb"][:, 1], rectifier.rectify(left, left)[0][known])
    rows, columns = np.nonzero(known)
    geometry      = rectifier.geometry
    assert vertices["xyz"][:, 0] == pytest.approx((columns - geometry.cx_left_px)*depth[known]/geometry.focal_px,
                                                  abs=1e-5)


def true_depth(rectifier, scene):
    """Depth of the rectified left image's pixels in metres, traced through its pixels."""
    geometry      = rectifier.geometry
    rows, columns = np.indices((geometry.height, geometry.width))
    rays          = np.stack([(columns - geometry.cx_left_px)/geometry.focal_px,
                              (rows - geometry.cy_px)/geometry.focal_px, np.ones(rows.shape)], -1).reshape(-1, 3)
    left          = rig.cameras()[0]
    rotated       = rays @ rectifier.cameras[0].rectification @ left.rotation.T
    return rig.trace(left.place, rotated, scene)[1].reshape(rows.shape).astype(np.float32)


def test_rectified_rows_are_the_same_rows(calibration, boards, tmp_path, capfd):
    """Corners of a board are in the same rows, and `match` takes what `rectify` writes."""
    assert run("rectify", boards/"left", boards/"right", "--calibration", calibration, "-o", tmp_path) == 0
    assert capfd.readouterr().out.count("wrote") == 2*PAIRS + 2
    board = make_board("chessboard", "9x6", 0.025)
    pair  = find_board("", *(read_grey(tmp_path/side/"03.png")[0] for side in ("left", "right")), board)
    assert np.abs(pair.left_px[:, 1] - pair.right_px[:, 1]).max() < 0.3
    assert (pair.left_px[:, 0] - pair.right_px[:, 0]).min() > 20
    again = read_calibration(tmp_path)
    assert again.geometry == pytest.approx(read_calibration(calibration).geometry)
    image = read_grey(tmp_path/"left"/"03.png")[0]
    assert np.array_equal(again.rectify(image, image)[0], image)


def test_rectify_keeps_colour_and_depth(calibration, photos, tmp_path):
    image = cv2.imread(str(photos[0]), cv2.IMREAD_GRAYSCALE)
    cv2.imwrite(str(tmp_path/"a.png"), np.dstack([image, image//2, image//4]).astype(np.uint16)*256)
    assert run("rectify", tmp_path/"a.png", photos[1], "--calibration", calibration, "-o", tmp_path/"out") == 0
    assert cv2.imread(str(tmp_path/"out"/"left.png"), cv2.IMREAD_UNCHANGED).dtype == np.uint16
    assert cv2.imread(str(tmp_path/"out"/"left.png"), cv2.IMREAD_UNCHANGED).ndim == 3
    assert cv2.imread(str(tmp_path/"out"/"right.png"), cv2.IMREAD_UNCHANGED).ndim == 2


def test_the_command_names_bad_pairs(boards, tmp_path, capfd):
    """A pair without the board, and one of another size; the others are used."""
    for number in range(6):
        for side in ("left", "right"):
            image = cv2.imread(str(boards/side/f"{number:02}.png"))
            image = np.zeros_like(image) if number == 2 and side == "right" else image
            image = cv2.resize(image, None, fx=1.5, fy=1.5) if number == 3 else image
            (tmp_path/side).mkdir(exist_ok=True)
            cv2.imwrite(str(tmp_path/side/f"{side}{number}.png"), image)
    assert run("calibrate", tmp_path/"left", tmp_path/"right", "--pattern", "chessboard", "9x6", "--square", 0.025,
               "-o", tmp_path/"out") == 0
    out = capfd.readouterr().out
    assert "bad pair      2: pattern not found in the right image" in out
    assert "bad pair      3: is 720x540 pixels, others are 480x360" in out
    assert "4 used, 6 in all" in out


def test_mistakes_of_calibrate(boards, tmp_path, capfd):
    common = ["--pattern", "chessboard", "9x6", "--square", 0.025, "-o", tmp_path/"out"]
    (tmp_path/"left").mkdir()
    (tmp_path/"file").write_text("")
    cv2.imwrite(str(tmp_path/"left"/"lone.png"), np.zeros((9, 9), np.uint8))
    # Few pairs: a board that is not there is searched for seconds.
    for side in ("left", "right"):
        (tmp_path/"few"/side).mkdir(parents=True)
        (tmp_path/"few"/side/"00.png").write_bytes((boards/side/"00.png").read_bytes())
    for arguments, status, text in (
        ([boards/"left", boards/"none", *common], 1, "no such folder"),
        ([boards/"left", tmp_path/"left", *common], 1, "no partner"),
        ([boards/"left", boards/"right", "--square", 0.025, "-o", tmp_path/"out"], 2, "--pattern"),
        ([boards/"left", boards/"right", *common[:3], "--square", 25, "-o", tmp_path/"out"], 2, "metres"),
        ([tmp_path/"few"/"left", tmp_path/"few"/"right", *common, "--pattern", "chessboard", "10x7"], 1,
         "counts inner corners"),
        ([boards/"left", boards/"right", *common[:-1], tmp_path/"file"], 1, "need a folder"),
        ([boards/"left", boards/"right", *common, "--alpha", 2], 2, "from 0 to 1"),
    ):
        assert run("calibrate", *arguments) == status
        assert text in error_line(capfd)
    assert not (tmp_path/"out").exists()


@pytest.mark.parametrize(("old", "new", "text"), [
    (r"(?<=camera_matrix:\n  rows: 3\n  cols: 3\n  data: )\[[^]]*\]", "[0, 0, 0, 0, 0, 0, 0, 0, 0]", "not calibrated"),
    (r"distortion_model: plumb_bob", "distortion_model: equidistant", "has 5 numbers"),
    (r"(?<=rectification_matrix:\n  rows: 3\n  cols: 3\n  data: )\[[^]]*\]", "[1, 0, 0, 0, 1, 0, 0, 0, -1]",
     "is no rotation"),
    (r"(?<=cols: 5\n  data: )\[[^]]*\]", "[-5, 0, 0, 0, 0]", "fold the image"),
    (r"(?s).*", "["*500, "not a YAML file"),
])
def test_every_command_checks_the_cameras(calibration, photos, tmp_path, old, new, text, capfd):
    """One line of each command that takes cameras, and no file."""
    for name in ("left.yaml", "right.yaml"):
        written = (calibration/name).read_text()
        changed = re.sub(old, new, yaml_blocks(written), count=1) if name == "left.yaml" else written
        (tmp_path/"cal").mkdir(exist_ok=True)
        (tmp_path/"cal"/name).write_text(changed)
    disparity = np.full((rig.HEIGHT, rig.WIDTH), -16, np.int16)
    disparity[10:-10, 80:-10] = 160
    np.save(tmp_path/"map.npy", disparity)
    cameras = ["--calibration", tmp_path/"cal", "-o", tmp_path/"out"]
    for arguments in (["match", *photos, "--device", "model:"], ["rectify", *photos],
                      ["stream", photos[0].parent, photos[1].parent, "--device", "model:"],
                      ["export", tmp_path/"map.npy", "--format", "depth-npy"]):
        assert run(*arguments, *cameras) == 1, arguments
        assert text in error_line(capfd)
    assert not (tmp_path/"out").exists()


def yaml_blocks(text):
    """A camera_info with each matrix in four lines, as camera_calibration writes it."""
    return re.sub(r"(\w+): \{rows: (\d), cols: (\d+), data: (\[[^]]*\])\}",
                  r"\1:\n  rows: \2\n  cols: \3\n  data: \4", text)


@pytest.mark.parametrize("prefix", ["left right", "left- right-", "Left_ Right_"])
def test_one_folder_with_both_sides(boards, calibration, tmp_path, prefix, capfd):
    """As ROS's calibrationdata.tar.gz and OpenCV's samples lie: the same cameras, named once or twice."""
    for number in range(PAIRS):
        for side, start in zip(("left", "right"), prefix.split(), strict=True):
            name = f"{start}{number:02}.png"
            (tmp_path/name).write_bytes((boards/side/f"{number:02}.png").read_bytes())
    common = ["--pattern", "chessboard", "9x6", "--square", 0.025, "-o", tmp_path/"out"]
    for folders in ([tmp_path], [tmp_path, tmp_path]):
        assert run("calibrate", *folders, *common, "--json") == 0
        assert len(json.loads(capfd.readouterr().out)["pairs"]) == PAIRS
        again = read_calibration(tmp_path/"out").geometry
        assert again.baseline_m == pytest.approx(read_calibration(calibration).geometry.baseline_m, rel=1e-6)


def test_a_picture_is_no_pair_with_itself(boards, tmp_path, capfd):
    """One folder twice, by its name, by a link, by links of its files."""
    (tmp_path/"link").symlink_to(boards/"left")
    (tmp_path/"hard").mkdir()
    for path in (boards/"left").iterdir():
        (tmp_path/"hard"/path.name).hardlink_to(path)
    common = ["--pattern", "chessboard", "9x6", "--square", 0.025, "-o", tmp_path/"out"]
    for right in (boards/"left", boards/"left"/".."/"left", tmp_path/"link", tmp_path/"hard"):
        assert run("calibrate", boards/"left", right, *common) == 1
        error_line(capfd)
    assert run("calibrate", boards/"left", *common) == 1
    error_line(capfd)
    assert not (tmp_path/"out").exists()


@pytest.mark.parametrize(("change", "text"), [
    ("swap", "swap the two folders"), ("same", "of one camera"), ("rotate", "one camera is rotated by 180 degrees"),
    ("shift", "at the same moment"), ("once", "in one place"), ("limit", "--max-error"),
])
def test_nothing_is_written_after_an_error(boards, tmp_path, change, text, capfd):
    """No folder, and files of an earlier calibration stay."""
    for number in range(6):
        left, right = (cv2.imread(str(boards/side/f"{number:02}.png")) for side in ("left", "right"))
        later       = cv2.imread(str(boards/"right"/f"{(number + 1) % 6:02}.png"))
        first       = [cv2.imread(str(boards/side/"00.png")) for side in ("left", "right")]
        pair        = {"swap": (right, left), "same": (left, left.copy()), "rotate": (left, right[::-1, ::-1]),
                       "shift": (left, later), "once": first, "limit": (left, right)}[change]
        for side, image in zip(("left", "right"), pair, strict=True):
            (tmp_path/side).mkdir(exist_ok=True)
            cv2.imwrite(str(tmp_path/side/f"{number}.png"), image)
    (tmp_path/"old").mkdir()
    (tmp_path/"old"/"left.yaml").write_text("old")
    for out in ("new", "old"):
        limit = ["--max-error", "0.001"] if change == "limit" else []
        assert run("calibrate", tmp_path/"left", tmp_path/"right", "--pattern", "chessboard", "9x6", "--square", 0.025,
                   "--keep-all", *limit, "--force", "-o", tmp_path/out) == 1
        assert text in error_line(capfd)
    assert not (tmp_path/"new").exists()
    assert [path.name for path in (tmp_path/"old").iterdir()] == ["left.yaml"]
    assert (tmp_path/"old"/"left.yaml").read_text() == "old"


def test_the_hint_at_older_boards(tmp_path, capfd):
    """ChArUco boards of calib.io, with the names of OpenCV: a hint first, then cameras."""
    markers = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_100)
    board   = cv2.aruco.CharucoBoard((6, 4), 0.05, 0.0375, markers)
    board.setLegacyPattern(True)
    picture = board.generateImage((960, 640))
    for number, (middle, degrees) in enumerate(rig.board_places(generator(126), 6)):
        rig.take(tmp_path, f"{number}", [rig.flat(picture, 0.3, middle, degrees)])
    arguments = ["calibrate", tmp_path/"left", tmp_path/"right", "--pattern", "charuco", "6x4", "--square", 0.05,
                 "--dictionary", "DICT_5X5_100", "-o", tmp_path/"out"]
    capfd.readouterr()
    assert run(*arguments) == 1
    assert "try --legacy" in error_line(capfd)
    assert run(*arguments, "--legacy") == 0
    assert read_calibration(tmp_path/"out").geometry.baseline_m == pytest.approx(rig.BASELINE_M, rel=0.01)


def test_mistakes_of_rectify_and_match(boards, photos, calibration, tmp_path, capfd):
    small = tmp_path/"small.png"
    cv2.imwrite(str(small), np.zeros((90, 160), np.uint8))
    for calibrated, left, text in ((tmp_path/"none", photos[0], "no such folder"),
                                   (boards/"left", photos[0], "left.yaml: there is no such file"),
                                   (calibration, small, "160x90 pixels, the calibration is for 480x360")):
        right = photos[1] if left == photos[0] else small
        assert run("rectify", left, right, "--calibration", calibrated, "-o", tmp_path/"out") == 1
        assert text in error_line(capfd)
        assert run("match", left, right, "--calibration", calibrated, "-o", tmp_path/"out", "--device", "model:") == 1
        assert text in error_line(capfd)
    assert run("rectify", boards/"left", photos[1], "--calibration", calibration, "-o", tmp_path/"out") == 1
    assert "two images, or two folders" in error_line(capfd)
    assert run("rectify", *photos, "-o", tmp_path/"out") == 2
    assert "--calibration" in error_line(capfd)
