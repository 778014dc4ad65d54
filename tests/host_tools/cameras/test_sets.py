#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Sets of pairs that determine cameras, and sets that do not, by made-up corners."""

import cv2
import numpy as np
import pytest

from litestereo.host_tools.cameras.board import Corners, make_board
from litestereo.host_tools.cameras.calibrate import calibrate
from litestereo.host_tools.cameras.find import BadPair, BoardPair, find_board, spans_plane
from litestereo.host_tools.core.errors import GeometryError
from support import rig
from support.pairs import generator

#: Errors of a corner in pixels: of a good chessboard, and of markers in a noisy picture.
NOISES = [0.03, 0.2]


def corners(points, middle, degrees, rng, noise_px, roll_deg=0.0, place=None):
    """Left and right corners of a board, float32, N x 2; the right camera is rolled by `roll_deg`."""
    there = (points - points.mean(axis=0)) @ cv2.Rodrigues(np.radians(degrees))[0].T + middle
    roll  = cv2.Rodrigues(np.array([0, 0, np.radians(roll_deg)]))[0]
    seen  = []
    for camera, extra in zip(rig.cameras(), (np.eye(3), roll), strict=True):
        origin = camera.place if place is None else camera.place*place
        pixels = cv2.projectPoints((there - origin) @ camera.rotation @ extra, np.zeros(3), np.zeros(3), camera.matrix,
                                   camera.distortion)[0].reshape(-1, 2)
        seen.append((pixels + rng.normal(0, noise_px, pixels.shape)).astype(np.float32))
    return seen


def places(kind, rng, count):
    """Centres in metres and rotations in degrees of a board that is moved in a way."""
    tilt = np.array([20, 15, 5])
    for middle, degrees in rig.board_places(rng, count):
        yield {
            "good":      (middle, degrees),
            "few tilts": (middle, degrees*[0.5, 0.5, 1]),
            "flat":      (middle, degrees*[0, 0, 2]),
            "parallel":  (middle, tilt),
            "once":      (np.array([0.03, 0.01, 0.55]), tilt),
            "hand":      (np.array([0.03, 0.01, 0.55]) + rng.normal(0, 0.003, 3), tilt + rng.normal(0, 1, 3)),
        }[kind]


def pairs_of(kind, rng, count, noise_px, **options):
    points = make_board("chessboard", "9x6", rig.SQUARE_M).points_m
    return [BoardPair(f"{number}", points, *corners(points, middle, degrees, rng, noise_px, **options))
            for number, (middle, degrees) in enumerate(places(kind, rng, count))]


@pytest.mark.parametrize("model", ["plumb_bob", "rational_polynomial"])
@pytest.mark.parametrize("noise_px", NOISES)
@pytest.mark.parametrize("count", [3, 10])
@pytest.mark.parametrize(("kind", "text"), [("flat", "not tilted"),
                                            ("parallel", "not tilted"), ("once", "in one place"),
                                            ("hand", "in one place")])
def test_places_that_do_not_determine_a_camera(kind, text, count, noise_px, model):
    with pytest.raises(GeometryError, match=text) as error:
        calibrate(pairs_of(kind, generator(150), count, noise_px), rig.WIDTH, rig.HEIGHT, model)
    assert "take ten or more" in str(error.value) and "\n" not in str(error.value)


@pytest.mark.parametrize("noise_px", NOISES)
@pytest.mark.parametrize("kind", ["good", "few tilts"])
@pytest.mark.parametrize("number", range(3))
def test_the_error_that_is_told(kind, noise_px, number):
    """The focal length is as certain as the spread says."""
    result = calibrate(pairs_of(kind, generator(151, number), 10, noise_px), rig.WIDTH, rig.HEIGHT)
    errors = [camera.camera_matrix[0, 0]/truth.matrix[0, 0] - 1
              for camera, truth in zip((result.left, result.right), rig.cameras(), strict=True)]
    assert np.abs(errors).max() < 3*result.spread.focal_error < 0.15
    assert result.spread.tilt_deg > 10 and 0.45 < result.spread.near_m < result.spread.far_m < 0.8


@pytest.mark.parametrize("count", [3, 12])
def test_an_error_above_the_limit(count):
    """Noise of some pixels, pairs of different moments, another board: each has its own line."""
    rng   = generator(152, count)
    pairs = pairs_of("good", rng, count, 0.03)
    noisy = pairs_of("good", rng, count, 3)
    with pytest.raises(GeometryError, match="the left images do not fit one camera.*--max-error|not determine"):
        calibrate(noisy, rig.WIDTH, rig.HEIGHT)
    # The board moves from left to right image.
    moved = [BoardPair(pair.name, pair.points_m, pair.left_px, other.right_px)
             for pair, other in zip(pairs, pairs[1:] + pairs[:1], strict=True)]
    with pytest.raises(GeometryError, match="not as a pair.*--max-error.* at the same moment"):
        calibrate(moved, rig.WIDTH, rig.HEIGHT, keep_all=True)


def test_the_limit_of_the_error():
    pairs = pairs_of("good", generator(153), 12, 0.6)
    error = calibrate(pairs, rig.WIDTH, rig.HEIGHT).reprojection_px
    assert 0.5 < error < 1
    assert calibrate(pairs, rig.WIDTH, rig.HEIGHT, max_error_px=1.02*error).reprojection_px < 1.02*error
    with pytest.raises(GeometryError, match="--max-error"):
        calibrate(pairs, rig.WIDTH, rig.HEIGHT, max_error_px=0.95*error)


# Cameras and boards that are rotated.

class Grid:
    """Finds corners that are given, in an order that begins at any corner of the board."""

    def __init__(self, board, seen, rng):
        self.board, self.seen, self.rng = board, seen, rng
        self.points_m, self.rotations   = board.points_m, board.rotations

    def find(self, image):
        order = self.rotations[self.rng.integers(len(self.rotations))] if self.rotations else slice(None)
        return Corners(np.arange(len(self.points_m)), self.seen[int(image[0, 0])][order])


def found(size, rng, count=10, noise_px=0.03, **options):
    board = make_board("chessboard", size, rig.SQUARE_M)
    image = np.zeros((rig.HEIGHT, rig.WIDTH), np.uint8)
    return [find_board(f"{number}", image, image + 1,
                       Grid(board, corners(board.points_m, middle, degrees, rng, noise_px, **options), rng))
            for number, (middle, degrees) in enumerate(rig.board_places(rng, count))]


@pytest.mark.parametrize("size", ["7x7", "3x3", "9x6", "8x5", "9x7"])
@pytest.mark.parametrize("number", range(3))
def test_boards_that_look_the_same_when_rotated(size, number):
    """OpenCV begins at any corner that looks like the first one; the cameras come back."""
    result = calibrate(found(size, generator(154, number)), rig.WIDTH, rig.HEIGHT)
    assert -result.right.projection[0, 3]/result.right.projection[0, 0] == pytest.approx(rig.BASELINE_M, rel=0.02)
    assert result.reprojection_px < 0.1 and not result.bad


@pytest.mark.parametrize("size", ["9x6", "7x7"])
@pytest.mark.parametrize("roll_deg", [180, 170, -90, 90, 60])
def test_a_camera_that_is_not_upright(size, roll_deg):
    with pytest.raises(GeometryError, match="one camera is rotated by|not one beside the other"):
        calibrate(found(size, generator(155), roll_deg=roll_deg), rig.WIDTH, rig.HEIGHT)


@pytest.mark.parametrize("roll_deg", [180, -180, 90, -90, 45])
def test_a_camera_that_is_not_upright_with_known_corners(roll_deg):
    """Markers tell which corner is which: the angle is told, also with the folders swapped."""
    pairs   = pairs_of("good", generator(156), 10, 0.1, roll_deg=roll_deg)
    swapped = [BoardPair(pair.name, pair.points_m, pair.right_px, pair.left_px) for pair in pairs]
    for each in (pairs, swapped):
        with pytest.raises(GeometryError, match=f"one camera is rotated by {abs(roll_deg)} degrees"):
            calibrate(each, rig.WIDTH, rig.HEIGHT)


def test_a_camera_that_is_rolled_a_little():
    result = calibrate(pairs_of("good", generator(157), 10, 0.03, roll_deg=12), rig.WIDTH, rig.HEIGHT)
    assert -result.right.projection[0, 3]/result.right.projection[0, 0] == pytest.approx(rig.BASELINE_M, rel=0.02)


# Corners that determine no homography.

GRID = np.stack(np.meshgrid(np.arange(9), np.arange(6)), -1).reshape(-1, 2)


@pytest.mark.parametrize("number", range(30))
def test_corners_on_lines(number):
    """Any line of a board, also with one corner off it; two off it are enough."""
    rng       = generator(158, number)
    direction = [(1, 0), (0, 1), (1, 1), (-1, 1), (2, 1)][number % 5]
    length    = {(2, 1): 3}.get(direction, 6) + (number % 3)*(direction == (1, 0))
    points    = np.array([(4 - 4*direction[0], 0)]) + np.arange(length)[:, None]*direction
    points    = (points - points.min(axis=0)).astype(np.float32)
    off       = [point for point in GRID if np.abs(np.linalg.det([point - points[0], direction])) > 0.5]
    one, two  = rng.choice(len(off), 2, replace=False)
    assert not spans_plane(points, 1e-6)
    assert not spans_plane(np.vstack([points, off[one]]).astype(np.float32), 1e-6)
    # The two and a corner of the line may be on another line: then a third one is left.
    assert spans_plane(np.vstack([points, off[one], off[two]]).astype(np.float32), 1e-6)
    scaled = (np.vstack([points, off[one]])*0.025 + [3, 5]).astype(np.float32)
    assert not spans_plane(scaled, 1e-6)


def test_a_pair_with_corners_on_a_line_is_left_out():
    class Part:
        rotations = ()
        points_m  = make_board("charuco", "10x7", 0.025).points_m

        def __init__(self, ids, pixels):
            self.ids, self.pixels = np.asarray(ids), pixels.astype(np.float32)

        def find(self, image):
            return Corners(self.ids, self.pixels)

    image = np.zeros((9, 9), np.uint8)
    for ids in (range(9), range(0, 54, 9), range(0, 54, 10), [*range(8), 20]):
        pair = find_board("a", image, image, Part(ids, 100*Part.points_m[list(ids), :2]))
        assert isinstance(pair, BadPair) and "on one line of the board" in pair.reason
    ids  = [0, 1, 2, 9, 10, 11, 18]
    pair = find_board("a", image, image, Part(ids, 1000*Part.points_m[ids, :2]))
    assert isinstance(pair, BoardPair)
    # A board seen from its edge.
    pair = find_board("a", image, image, Part(ids, 1000*Part.points_m[ids, :2]*[1, 0] + [0, 5]))
    assert isinstance(pair, BadPair) and "on one line of the left image" in pair.reason
