#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Pictures are those of cv2.imread, in all formats, depths and orientations."""

import subprocess
import sys
import time

import cv2
import numpy as np
import pytest

from litestereo.host_tools.cameras.camera_info import ideal_cameras, write_camera_info
from litestereo.host_tools.core import MAX_PIXELS, images
from litestereo.host_tools.core.errors import ImageError
from litestereo.host_tools.core.geometry import StereoGeometry
from litestereo.host_tools.core.images import read_colour, read_grey, read_picture, summed_notices
from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.host_tools.evaluation.matchers import OpenCVMatcher
from support.command import error_line, run
from support.data import FOLDERS, stereo_folder
from support.images import GREY, RGBA, exif, image_files, png, with_orientation
from support.pairs import generator, textured_pair

NAMES = sorted(image_files())


@pytest.mark.parametrize("name", NAMES)
def test_pictures_are_those_of_imread(name, tmp_path, capfd):
    for salt, (width, height) in enumerate([(24, 10), (8, 33), (40, 40)]):
        path = tmp_path / name
        path.write_bytes(image_files(width, height, salt)[name])
        expected      = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
        colour        = cv2.imread(str(path))
        capfd.readouterr()
        grey, notices = read_grey(path)
        assert grey.dtype == np.uint8 and np.array_equal(grey, expected)
        assert np.array_equal(read_colour(path), colour)
        picture, _ = read_picture(path)
        assert picture.shape[:2] == grey.shape
        assert picture.dtype == (np.uint16 if "deep" in name or "16" in name else np.uint8)
        assert capfd.readouterr().err == ""
        told = {word for word in ("rotated", "16-bit", "colour image") if any(word in notice for notice in notices)}
        turned = any(f"_{number}." in name for number in range(2, 9))
        assert sum("rotated" in notice for notice in notices) == turned, notices
        assert ("16-bit" in told) == (picture.dtype == np.uint16)
        if name.startswith("colour"):
            assert "colour image" in told
        assert all(notice.startswith(f"{path}: ") and notice.isprintable() for notice in notices)


@pytest.mark.parametrize("orientation", range(1, 9))
@pytest.mark.parametrize("kind", ["jpg", "png"])
def test_an_orientation_is_followed_by_hand(orientation, kind, tmp_path):
    """As the EXIF standard has it: row and column 0 of the file are these sides of the picture."""
    stored = np.zeros((32, 64), np.uint8)
    stored[:16, :32] = 255 # The corner that is stored first.
    stored[:16, 32:] = 128
    path   = tmp_path / f"a.{kind}"
    path.write_bytes(with_orientation(cv2.imencode(f".{kind}", stored)[1].tobytes(), orientation))
    turned = {1: stored, 2: stored[:, ::-1], 3: stored[::-1, ::-1], 4: stored[::-1], 5: stored.T,
              6: np.rot90(stored, -1), 7: stored[::-1, ::-1].T, 8: np.rot90(stored)}[orientation]
    for found in (read_grey(path)[0], read_colour(path)[:, :, 1], read_picture(path)[0]):
        assert found.shape == turned.shape
        assert np.abs(found.astype(int) - turned).max() < 12


def test_a_tiff_says_its_orientation(tmp_path):
    for orientation in range(1, 5):
        path = tmp_path / "a.tiff"
        path.write_bytes(image_files()[f"colour_{orientation}.tiff"])
        assert sum("orientation" in notice for notice in read_grey(path)[1]) == (orientation > 1)
    for data in (b"II*\0", b"MM\0*\0\0\0\x08", b"II*\0\xff\xff\xff\xff", exif(3)[:-8],
                 b"MM\0*\0\0\0\x08\0\x01" + bytes(11)):
        assert images._tiff_orientation(data) in (1, 3)
    assert images._tiff_orientation(exif(6)) == 6 and images._tiff_orientation(exif(9)) == 1


def test_rectify_match_and_export_agree_on_the_orientation(tmp_path, capfd):
    """A portrait photo has the same size for all commands."""
    for name, image in zip(("l", "r"), textured_pair(96, 64, generator(111), 5), strict=True):
        data = cv2.imencode(".jpg", np.rot90(image))[1].tobytes()
        (tmp_path / f"{name}.jpg").write_bytes(with_orientation(data, 6))
    assert run("match", tmp_path/"l.jpg", tmp_path/"r.jpg", "-o", tmp_path/"out", "--device", "model:", "--disparities",
               16) == 0
    assert capfd.readouterr().err.count("rotated or mirrored") == 2
    map_ = np.load(tmp_path / "out" / "disparity.npy")
    assert map_.shape == (64, 96) and np.median(map_[map_ >= 0]) == 16*5
    assert run("export", tmp_path/"out"/"disparity.npy", "-o", tmp_path/"out", "--format", "ply", "--left",
               tmp_path/"l.jpg", "--focal", 100, "--baseline", 0.1, "--doffs", 0) == 0


@pytest.mark.parametrize("name", FOLDERS)
def test_maps_of_published_pairs_are_those_of_a_user_of_opencv(name):
    left, right = (stereo_folder(name) / f"{side}.png" for side in ("left", "right"))
    ours        = [read_grey(path)[0] for path in (left, right)]
    theirs      = [cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) for path in (left, right)]
    for disparities, block in ((16, 9), (64, 15), (32, 5)):
        settings = MatcherSettings(disparities, block)
        matcher  = OpenCVMatcher("bm")
        assert np.array_equal(matcher.match(*ours, settings), matcher.match(*theirs, settings))


def test_a_jpeg_that_ends_early_is_said_or_refused(tmp_path):
    """OpenCV 5.0 refuses it; others return the rows that are there."""
    data = image_files(200, 200)["colour.jpg"]
    path = tmp_path / "a.jpg"
    for length in (len(data) - 2, len(data)//2):
        path.write_bytes(data[:length])
        try:
            notices = read_grey(path)[1]
        except ImageError:
            continue
        assert any("ends too early" in notice for notice in notices)
    path.write_bytes(data + b"of a maker")
    assert not any("ends too early" in notice for notice in read_grey(path)[1])


def test_notices_of_many_files_are_one():
    assert summed_notices(["a: rotated", "b: rotated", "c: 16-bit: so", "a: rotated"]) == [
        "a and 2 more: rotated", "c: 16-bit: so"]


#: Matches a pair of pictures in a separate process, whose OpenCV is not loaded yet.
_ALONE = [sys.executable, "-c", "import sys, resource; resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30)); "
          "from litestereo.host_tools.cli import main; sys.exit(main())"]


@pytest.mark.parametrize(("width", "height"), [(1 << 16, 1 << 13), (1 << 20, 1 << 10), (0, 5), (1 << 31, 1),
                                               (MAX_PIXELS//(1 << 10) + 1, 1 << 10), ((1 << 31) - 1, (1 << 31) - 1)])
@pytest.mark.parametrize("kind", [GREY, RGBA])
def test_a_picture_that_says_it_is_huge_is_one_line(width, height, kind, tmp_path):
    data = png(np.zeros((4, 4), np.uint8), 8, kind, (width, height))
    (tmp_path / "a.png").write_bytes(data)
    done = subprocess.run([*_ALONE, "match", tmp_path/"a.png", tmp_path/"a.png", "-o", tmp_path/"out", "--device",
                           "model:"], capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 1, done
    assert done.stderr == f"litestereo: error: {tmp_path}/a.png: is not an image that OpenCV can read, or is damaged\n"


def test_a_file_without_an_end_is_one_line(monkeypatch, capfd):
    monkeypatch.setattr(images, "MAX_FILE_BYTES", 1 << 20)
    assert run("match", "/dev/zero", "/dev/zero", "-o", "out", "--device", "model:") == 1
    assert "/dev/zero: is larger than 1 MiB" in error_line(capfd)
    with pytest.raises(ImageError, match="cannot be read"):
        images.read_file(images.Path("a\0b"))


@pytest.mark.parametrize("command", ["stream", "view", "rectify", "calibrate"])
def test_commands_with_many_pictures_say_once_what_was_done(command, tmp_path, capfd):
    for number, (left, right) in enumerate([textured_pair(96, 64, generator(112), 5)]*3):
        for side, image in (("left", left), ("right", right)):
            (tmp_path / side).mkdir(exist_ok=True)
            data = with_orientation(cv2.imencode(".png", np.dstack([image]*3))[1].tobytes(), 3)
            (tmp_path / side / f"{number}.png").write_bytes(data)
    folders = (tmp_path/"left", tmp_path/"right")
    for name, camera in zip(("left", "right"), ideal_cameras(StereoGeometry(96, 64, 90, 0.1, 48, 32, 48)), strict=True):
        write_camera_info(tmp_path / "cameras" / f"{name}.yaml", camera)
    more = {"stream":    ("--device", "model:", "--disparities", 16),
            "view":      ("--device", "model:", "--disparities", 16, "--montage", tmp_path/"out.png"),
            "rectify":   ("--calibration", tmp_path/"cameras", "-o", tmp_path/"out"),
            "calibrate": ("--pattern", "chessboard", "4x3", "--square", 0.1, "-o", tmp_path/"out")}[command]
    # There is no board in these pictures, which is an error.
    assert run(command, *folders, *more) == (command == "calibrate")
    (line,) = [line for line in capfd.readouterr().err.splitlines() if "rotated" in line]
    assert line.startswith(f"litestereo: note: {tmp_path}/left/0.png and 5 more: ")
    if command == "rectify":
        image = cv2.imread(str(tmp_path / "out" / "left" / "1.png"))
        assert np.abs(image[2:-2, 2:-2].astype(int) - cv2.imread(str(tmp_path/"left"/"1.png"))[2:-2, 2:-2]).mean() < 2


@pytest.mark.parametrize("length", [1 << 20, (1 << 31) - 1, 1 << 31, (1 << 32) - 1])
def test_a_chunk_that_is_longer_than_its_file_costs_no_memory(length, tmp_path):
    """OpenCV would allocate and clear it first, which takes seconds."""
    data = image_files()["grey.png"]
    path = tmp_path / "a.png"
    for at in (8, 33):
        path.write_bytes(data[:at] + length.to_bytes(4, "big") + data[at + 4:])
        began = time.process_time()
        with pytest.raises(ImageError, match="is not an image"):
            read_grey(path)
        assert time.process_time() - began < 0.5
    path.write_bytes(data + b"after the end")
    assert np.array_equal(read_grey(path)[0], cv2.imread(str(path), cv2.IMREAD_GRAYSCALE))
