#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Boards in pictures, and pairs of pictures that are no good for a calibration."""

import cv2
import numpy as np
import pytest

from litestereo.host_tools.cameras.board import _SEARCHES, make_board
from litestereo.host_tools.cameras.calibrate import calibrate
from litestereo.host_tools.cameras.find import BadPair, BoardPair, find_board
from litestereo.host_tools.core.errors import GeometryError, UsageError
from litestereo.host_tools.core.images import read_grey
from support import rig
from support.pairs import generator

PAIRS = 10


def test_a_board_with_markers(tmp_path):
    """ChArUco: a part of the board is enough, and the cameras come back."""
    board   = make_board("charuco", "6x4", 0.05, 0.038, "5X5_100")
    markers = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_100)
    picture = cv2.aruco.CharucoBoard((6, 4), 0.05, 0.038, markers).generateImage((960, 640))
    pairs   = []
    places  = rig.board_places(generator(122), 6)
    # This one reaches out of the left picture.
    places[0] = np.array([0.27, 0, 0.6]), np.array([0, 10, 0])
    for number, (middle, degrees) in enumerate(places):
        files = rig.take(tmp_path, f"{number}", [rig.flat(picture, 0.3, middle, degrees)])
        pairs.append(find_board(f"{number}", *(read_grey(path)[0] for path in files), board))
    counts = [len(pair.points_m) for pair in pairs]
    assert min(counts) >= 6 and counts[0] < 15 == max(counts)
    result = calibrate(pairs, rig.WIDTH, rig.HEIGHT)
    assert -result.right.projection[0, 3]/result.right.projection[0, 0] == pytest.approx(rig.BASELINE_M, rel=0.01)
    assert result.reprojection_px < 0.3 and not result.bad


def test_a_chessboard_found_upside_down():
    """The right image's corners are put in the left one's order."""
    picture = cv2.resize(rig.chessboard(), None, fx=0.7, fy=0.7)
    board   = make_board("chessboard", "9x6", 0.025)

    class Turned:
        points_m  = board.points_m
        rotations = board.rotations

        def __init__(self):
            self.reversed = False

        def find(self, image):
            found, self.reversed = board.find(image), not self.reversed
            return type(found)(found.ids, found.pixels[::-1] if self.reversed else found.pixels)

    pair = find_board("", picture, picture, Turned())
    assert np.array_equal(pair.left_px, pair.right_px)


@pytest.mark.parametrize(("arguments", "text"), [
    (("circles", "9x6", 0.02), "chessboard, charuco"),
    (("chessboard", "9", 0.02), "like 9x6"),
    (("chessboard", "9x2", 0.02), "at least 3"),
    (("chessboard", "9x6", 25), "25 mm are 0.025"),
    (("charuco", "9x6", 0.02, 0.03), "smaller than its square"),
    (("charuco", "9x6", 0.02, None, "NONE"), "4X4_50"),
    (("charuco", "9x6", 0.02, None, ""), "4X4_50"),
    (("charuco", "9x6", 0.02, None, "DICT_"), "4X4_50"),
    (("charuco", "9x6", 0.02, None, "DICT_DICT_4X4_50"), "4X4_50"),
    (("charuco", "11x10", 0.02), "55 markers, 4X4_50 only 50"),
    (("chessboard", "9x6", 0.02, None, "4X4_50", True), "--legacy goes with"),
])
def test_boards_that_are_none(arguments, text):
    with pytest.raises(UsageError, match=text):
        make_board(*arguments)


NAMES = sorted({name.upper().removeprefix("DICT_") for name in dir(cv2.aruco) if name.startswith("DICT_")})


@pytest.mark.parametrize("name", NAMES)
def test_every_dictionary_by_opencvs_name(name):
    """With and without DICT_, in any case: the board of each is found."""
    number = next(getattr(cv2.aruco, known) for known in dir(cv2.aruco) if known.upper() == f"DICT_{name}")
    image  = cv2.aruco.CharucoBoard((5, 4), 0.05, 0.0375, cv2.aruco.getPredefinedDictionary(number)
                                    ).generateImage((800, 640), marginSize=30)
    for given in (name, f"DICT_{name}", f"dict_{name.lower()}"):
        assert len(make_board("charuco", "5x4", 0.05, None, given).find(image).ids) == 12


@pytest.mark.parametrize("size", ["5x4", "4x5", "6x6", "7x8", "5x5"])
def test_boards_of_older_opencv(size):
    """They differ if the number of rows is even: found with legacy, and named where they are not found."""
    columns, rows = map(int, size.split("x"))
    older         = cv2.aruco.CharucoBoard((columns, rows), 0.05, 0.0375,
                                           cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50))
    older.setLegacyPattern(True)
    image = older.generateImage((800, 800), marginSize=30)
    board = make_board("charuco", size, 0.05, legacy=True)
    assert len(board.find(image).ids) == (columns - 1)*(rows - 1) and "leave out --legacy" in board.hint
    other = make_board("charuco", size, 0.05)
    assert "try --legacy" in other.hint
    if rows % 2 == 0:
        assert other.find(image) is None


@pytest.mark.parametrize("number", range(4))
def test_a_board_before_a_bright_window(number):
    """A search that fails because of its normalization is not the last one."""
    rng     = generator(125, number)
    picture = np.full((480, 640), 250, np.uint8)
    board   = cv2.resize(rig.chessboard(), None, fx=0.8, fy=0.8)//int(rng.integers(2, 6))
    top, left = int(rng.integers(20, 200)), int(rng.integers(20, 300))
    picture[top:top + board.shape[0], left:left + board.shape[1]] = board
    assert len(make_board("chessboard", "9x6", 0.025).find(picture).ids) == 54


def test_the_searches_follow_each_other(monkeypatch):
    """What only one of them finds is found."""
    image = rig.chessboard()
    board = make_board("chessboard", "9x6", 0.025)
    count = len(_SEARCHES)
    for only in range(count):
        searches = [(search if number == only else lambda *_, **__: (False, None), flags)
                    for number, (search, flags) in enumerate(_SEARCHES)]
        monkeypatch.setattr("litestereo.host_tools.cameras.board._SEARCHES", searches)
        assert len(board.find(image).ids) == 54


# Bad pairs.

@pytest.fixture
def pairs():
    """Corners of a board in ten places, as the cameras see them."""
    points = make_board("chessboard", "9x6", rig.SQUARE_M).points_m
    placed = []
    for number, (middle, degrees) in enumerate(rig.board_places(generator(124), PAIRS)):
        there = (points - points.mean(axis=0)) @ cv2.Rodrigues(np.radians(degrees))[0].T + middle
        seen  = [cv2.projectPoints((there - camera.place) @ camera.rotation, np.zeros(3), np.zeros(3), camera.matrix,
                                   camera.distortion)[0].reshape(-1, 2).astype(np.float32) for camera in rig.cameras()]
        placed.append(BoardPair(f"{number:02}", points, *seen))
    return placed


def test_a_pair_that_does_not_fit_is_named_and_omitted(pairs):
    moved    = pairs[4].right_px + np.linspace(0, 12, 54, dtype=np.float32)[:, None]
    pairs[4] = BoardPair("04", pairs[4].points_m, pairs[4].left_px, moved)
    result   = calibrate(pairs, rig.WIDTH, rig.HEIGHT)
    assert [bad.name for bad in result.bad] == ["04"] and "reprojection error" in result.bad[0].reason
    assert "04" not in [errors.name for errors in result.pairs]
    assert result.reprojection_px < 0.01
    kept = calibrate(pairs, rig.WIDTH, rig.HEIGHT, keep_all=True, max_error_px=2)
    assert len(kept.pairs) == PAIRS and kept.reprojection_px > 0.5 and not kept.bad


def test_pairs_without_the_board():
    board   = make_board("chessboard", "9x6", rig.SQUARE_M)
    image   = rig.chessboard()
    nothing = np.zeros_like(image)
    for left, right, text in ((image, nothing, "in the right image"), (nothing, nothing, "left and the right image"),
                              (image, image[:-2], "right 288x214")):
        bad = find_board("x", left, right, board)
        assert isinstance(bad, BadPair) and text in bad.reason


def test_a_wide_lens_and_all_that_it_sees(pairs):
    """The model with eight coefficients, and rectified images with black borders."""
    result = calibrate(pairs, rig.WIDTH, rig.HEIGHT, "rational_polynomial", alpha=1)
    narrow = calibrate(pairs, rig.WIDTH, rig.HEIGHT)
    assert (result.left.distortion_model, len(result.left.distortion)) == ("rational_polynomial", 8)
    assert result.reprojection_px < 0.01 and result.epipolar_px < 0.01
    assert -result.right.projection[0, 3]/result.right.projection[0, 0] == pytest.approx(rig.BASELINE_M, rel=0.001)
    # More of the scene in as many pixels: a shorter focal length.
    assert result.left.projection[0, 0] < 0.99*narrow.left.projection[0, 0]


def test_cameras_that_are_no_pair(pairs):
    swapped = [BoardPair(pair.name, pair.points_m, pair.right_px, pair.left_px) for pair in pairs]
    with pytest.raises(GeometryError, match="swap the two folders"):
        calibrate(swapped, rig.WIDTH, rig.HEIGHT)
    same = [BoardPair(pair.name, pair.points_m, pair.left_px, pair.left_px) for pair in pairs]
    with pytest.raises(GeometryError, match="of one camera"):
        calibrate(same, rig.WIDTH, rig.HEIGHT)
    # Turned by a quarter, one camera is above the other.
    above = [BoardPair(pair.name, pair.points_m, pair.left_px[:, ::-1].copy(), pair.right_px[:, ::-1].copy())
             for pair in pairs]
    with pytest.raises(GeometryError, match="not one beside the other"):
        calibrate(above, rig.HEIGHT, rig.WIDTH)
    with pytest.raises(GeometryError, match="2 pairs show the pattern, at least 3"):
        calibrate(pairs[:2], rig.WIDTH, rig.HEIGHT)
