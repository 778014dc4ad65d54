#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Files that end too early: every frame that is not matched is told, with a status that is not 0."""

import contextlib
import json

import cv2
import numpy as np
import pytest

from litestereo.host_tools.core.errors import ImageError
from litestereo.host_tools.core.images import read_image
from litestereo.host_tools.data.sources import open_source
from support.command import error_line, run
from support.pairs import generator, textured_pair
from support.videos import write_video

SMALL = ["--device", "model:", "--disparities", 16]


@pytest.fixture
def pair(monkeypatch, tmp_path):
    monkeypatch.delenv("LITESTEREO_DEVICE", raising=False)
    monkeypatch.chdir(tmp_path)
    return textured_pair(96, 40, generator(260), 5)


def cut_to(path, share):
    data = path.read_bytes()
    path.write_bytes(data[:int(len(data)*share)])


@pytest.mark.parametrize(("left", "right"), [(5, 5), (5, 4), (4, 5), (1, 9), (6, 1)])
def test_videos_of_unequal_length(left, right, pair, tmp_path, capfd):
    for side, number in enumerate((left, right)):
        write_video(tmp_path/f"{side}.avi", [pair[side]]*number)
    status  = run("stream", "0.avi", "1.avi", *SMALL, "--json", "-o", "out")
    out, err = capfd.readouterr()
    summary  = json.loads(out.splitlines()[-1])["summary"]
    longer   = "0.avi" if left > right else "1.avi"
    missing  = abs(left - right)
    assert summary["frames"] == min(left, right) == len(list((tmp_path/"out").iterdir()))
    assert [(one["file"], one["frames"]) for one in summary["unmatched"]] == [(longer, missing)]*(missing > 0)
    assert status == (1 if missing else 0)
    assert err.startswith(f"litestereo: error: {longer}: {missing} frame") if missing else err == ""
    # What was asked for is there: nothing is missing.
    assert run("stream", "0.avi", "1.avi", *SMALL, "--frames", min(left, right)) == 0
    assert capfd.readouterr().err == ""
    assert run("view", "0.avi", "1.avi", *SMALL, "--montage", "m.png") == status
    assert (tmp_path/"m.png").exists() and capfd.readouterr().err == err


@pytest.mark.parametrize("share", [0.9, 0.5])
@pytest.mark.parametrize("names", [["both.avi"], ["left.avi", "right.avi"]])
def test_a_video_cut_short(names, share, pair, tmp_path, capfd):
    rng = generator(261)
    for name, image in (("both", np.hstack(pair)), ("left", pair[0]), ("right", pair[1])):
        write_video(tmp_path/f"{name}.avi", [rng.integers(0, 9, image.shape, np.uint8) + image//2 for _ in range(10)])
    cut_to(tmp_path/names[0], share)
    assert run("stream", *names, *SMALL, "--json") == 1
    out, err = capfd.readouterr()
    summary  = json.loads(out.splitlines()[-1])["summary"]
    found    = {(one["file"], one["frames"]) for one in summary["unmatched"]}
    assert summary["frames"] < 10 and found == {(name, 10 - summary["frames"]) for name in names}
    assert f"{names[0]}: " in err and "cut short?" in err and err.count("litestereo: error: ") == len(names)


@pytest.mark.parametrize("ending", [".h264", ".ts", ".MKV", ".dat", ""])
def test_what_is_a_video_is_asked_of_opencv(ending, pair, tmp_path, capfd):
    """A video may have any name."""
    write_video(tmp_path/"v.avi", [np.hstack(pair)]*2)
    (tmp_path/"v.avi").rename(tmp_path/f"clip{ending}")
    assert run("stream", f"clip{ending}", *SMALL) == 0
    capfd.readouterr()
    (tmp_path/"notes.txt").write_text("no pictures")
    for name in ("notes.txt", "notes.txt notes.txt"):
        assert run("stream", *name.split(), *SMALL) == 1
        line = error_line(capfd)
        assert "neither an image nor a video" in line and ".h265" in line and ".webp" in line
    # An image with an unusual ending is one, too.
    (tmp_path/"picture.jfif").write_bytes(cv2.imencode(".jpg", pair[0])[1].tobytes())
    assert run("stream", "picture.jfif", *SMALL) == 2
    assert "is one image, its right one is missing" in error_line(capfd)


@pytest.mark.parametrize("ending", [".png", ".jpg", ".bmp", ".tif", ".pgm", ".webp"])
def test_images_cut_short(ending, pair, tmp_path):
    data = cv2.imencode(ending, pair[0])[1].tobytes()
    path = tmp_path/f"image{ending}"
    path.write_bytes(data)
    assert read_image(path).shape[:2] == pair[0].shape
    for length in (1, 20, len(data)//2, len(data) - 100, len(data) - 14, len(data) - 2, len(data) - 1):
        path.write_bytes(data[:length])
        if ending == ".tif" and length > len(data) - 100:
            # Its directory is at the end, and needs not all of its entries.
            with contextlib.suppress(ImageError):
                assert np.array_equal(read_image(path), pair[0])
            continue
        with pytest.raises(ImageError, match="is not an image"):
            read_image(path)


def test_what_follows_a_jpeg_does_not_matter(pair, tmp_path, monkeypatch):
    """A thumbnail in a segment has an end; OpenCV 4 fills up what is missing after it."""
    data  = cv2.imencode(".jpg", pair[0])[1].tobytes()
    thumb = b"\xff\xe1" + (len(data) + 2).to_bytes(2, "big") + data
    path  = tmp_path/"image.jpg"
    path.write_bytes(data[:2] + thumb + data[2:] + b"more")
    assert read_image(path).shape[:2] == pair[0].shape
    monkeypatch.setattr(cv2, "imdecode", lambda *arguments: np.zeros((4, 4), np.uint8))
    path.write_bytes(data[:2] + thumb + data[2:-200])
    with pytest.raises(ImageError, match="its end is missing"):
        read_image(path)


def test_folders_with_missing_partners_and_others(pair, tmp_path, capfd):
    for side, image in (("left", pair[0]), ("right", pair[1])):
        (tmp_path/side).mkdir()
        for number in range(2):
            cv2.imwrite(f"{side}/{number}.png", image)
            cv2.imwrite(f"{side}_{number}.png", image)
    cv2.imwrite("other.png", pair[0])
    (tmp_path/"all").mkdir()
    for path in tmp_path.glob("*.png"):
        path.rename(tmp_path/"all"/path.name)
    assert run("stream", "all", *SMALL) == 0
    assert capfd.readouterr().err == "litestereo: note: all: 1 image without a side in its name is not read\n"
    with open_source(["all"]) as source:
        assert source.names == ["0", "1"] and len(source.files) == 4
    (tmp_path/"right"/"1.png").unlink()
    for command in (["stream", "left", "right", *SMALL], ["stream", ".", *SMALL]):
        assert run(*command) == 1
        assert "left/1.png: has no partner" in error_line(capfd)
