#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Metrics and regions of an evaluation, against computations pixel by pixel."""

import math

import numpy as np
import pytest

from litestereo.host_tools.core.errors import ImageError
from litestereo.host_tools.data.regions import near_steps, regions, visible_in_both
from litestereo.host_tools.evaluation.metrics import METRICS, measure
from support.pairs import generator


def quantile(errors, share):
    """Value at `share` percent of the sorted errors, between two of them in proportion."""
    place = (len(errors) - 1)*share/100
    below = math.floor(place)
    above = min(below + 1, len(errors) - 1)
    return errors[below] + (errors[above] - errors[below])*(place - below)


def by_hand(disparity, truth, region, most=math.inf):
    """All metrics, in loops."""
    errors, known, d1 = [], 0, 0
    for row in range(truth.shape[0]):
        for column in range(truth.shape[1]):
            true, value = float(truth[row, column]), float(disparity[row, column])
            if math.isnan(true) or not region[row, column]:
                continue
            known += 1
            if math.isnan(value):
                continue
            value = max(0.0, min(most, value)) if most < math.inf else value
            errors.append(abs(value - true))
            d1 += errors[-1] > 3 and errors[-1]/true > 0.05
    errors.sort()
    values = {"known_pixels": known, "valid_pixels": len(errors), "density": 100*len(errors)/known,
              "avgerr": sum(errors)/len(errors), "rms": math.sqrt(sum(error*error for error in errors)/len(errors))}
    values |= {f"a{share}": quantile(errors, share) for share in (50, 90, 95, 99)}
    wrong   = {f"bad{{}}_{name}": sum(error > limit for error in errors)
               for name, limit in (("0_5", 0.5), ("1_0", 1), ("2_0", 2), ("4_0", 4))}
    for name, count in (wrong | {"d1{}": d1}).items():
        values |= {name.format(""): 100*count/known, name.format("_of_valid"): 100*count/len(errors),
                   name.format("_or_invalid"): 100*(count + known - len(errors))/known}
    return values


def drawn(*salt):
    """A truth, a map and a region, with holes."""
    rng       = generator(21, *salt)
    truth     = rng.uniform(1, 90, (40, 50)).astype(np.float32)
    disparity = (truth + rng.normal(0, 3, truth.shape)).astype(np.float32)
    disparity[rng.random(truth.shape) < 0.2] = np.nan
    truth[rng.random(truth.shape) < 0.3]     = np.nan
    return disparity, truth, rng.random(truth.shape) < 0.7


@pytest.mark.parametrize("salt", range(5))
def test_metrics_are_those_counted_by_hand(salt):
    disparity, truth, region = drawn(salt)
    assert measure(disparity, truth, region) == pytest.approx(by_hand(disparity, truth, region), rel=1e-6, abs=1e-6)
    everything = np.ones(truth.shape, bool)
    assert measure(disparity, truth) == pytest.approx(by_hand(disparity, truth, everything), rel=1e-6, abs=1e-6)
    cut = measure(disparity, truth, region, 60)
    assert cut == pytest.approx(by_hand(disparity, truth, region, 60), rel=1e-6, abs=1e-6)
    assert cut["avgerr"] > measure(disparity, truth, region)["avgerr"]


def test_holes_count_as_their_names_say():
    nan    = np.nan
    values = measure(np.array([[10, 12, nan, nan, 10]], np.float32), np.array([[10, 10, 10, 10, nan]], np.float32))
    assert (values["known_pixels"], values["valid_pixels"], values["density"]) == (4, 2, 50)
    assert (values["bad_1_0"], values["bad_or_invalid_1_0"], values["bad_of_valid_1_0"]) == (25, 75, 50)
    assert (values["avgerr"], values["a50"], values["bad_2_0"]) == (1, 1, 0)


def test_an_error_of_exactly_the_limit_is_not_bad():
    truth = np.full((1, 4), 40, np.float32)
    for name, limit in (("0_5", 0.5), ("1_0", 1), ("2_0", 2), ("4_0", 4)):
        map_ = np.array([[40 - limit, 40 + limit, 40 + limit + 0.0625, 40]], np.float32)
        assert measure(map_, truth)[f"bad_{name}"] == 25
    assert measure(np.array([[43, 44]], np.float32), np.full((1, 2), 40, np.float32))["d1"] == 50
    assert measure(np.array([[84, 86]], np.float32), np.full((1, 2), 80, np.float32))["d1"] == 50


def test_nothing_to_measure():
    nothing = np.full((2, 2), np.nan, np.float32)
    values  = measure(nothing, np.ones((2, 2), np.float32))
    assert set(values) == set(METRICS)
    assert (values["density"], values["bad_1_0"], values["bad_or_invalid_1_0"]) == (0, 0, 100)
    assert math.isnan(values["avgerr"]) and math.isnan(values["a50"]) and math.isnan(values["bad_of_valid_1_0"])
    values = measure(np.ones((2, 2), np.float32), nothing)
    assert values["known_pixels"] == 0 and math.isnan(values["density"]) and math.isnan(values["bad_1_0"])


def test_shapes_must_agree():
    with pytest.raises(ImageError, match="ground truth is 3x2"):
        measure(np.ones((2, 2), np.float32), np.ones((2, 3), np.float32))
    with pytest.raises(ImageError, match="region is 2x3"):
        measure(np.ones((2, 2), np.float32), np.ones((2, 2), np.float32), np.ones((3, 2), bool))


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
