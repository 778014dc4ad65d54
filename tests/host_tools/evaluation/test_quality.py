#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Metrics against a computation pixel by pixel."""

import math

import numpy as np
import pytest

from litestereo.host_tools.core.errors import ImageError
from litestereo.host_tools.evaluation.quality import rate
from support.pairs import generator


def by_hand(disparity, truth):
    """bad-1.0 %, bad-2.0 %, mean error, density %, known, rated."""
    errors, known = [], 0
    for row in range(truth.shape[0]):
        for column in range(truth.shape[1]):
            true = float(truth[row, column])
            if math.isnan(true):
                continue
            known += 1
            if disparity[row, column] != -16:
                errors.append(abs(int(disparity[row, column])/16 - true))
    bad = [100*sum(error > limit for error in errors)/len(errors) for limit in (1, 2)]
    return (*bad, sum(errors)/len(errors), 100*len(errors)/known, known, len(errors))


@pytest.mark.parametrize("salt", range(5))
def test_random_maps(salt):
    rng       = generator(20, salt)
    truth     = rng.uniform(1, 60, (40, 50)).astype(np.float32)
    disparity = np.round(16*(truth + rng.normal(0, 1.5, truth.shape))).astype(np.int16).clip(0)
    disparity[rng.random(truth.shape) < 0.2] = -16
    truth[rng.random(truth.shape) < 0.3]     = np.nan
    quality = rate(disparity, truth)
    assert (quality.bad_1_0, quality.bad_2_0, quality.mean_error, quality.density, quality.known_pixels,
            quality.rated_pixels) == pytest.approx(by_hand(disparity, truth))


def test_an_error_of_exactly_the_limit_is_not_bad():
    quality = rate(np.array([[16, 32, 33, 48, 49]], np.int16), np.ones((1, 5), np.float32))
    assert quality.bad_1_0 == pytest.approx(60)
    assert quality.bad_2_0 == pytest.approx(20)


def test_a_disparity_of_zero_is_one():
    quality = rate(np.array([[0, -16]], np.int16), np.array([[1, 1]], np.float32))
    assert (quality.mean_error, quality.density) == (1.0, 50.0)


def test_nothing_to_rate():
    quality = rate(np.full((2, 2), -16, np.int16), np.ones((2, 2), np.float32))
    assert quality.density == 0 and math.isnan(quality.bad_1_0) and math.isnan(quality.mean_error)
    quality = rate(np.zeros((2, 2), np.int16), np.full((2, 2), np.nan, np.float32))
    assert math.isnan(quality.density) and quality.known_pixels == 0


def test_sizes_must_agree():
    with pytest.raises(ImageError, match="3x2"):
        rate(np.zeros((2, 2), np.int16), np.ones((2, 3), np.float32))
