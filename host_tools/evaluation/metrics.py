#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Metrics of Middlebury's stereo evaluation, version 3, and of KITTI, for maps that have holes.

All commands and pages take their figures from here. Three sets of pixels count:

- known: the pixels of a region that have a true disparity. A true disparity of 0, nan or inf is unknown.
- valid: the known pixels that have a disparity in the map, too.
- bad: the valid pixels whose absolute error is above a threshold; an error equal to it is not bad.

`bad_2_0` is Middlebury's bad-2.0: bad pixels in percent of the known ones. A pixel without a disparity is not bad, but
it lowers the density (valid pixels in percent of the known ones), so read both. `bad_or_invalid_2_0` counts a pixel
without a disparity as bad (Middlebury's program calls it total bad). `bad_of_valid_2_0` has the valid pixels as its
denominator, and is not Middlebury's.

D. Scharstein et al., High-resolution stereo datasets with subpixel-accurate ground truth, GCPR 2014, and `evaldisp` of
its kit MiddEval3; M. Menze and A. Geiger, Object scene flow for autonomous vehicles, CVPR 2015, for D1.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ..core.errors import ImageError

#: Thresholds of bad pixels by their names, in pixels.
THRESHOLDS_PX = {"0_5": 0.5, "1_0": 1.0, "2_0": 2.0, "4_0": 4.0}

#: Error quantiles by their names, in percent.
QUANTILES = {"a50": 50, "a90": 90, "a95": 95, "a99": 99}

#: KITTI's D1: an error above both, in pixels and as a share of the true disparity.
_D1_PX, _D1_SHARE = 3.0, 0.05

#: All metrics, and what they are.
METRICS = {
    "known_pixels": "pixels of the region that have a true disparity",
    "valid_pixels": "known pixels that have a disparity in the map",
    "density":      "valid pixels, % of the known ones",
    **{f"bad_{name}":            f"valid pixels more than {limit} pixels off, % of the known ones"
       for name, limit in THRESHOLDS_PX.items()},
    **{f"bad_or_invalid_{name}": f"known pixels without a disparity or more than {limit} pixels off, % of them"
       for name, limit in THRESHOLDS_PX.items()},
    **{f"bad_of_valid_{name}":   f"valid pixels more than {limit} pixels off, % of the valid ones"
       for name, limit in THRESHOLDS_PX.items()},
    "avgerr":        "mean absolute error of the valid pixels, pixels",
    "rms":           "root mean square of the valid pixels' errors, pixels",
    **{name: f"absolute error that {share} % of the valid pixels do not exceed, pixels"
       for name, share in QUANTILES.items()},
    "d1":            "valid pixels more than 3 pixels and 5 % off, % of the known ones (KITTI)",
    "d1_or_invalid": "known pixels without a disparity or so far off, % of them",
    "d1_of_valid":   "valid pixels so far off, % of the valid ones",
}


#: Metrics that the summary of one map shows: label, decimals, and unit with the denominator.
SUMMARY = {
    "bad_1_0": ("bad-1.0",    2, "% of the known pixels"),
    "bad_2_0": ("bad-2.0",    2, "% of the known pixels"),
    "avgerr":  ("mean error", 3, "pixels, mean over the valid pixels"),
    "density": ("density",    2, "% of the known pixels"),
}


def measure_map(disparity_px: NDArray[np.float32], truth_px: NDArray[np.float32],
                region: NDArray[np.bool_] | None = None, max_disparity_px: float | None = None) -> dict[str, float]:
    """Measure the errors of one map in one region.

    Parameters
    ----------
    disparity_px
        The map: float32, H x W, in pixels, nan where there is no disparity.
    truth_px
        True disparities: float32, H x W, in pixels, nan where they are unknown; see `data.ground_truth`.
    region
        Pixels that count: bool, H x W; None for all.
    max_disparity_px
        Largest disparity of the data set. The map is clipped to 0 up to it, as Middlebury does it, so that a matcher
        gains nothing by knowing the range. None to leave the map as it is.

    Returns
    -------
    The metrics by the names in `METRICS`; nan if there is no pixel in the denominator.

    Raises
    ------
    ImageError
        The shapes differ.
    """
    for what, other in (("ground truth", truth_px), ("region", region)):
        if other is not None and other.shape != disparity_px.shape:
            raise ImageError(f"the {what} is {other.shape[1]}x{other.shape[0]} pixels, "
                             f"the disparity map {disparity_px.shape[1]}x{disparity_px.shape[0]}")
    known  = np.isfinite(truth_px) if region is None else np.isfinite(truth_px) & region
    valid  = known & np.isfinite(disparity_px)
    pixels = disparity_px[valid].astype(np.float64)
    truth  = truth_px[valid].astype(np.float64)
    if max_disparity_px is not None:
        pixels = pixels.clip(0, max_disparity_px)
    errors = np.abs(pixels - truth)
    counts = int(known.sum()), errors.size
    bad    = {f"bad_{name}": errors > limit for name, limit in THRESHOLDS_PX.items()}
    bad   |= {"d1": (errors > _D1_PX) & (errors > _D1_SHARE*truth)}
    shares = {name: value for metric, wrong in bad.items() for name, value in _shares(metric, wrong, *counts).items()}
    values = {
        "known_pixels": counts[0],
        "valid_pixels": counts[1],
        "density":      _percent(counts[1], counts[0]),
        "avgerr":       float(errors.mean()) if errors.size else math.nan,
        "rms":          float(np.sqrt(np.mean(errors**2))) if errors.size else math.nan,
        **{name: float(np.percentile(errors, share)) if errors.size else math.nan
           for name, share in QUANTILES.items()},
        **shares,
    }
    return {name: values[name] for name in METRICS}


def beyond_range(truth_px: NDArray[np.float32], min_disparity: int, disparities: int) -> str:
    """Return a notice if true disparities are out of reach: more than a pixel outside of the range that is searched.

    No matcher can be right there: such a pixel is bad-1.0, or has no disparity.

    Parameters
    ----------
    truth_px
        float32, H x W, in pixels, nan where they are unknown.
    min_disparity, disparities
        Smallest disparity and number of disparities searched, in pixels.

    Returns
    -------
    One line, "" if there are none.
    """
    known = truth_px[np.isfinite(truth_px)]
    most  = min_disparity + disparities - 1
    count = int(((known < min_disparity - 1) | (known > most + 1)).sum())
    if not count:
        return ""
    share = f"{max(_percent(count, known.size), 0.01):.2f} %"
    return (f"{share} of the true disparities are out of the range searched, {min_disparity} to {most} pixels (they "
            f"are {known.min():g} to {known.max():g}): they count as bad or missing; is the scale of the truth right, "
            "are there enough --disparities?")


def summary_texts(metrics: Mapping[str, float]) -> dict[str, str]:
    """Return the metrics of `SUMMARY` as texts, by their labels: "9.75 % of the known pixels"."""
    return {label: f"{metrics[name]:.{decimals}f} {unit}" for name, (label, decimals, unit) in SUMMARY.items()}


def json_values(metrics: Mapping[str, float]) -> dict[str, float | None]:
    """Return the metrics for JSON, which has no nan: None where there is no value."""
    return {name: None if math.isnan(value) else value for name, value in metrics.items()}


def _shares(metric: str, wrong: NDArray[np.bool_], known: int, valid: int) -> dict[str, float]:
    """Return the three shares of a kind of error, in percent: `bad_1_0`, `bad_or_invalid_1_0`, `bad_of_valid_1_0`."""
    kind, underscore, limit = metric.partition("_")
    count = int(wrong.sum())
    return {
        metric:                                  _percent(count, known),
        f"{kind}_or_invalid{underscore}{limit}": _percent(count + known - valid, known),
        f"{kind}_of_valid{underscore}{limit}":   _percent(count, valid),
    }


def _percent(count: int, of: int) -> float:
    return 100.0*count/of if of else math.nan
