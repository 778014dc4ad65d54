#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Metrics of an evaluation, against computations pixel by pixel."""

import math

import numpy as np
import pytest

from litestereo.host_tools.core.errors import ImageError
from litestereo.host_tools.core.images import disparity_pixels
from litestereo.host_tools.evaluation.metrics import METRICS, beyond_range, json_values, measure_map, summary_texts
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
    assert measure_map(disparity, truth, region) == pytest.approx(by_hand(disparity, truth, region), rel=1e-6, abs=1e-6)
    everything = np.ones(truth.shape, bool)
    assert measure_map(disparity, truth) == pytest.approx(by_hand(disparity, truth, everything), rel=1e-6, abs=1e-6)
    cut = measure_map(disparity, truth, region, 60)
    assert cut == pytest.approx(by_hand(disparity, truth, region, 60), rel=1e-6, abs=1e-6)
    assert cut["avgerr"] > measure_map(disparity, truth, region)["avgerr"]


def test_holes_count_as_their_names_say():
    nan    = np.nan
    values = measure_map(np.array([[10, 12, nan, nan, 10]], np.float32), np.array([[10, 10, 10, 10, nan]], np.float32))
    assert (values["known_pixels"], values["valid_pixels"], values["density"]) == (4, 2, 50)
    assert (values["bad_1_0"], values["bad_or_invalid_1_0"], values["bad_of_valid_1_0"]) == (25, 75, 50)
    assert (values["avgerr"], values["a50"], values["bad_2_0"]) == (1, 1, 0)


def test_an_error_of_exactly_the_limit_is_not_bad():
    truth = np.full((1, 4), 40, np.float32)
    for name, limit in (("0_5", 0.5), ("1_0", 1), ("2_0", 2), ("4_0", 4)):
        map_ = np.array([[40 - limit, 40 + limit, 40 + limit + 0.0625, 40]], np.float32)
        assert measure_map(map_, truth)[f"bad_{name}"] == 25
    assert measure_map(np.array([[43, 44]], np.float32), np.full((1, 2), 40, np.float32))["d1"] == 50
    assert measure_map(np.array([[84, 86]], np.float32), np.full((1, 2), 80, np.float32))["d1"] == 50


def test_nothing_to_measure():
    nothing = np.full((2, 2), np.nan, np.float32)
    values  = measure_map(nothing, np.ones((2, 2), np.float32))
    assert set(values) == set(METRICS)
    assert (values["density"], values["bad_1_0"], values["bad_or_invalid_1_0"]) == (0, 0, 100)
    assert math.isnan(values["avgerr"]) and math.isnan(values["a50"]) and math.isnan(values["bad_of_valid_1_0"])
    values = measure_map(np.ones((2, 2), np.float32), nothing)
    assert values["known_pixels"] == 0 and math.isnan(values["density"]) and math.isnan(values["bad_1_0"])


def test_shapes_must_agree():
    with pytest.raises(ImageError, match="ground truth is 3x2"):
        measure_map(np.ones((2, 2), np.float32), np.ones((2, 3), np.float32))
    with pytest.raises(ImageError, match="region is 2x3"):
        measure_map(np.ones((2, 2), np.float32), np.ones((2, 2), np.float32), np.ones((3, 2), bool))


# Maps as a device gives them, in sixteenths of a pixel.

def counted_in_sixteenths(disparity, truth):
    """bad-1.0 %, bad-2.0 %, both of the known pixels, mean error, density %, known, valid."""
    errors, known = [], 0
    for row in range(truth.shape[0]):
        for column in range(truth.shape[1]):
            true = float(truth[row, column])
            if math.isnan(true):
                continue
            known += 1
            if disparity[row, column] != -16:
                errors.append(abs(int(disparity[row, column])/16 - true))
    bad = [100*sum(error > limit for error in errors)/known for limit in (1, 2)]
    return (*bad, sum(errors)/len(errors), 100*len(errors)/known, known, len(errors))


@pytest.mark.parametrize("salt", range(5))
def test_random_maps(salt):
    rng       = generator(20, salt)
    truth     = rng.uniform(1, 60, (40, 50)).astype(np.float32)
    disparity = np.round(16*(truth + rng.normal(0, 1.5, truth.shape))).astype(np.int16).clip(0)
    disparity[rng.random(truth.shape) < 0.2] = -16
    truth[rng.random(truth.shape) < 0.3]     = np.nan
    values = measure_map(disparity_pixels(disparity), truth)
    assert [values[name] for name in ("bad_1_0", "bad_2_0", "avgerr", "density", "known_pixels", "valid_pixels")
            ] == pytest.approx(counted_in_sixteenths(disparity, truth))
    assert values["bad_of_valid_2_0"] == pytest.approx(values["bad_2_0"]*values["known_pixels"]/values["valid_pixels"])


def test_a_sixteenth_above_the_limit_is_bad():
    values = measure_map(disparity_pixels(np.array([[16, 32, 33, 48, 49]], np.int16)), np.ones((1, 5), np.float32))
    assert values["bad_1_0"] == pytest.approx(60)
    assert values["bad_2_0"] == pytest.approx(20)


def test_a_disparity_of_zero_is_one():
    values = measure_map(disparity_pixels(np.array([[0, -16]], np.int16)), np.array([[1, 1]], np.float32))
    assert (values["avgerr"], values["density"]) == (1.0, 50.0)


def test_texts_name_their_denominators():
    values = measure_map(np.array([[10, 13, np.nan, 10]], np.float32), np.full((1, 4), 10, np.float32))
    assert summary_texts(values) == {
        "bad-1.0":    "25.00 % of the known pixels",
        "bad-2.0":    "25.00 % of the known pixels",
        "mean error": "1.000 pixels, mean over the valid pixels",
        "density":    "75.00 % of the known pixels",
    }
    for text in METRICS.values():
        assert "known" in text or "valid" in text or "of the region" in text
    nothing = np.full((1, 2), np.nan, np.float32)
    assert summary_texts(measure_map(nothing, nothing))["bad-2.0"] == "nan % of the known pixels"
    assert json_values(measure_map(nothing, nothing))["bad_2_0"] is None


@pytest.mark.parametrize(("value", "out"), [(14.99, True), (15, False), (16, False), (31, False), (32, False),
                                            (32.01, True), (1e30, True), (0.5, True)])
def test_truths_out_of_reach(value, out):
    """Searched are 16 to 31 pixels: a truth a pixel beyond can still be met within a pixel."""
    truth       = np.full((10, 10), 20, np.float32)
    truth[0, 0] = np.nan
    truth[5, 5] = value
    text        = beyond_range(truth, 16, 16)
    assert text.startswith("1.01 % of the true disparities are out of the range searched, 16 to 31 pixels") == out
    assert bool(text) == out
    assert beyond_range(np.full((2, 2), np.nan, np.float32), 0, 16) == ""
    # What is said holds: the nearest disparity is bad-1.0.
    nearest = np.clip(truth, 16, 31).astype(np.float32)
    assert (measure_map(nearest, truth)["bad_1_0"] > 0) == out
