#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Pairs by their names: whole words only, every file once, and nothing that could be paired in two ways."""

import os

import pytest

from litestereo.host_tools.core.errors import ImageError
from litestereo.host_tools.data.sources.pairing import pair_files, pair_files_of_one, sides_of
from support.pairs import generator


def folders(path, left, right):
    for side, names in (("left", left), ("right", right)):
        (path/side).mkdir(parents=True)
        for name in names:
            (path/side/name).write_text(f"{side} {name}")
    return path/"left", path/"right"


def folder(path, names):
    path.mkdir(exist_ok=True)
    for name in names:
        (path/name).write_text(name)
    return path


def told(pairs):
    return {pair.name: (pair.left.name, pair.right.name) for pair in pairs}


@pytest.mark.parametrize(("stem", "sides"), [
    *((name, {0}) for name in ("left", "left_07", "07-left", "leftImage", "img.Left", "LEFT07", "left07", "camleft3",
                               "leftcam", "l_1", "l7", "imL", "cam0", "im0", "image_0", "img-0", "a_cam0_b",
                               "frankfurt_000_leftImg8bit")),
    *((name, {1}) for name in ("right", "RIGHT_07", "rightImage", "imR", "r7", "cam1", "image_1", "im1_x")),
    *((name, set()) for name in ("bright", "brightness_07", "copyrighted", "cleft", "leftover", "lefty", "uprights",
                                 "model", "07", "im10", "im00", "cam2", "dim0", "picture0", "war", "xl", "rl")),
    ("turn_left_right", {0, 1}),
])
def test_a_side_is_a_whole_word(stem, sides):
    assert sides_of(stem) == sides


@pytest.mark.parametrize(("left", "right", "names"), [
    (["1.png", "10.png", "9.png"], ["9.jpg", "10.jpg", "1.jpg"], ["1", "9", "10"]),
    (["left_8.png", "left_9.png"], ["right_8.png", "right_9.png"], ["8", "9"]),
    (["turn_left_01.png", "turn_right_01.png"], ["turn_left_01.png", "turn_right_01.png"],
     ["turn_left_01", "turn_right_01"]),
    (["left_arm_left.png", "right_arm_left.png"], ["left_arm_right.png", "right_arm_right.png"],
     ["left_arm", "right_arm"]),
    (["bright_1.png"], ["bright_1.png"], ["bright_1"]),
    (["image_0.png", "image_1.png", "image_2.png"], ["image_0.png", "image_1.png", "image_2.png"],
     ["image_0", "image_1", "image_2"]),
    # Two would be called 1.
    (["1.png", "left_1.png"], ["1.png", "right_1.png"], ["1", "left_1"]),
    (["imL.PNG"], ["imR.png"], ["im"]),
    (["cam0_5.png"], ["cam1_5.png"], ["cam_5"]),
])
def test_two_folders(left, right, names, tmp_path):
    pairs = pair_files(*folders(tmp_path, left, right))
    assert [pair.name for pair in pairs] == names and len(pairs) == len(left) == len(right)
    assert {pair.left.name for pair in pairs} == set(left) and {pair.right.name for pair in pairs} == set(right)


@pytest.mark.parametrize(("names", "found", "unused"), [
    (["left-0.png", "left-1.png", "right-0.png", "right-1.png"],
     {"0": ("left-0.png", "right-0.png"), "1": ("left-1.png", "right-1.png")}, 0),
    (["leftImage3.png", "rightImage3.png"], {"Image3": ("leftImage3.png", "rightImage3.png")}, 0),
    (["im0.png", "im1.png", "disp0.png"], {"im": ("im0.png", "im1.png")}, 1),
    (["image_0_left.png", "image_0_right.png", "image_1_left.png", "image_1_right.png"],
     {"image_0": ("image_0_left.png", "image_0_right.png"), "image_1": ("image_1_left.png", "image_1_right.png")}, 0),
    (["left_arm_left.png", "left_arm_right.png"], {"left_arm": ("left_arm_left.png", "left_arm_right.png")}, 0),
    (["left.png", "right.png", "bright.png", "notes.txt", "._left.png", ".hidden_left.png", "Thumbs.db"],
     {"left": ("left.png", "right.png")}, 1),
])
def test_one_folder(names, found, unused, tmp_path):
    pairs, number = pair_files_of_one(folder(tmp_path, names))
    assert (told(pairs), number) == (found, unused)
    # Given twice it is one folder, by any of its names: never pairs of an image with itself.
    os.symlink(tmp_path, tmp_path/"again")
    for other in (tmp_path, tmp_path/"again", tmp_path/"again"/".."/tmp_path.name):
        assert told(pair_files(tmp_path, other)) == found


@pytest.mark.parametrize(("names", "text"), [
    (["left_1.png", "left_1.bmp", "right_1.png"], "are both partners"),
    (["turn_left_left.png", "turn_left_right.png", "turn_right_left.png", "turn_right_right.png"], "are both partners"),
    (["left.png"], "no partner"),
    (["left.png", "right.png", "left_2.png"], "left_2.png: has no partner"),
    (["left_right.png"], "no partner"),
    (["bright.png", "night.png"], "no pairs of images"),
    (["image_0.png", "image_1.png", "image_2.png"], "image_2.png: is of a series"),
    ([], "no pairs of images"),
])
def test_one_folder_that_is_refused(names, text, tmp_path):
    with pytest.raises(ImageError, match=text):
        pair_files_of_one(folder(tmp_path, names))


@pytest.mark.parametrize(("left", "right", "text"), [
    (["01.png", "02.png"], ["01.png", "02.bmp", "02.png"], "right/02.bmp and .*right/02.png are both .*left/02.png"),
    (["02.png", "02.bmp"], ["02.png"], "left/02.bmp and .*left/02.png are both .*right/02.png"),
    (["left_2.png", "left_2.bmp"], ["right_2.png"], "are both partners"),
    (["1.png", "2.png"], ["1.png"], "2.png: has no partner"),
    (["a_left_b_left.png"], ["a_right_b_left.png", "a_left_b_right.png"], "are both partners"),
    ([], [], "no pairs"),
])
def test_two_folders_that_are_refused(left, right, text, tmp_path):
    with pytest.raises(ImageError, match=text):
        pair_files(*folders(tmp_path, left, right))


def test_an_image_is_not_its_own_partner(tmp_path):
    left, right = folders(tmp_path, ["1.png", "2.png"], ["1.png"])
    for make in (os.symlink, os.link):
        make(left/"2.png", right/"2.png")
        with pytest.raises(ImageError, match="left and right image at the same time"):
            pair_files(left, right)
        (right/"2.png").unlink()


def test_hidden_files_are_no_images(tmp_path):
    hidden = ["._1.png", ".DS_Store", "Thumbs.db", ".left_2.png"]
    assert told(pair_files(*folders(tmp_path, ["1.png", *hidden], ["1.png"]))) == {"1": ("1.png", "1.png")}
    (tmp_path/"left"/"2.png").mkdir()
    assert told(pair_files_of_one(tmp_path)[0]) == {"1": ("1.png", "1.png")}
    (tmp_path/"left").rename(tmp_path/"Left")
    assert told(pair_files_of_one(tmp_path)[0]) == {"1": ("1.png", "1.png")}


def test_drawn_names(tmp_path):
    """Of names with one side each pair is found, in one folder and in two, with all kinds of other words."""
    rng    = generator(230)
    sides  = [("left", "right"), ("Left", "Right"), ("LEFT", "RIGHT"), ("l", "r"), ("cam0", "cam1"),
              ("image_0", "image_1")]
    others = ["turn", "bright", "a7", "copyright", "12", "no", "cleft", "08", "upright"]
    for round_ in range(60):
        side  = sides[rng.integers(len(sides))]
        gap   = str(rng.choice(["_", "-", ".", " "]))
        names = set[tuple[str, ...]]()
        while len(names) < 6:
            names.add(tuple(str(word) for word in rng.choice(others, rng.integers(1, 4))))
        place = int(rng.integers(3))
        stems = [[gap.join([*words[:place], side[index], *words[place:]]) for words in sorted(names)]
                 for index in (0, 1)]
        if any(len(set(some)) < len(some) for some in stems):
            continue
        expected = {(f"{left}.png", f"{right}.png") for left, right in zip(*stems, strict=True)}
        files    = [[f"{stem}.png" for stem in some] for some in stems]
        one, _   = pair_files_of_one(folder(tmp_path/f"{round_}one", [*files[0], *files[1]]))
        two      = pair_files(*folders(tmp_path/f"{round_}two", *files))
        for pairs in (one, two):
            assert set(told(pairs).values()) == expected and len(told(pairs)) == len(pairs)
