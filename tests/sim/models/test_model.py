#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The reference model against its definition, written out."""

from __future__ import annotations

import numpy as np
import pytest

from litestereo.sim.models.block_matching import INVALID, match, minimum_size
from support.pairs import generator, textured_pair


def by_definition(left, right, disparities, block_size):
    """Match each pixel alone: the smallest sum of absolute differences, and of equal ones the largest disparity."""
    margin        = block_size//2
    height, width = left.shape
    result        = np.full(left.shape, INVALID, np.int16)
    left, right   = left.astype(int), right.astype(int)
    for row in range(margin, height - margin):
        rows = slice(row - margin, row + margin + 1)
        for column in range(disparities - 1 + margin, width - margin):
            block = left[rows, column - margin:column + margin + 1]
            costs = [int(np.abs(block - right[rows, column - margin - d:column + margin + 1 - d]).sum())
                     for d in range(disparities)]
            result[row, column] = 16*max(d for d in range(disparities) if costs[d] == min(costs))
    return result


@pytest.mark.parametrize("disparities, block_size", [(16, 5), (16, 9), (32, 7)])
def test_definition(disparities, block_size):
    """Textured images with few values, so that costs are often equal, give the definition's map."""
    rng           = generator(40, disparities, block_size)
    width, height = minimum_size(disparities, block_size)
    left, right   = textured_pair(width + 9, height + 4, rng)
    assert np.array_equal(match(left, right, disparities, block_size),
                          by_definition(left, right, disparities, block_size))
    left, right = left//128, right//128
    assert np.array_equal(match(left, right, disparities, block_size),
                          by_definition(left, right, disparities, block_size))


def test_bad_images():
    """Different shapes, other types and too small images are refused."""
    image = np.zeros((20, 40), np.uint8)
    with pytest.raises(ValueError, match="one size"):
        match(image, image[1:], 16, 5)
    with pytest.raises(ValueError, match="8-bit"):
        match(image.astype(np.uint16), image.astype(np.uint16), 16, 5)
    with pytest.raises(ValueError, match="too small.*at least 20x5"):
        match(image[:, :19], image[:, :19], 16, 5)
