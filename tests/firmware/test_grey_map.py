#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The picture that the firmware draws of a map, against the same in NumPy."""

import numpy as np
import pytest

from support.pairs import generator
from support.screen import SIZE, drawn_picture, expected_picture


def random_map(rng, width, height, disparities, min_disparity):
    """Return a map of every possible value, with many invalid pixels, and of some impossible values."""
    lowest = 16*(min_disparity - 1)
    values = rng.integers(lowest, lowest + 16*(disparities + 1), (height, width)).astype(np.int16)
    values[rng.random((height, width)) < 0.2] = lowest
    return values


@pytest.mark.parametrize("size", [(1, 1), (320, 240), (321, 239), (640, 480), (639, 481), (700, 100), (8, 600),
                                  (801, 601)])
@pytest.mark.parametrize("disparities, min_disparity", [(16, 0), (128, 0), (64, 9), (256, 255)])
def test_any_map(programs, size, disparities, min_disparity):
    """Maps that are smaller than the screen, larger, or both, with every grey value."""
    disparity = random_map(generator(90), *size, disparities, min_disparity)
    picture   = drawn_picture(programs, disparity, disparities, min_disparity)
    assert picture.shape == SIZE[::-1]
    assert np.array_equal(picture, expected_picture(disparity, disparities, min_disparity))


def test_ends_of_the_range(programs):
    """The largest searched disparity is white, none is black, and a bit more than half of it is grey."""
    disparity = np.array([[127*16, -16, 0, 127*8 + 1, 32767, -32768]], np.int16)
    picture   = drawn_picture(programs, disparity, 128, size=(8, 2))
    assert picture.tolist() == [[0, 255, 0, 0, 128, 255, 0, 0], [0]*8]
