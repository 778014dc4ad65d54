#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Regions of a pair, against computations pixel by pixel."""

import numpy as np

from litestereo.host_tools.data.regions import near_steps, regions, visible_in_both
from support.pairs import generator


def steps_by_hand(truth):
    """Near steps, by looking around each pixel."""
    height, width = truth.shape
    found         = np.zeros(truth.shape, bool)
    for row in range(height):
        for column in range(width):
            for other in ((row, column + 1), (row, column - 1), (row + 1, column), (row - 1, column)):
                if 0 <= other[0] < height and 0 <= other[1] < width and abs(truth[row, column] - truth[other]) > 2:
                    found[max(row - 4, 0):row + 5, max(column - 4, 0):column + 5] = True
    return found


def test_near_steps_are_those_found_by_hand():
    rng         = generator(22)
    truth       = np.full((60, 70), 20, np.float32)
    truth[20:40, 30:50] = 22.125
    truth[:, 60:]       = 22              # A step of exactly 2 is none.
    truth[50:, :10]     = np.nan          # What is unknown neither.
    truth[rng.random(truth.shape) < 0.002] += 9
    found = near_steps(truth)
    assert np.array_equal(found, steps_by_hand(truth))
    assert found.any() and not found.all()


def test_visible_in_both_is_what_was_painted_in_front():
    """A near square over a far wall, by disparity: what it hides of the wall in the right image."""
    left, right = np.full((20, 60), 4, np.float32), np.full((20, 60), 4, np.float32)
    left[5:15, 30:40]  = 12
    right[5:15, 18:28] = 12
    expected           = np.ones((20, 60), bool)
    expected[:, :4]    = False            # Left of the right image.
    expected[5:15, 22:30] = False         # Behind the square.
    assert np.array_equal(visible_in_both(left, right), expected)
    right[0, 0] = left[1, 10] = np.nan
    expected[0, 4] = expected[1, 10] = False
    assert np.array_equal(visible_in_both(left, right), expected)


def test_which_regions_there_are():
    left, right = np.full((20, 60), 4, np.float32), np.full((20, 60), 4, np.float32)
    left[5:15, 30:40]  = 12
    right[5:15, 18:28] = 12
    left[0, 59]        = np.nan
    found = regions(left)
    assert list(found) == ["all", "disc"]
    assert np.array_equal(found["all"], np.isfinite(left))
    found = regions(left, right)
    assert list(found) == ["all", "nonocc", "disc"]
    assert np.array_equal(found["disc"], near_steps(left) & found["nonocc"])
    mask         = np.zeros(left.shape, bool)
    mask[:, 50:] = True
    found        = regions(left, right, mask, mask)
    assert np.array_equal(found["nonocc"], mask & np.isfinite(left)) and np.array_equal(found["disc"], found["nonocc"])
