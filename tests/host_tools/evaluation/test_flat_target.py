#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Figures of flat targets: made-up planes with known answers, tilted, with noise and with holes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from litestereo.host_tools.core.errors import ImageError, UsageError
from litestereo.host_tools.core.geometry import StereoGeometry
from litestereo.host_tools.evaluation.flat_target import (
    FIGURES,
    TEMPORAL_FIGURES,
    Region,
    RegionMeter,
    TemporalNoise,
    figure_texts,
    fit_plane,
    measure_region,
)
from support.pairs import generator

GEOMETRY = StereoGeometry(160, 120, 200.0, 0.1, 81.5, 58.0, 79.0, 210.0)
WHOLE    = Region(0, 0, 160, 120)


def disparities(normal, distance_m, geometry=GEOMETRY):
    """Return the exact disparities of a plane: float64, in pixels. Its points have normal . point = distance_m."""
    rows, columns = np.mgrid[0:geometry.height, 0:geometry.width]
    rays  = np.stack([(columns - geometry.cx_left_px)/geometry.focal_px,
                      (rows - geometry.cy_px)/geometry.focal_y_px, np.ones(rows.shape)], axis=-1)
    depth = distance_m/(rays @ normal)
    return geometry.focal_px*geometry.baseline_m/depth + geometry.zero_px


def normal_at(degrees, direction=0.0):
    angle, direction = math.radians(degrees), math.radians(direction)
    return np.array([math.sin(angle)*math.cos(direction), math.sin(angle)*math.sin(direction), math.cos(angle)])


@pytest.mark.parametrize("distance_m", [0.5, 1.5, 8.0])
@pytest.mark.parametrize(("degrees", "direction"), [(0, 0), (5, 0), (30, 90), (45, 200)])
def test_a_plane_without_noise(distance_m, degrees, direction):
    normal  = normal_at(degrees, direction)
    figures = measure_region(disparities(normal, distance_m).astype(np.float32), GEOMETRY, Region(60, 40, 50, 30),
                             distance_m/normal[2])
    assert list(figures) == list(FIGURES)
    assert figures["fill_rate"] == 100
    assert figures["plane_distance_m"] == pytest.approx(distance_m, rel=1e-4)
    assert figures["axis_depth_m"] == pytest.approx(distance_m/normal[2], rel=1e-4)
    assert figures["angle_deg"] == pytest.approx(degrees, abs=0.05)
    assert figures["plane_rms_m"] < 1e-5*distance_m and figures["subpixel_rms_px"] < 1e-4
    assert figures["flatness_m"] < 1e-4*distance_m
    assert figures["z_accuracy_percent"] == pytest.approx(0, abs=0.01)
    middle = disparities(normal, distance_m)[40:70, 60:110]
    assert figures["depth_m"] == pytest.approx(float(np.median(20/(middle - GEOMETRY.zero_px))), rel=1e-4)


@pytest.mark.parametrize("degrees", [0, 25])
@pytest.mark.parametrize("noise_px", [0.05, 0.25])
def test_noise_of_the_disparity_is_the_subpixel_error(noise_px, degrees):
    """The depth's error is that of the disparity times Z^2/(B f), and the plane's that times the normal's slope."""
    rng     = generator(1400, degrees)
    normal  = normal_at(degrees)
    exact   = disparities(normal, 2.0)
    noisy   = (exact + rng.normal(0, noise_px, exact.shape)).astype(np.float32)
    figures = measure_region(noisy, GEOMETRY, Region(31, 18, 100, 80))
    depth_m = 2.0/normal[2]
    # 1 % of the points, those at the ends of the depths, do not count: of a plane that is seen squarely these are the
    # worst ones.
    error   = noise_px*depth_m**2/20*normal[2]
    assert figures["plane_rms_m"] == pytest.approx(error, rel=0.12)
    assert figures["subpixel_rms_px"] == pytest.approx(noise_px*normal[2]**2, rel=0.12)
    assert 4*error < figures["flatness_m"] < 10*error
    assert math.isnan(figures["z_accuracy_percent"])
    assert figures["plane_distance_m"] == pytest.approx(2.0, rel=0.01)


@pytest.mark.parametrize("true_m", [0.9, 1.0, 1.25])
def test_z_accuracy(true_m):
    """A plane at 1 m: above 0 if it is measured too far; the angle does not matter."""
    for degrees in (0, 20):
        normal  = normal_at(degrees, 45)
        figures = measure_region(disparities(normal, normal[2]).astype(np.float32), GEOMETRY, WHOLE, true_m)
        assert figures["z_accuracy_percent"] == pytest.approx(100*(1 - true_m)/true_m, abs=0.01)


def test_holes_count_for_the_fill_rate_alone():
    rng   = generator(1401)
    exact = disparities(normal_at(15), 1.0)
    holes = rng.random(exact.shape) < 0.25
    found = measure_region(np.where(holes, np.nan, exact).astype(np.float32), GEOMETRY, Region(10, 20, 80, 60), 1.0)
    whole = measure_region(exact.astype(np.float32), GEOMETRY, Region(10, 20, 80, 60), 1.0)
    assert found["fill_rate"] == pytest.approx(100*(~holes[20:80, 10:90]).mean())
    for name in ("plane_distance_m", "axis_depth_m", "angle_deg", "z_accuracy_percent"):
        assert found[name] == pytest.approx(whole[name], rel=1e-3, abs=1e-3)


def test_outliers_at_both_ends_do_not_count():
    """One point in 200 at each end, and none of 199."""
    for rows, kept in ((10, False), (9, True)):
        values = disparities(normal_at(0), 1.0).astype(np.float32)
        region = Region(60, 50, 20, rows)
        # A fiftieth of a pixel is a millimetre there.
        values[53, 67] += 0.02
        values[54, 70] -= 0.02
        figures = measure_region(values, GEOMETRY, region)
        assert (figures["flatness_m"] > 0.0015) == kept


def test_what_there_is_without_a_plane():
    """Without points only the fill rate, with too few or in one line no plane; a depth at infinity is none."""
    values  = np.full((120, 160), np.nan, np.float32)
    figures = measure_region(values, GEOMETRY, WHOLE, 1.0)
    assert figures["fill_rate"] == 0
    assert all(math.isnan(value) for name, value in figures.items() if name != "fill_rate")
    values[5, 7:9] = 20
    values[9, 9]   = GEOMETRY.zero_px
    figures = measure_region(values, GEOMETRY, WHOLE, 1.0)
    assert figures["fill_rate"] == pytest.approx(100*2/(160*120)) and figures["depth_m"] == pytest.approx(20/17.5)
    assert math.isnan(figures["plane_distance_m"]) and math.isnan(figures["z_accuracy_percent"])
    values[5, 7:40] = 20
    assert math.isnan(measure_region(values, GEOMETRY, WHOLE)["plane_distance_m"])
    assert fit_plane(np.zeros((9, 3))) is None


def test_a_plane_is_fitted_by_least_squares():
    """No plane that is a little different has a smaller sum of squares."""
    rng    = generator(1402)
    points = np.stack([rng.normal(0, 1, 300), rng.normal(0, 1, 300), np.zeros(300)], axis=1)
    points[:, 2] = 3 + 0.4*points[:, 0] - 0.2*points[:, 1] + rng.normal(0, 0.05, 300)
    plane  = fit_plane(points)
    best   = (plane.errors_m(points)**2).sum()
    assert np.linalg.norm(plane.normal) == pytest.approx(1) and plane.distance_m > 0
    for axis in range(3):
        for step in (1e-3, -1e-3):
            normal  = plane.normal.copy()
            normal[axis] += step
            normal /= np.linalg.norm(normal)
            assert ((points @ normal - plane.distance_m)**2).sum() > best
    for step in (1e-3, -1e-3):
        assert ((points @ plane.normal - plane.distance_m - step)**2).sum() > best


def test_regions():
    assert Region.middle(640, 480) == Region(192, 144, 256, 192)
    assert Region.middle(1, 1) == Region(0, 0, 1, 1)
    assert Region(10, 21, 30, 40).decimated(4) == Region(2, 5, 8, 10)
    assert Region(7, 7, 1, 1).decimated(8) == Region(0, 0, 1, 1)
    Region(10, 20, 150, 100).check(160, 120)
    for region in (Region(10, 20, 151, 100), Region(10, 20, 150, 101), Region(160, 0, 1, 1)):
        with pytest.raises(ImageError, match="is not within the map of 160x120 pixels"):
            region.check(160, 120)
    for numbers in ((-1, 0, 1, 1), (0, -1, 1, 1), (0, 0, 0, 1), (0, 0, 1, 0)):
        with pytest.raises(UsageError, match="a region has"):
            Region(*numbers)


def test_temporal_noise():
    """Against the plain deviations of all frames: pixels with holes, one that is seldom there, and a single frame."""
    rng    = generator(1403)
    frames = 1.5 + rng.normal(0, 0.01, (9, 6, 8)).astype(np.float32)
    frames[rng.random(frames.shape) < 0.2] = np.nan
    frames[1:, 0, 0] = np.nan
    frames[3, 2, 2]  = np.inf
    noise  = TemporalNoise()
    assert math.isnan(noise.noise)
    for number, frame in enumerate(frames):
        noise.add(frame)
        seen = frames[:number + 1].astype(np.float64)
        seen[np.isinf(seen)] = np.nan
        steady   = np.isfinite(seen).sum(axis=0) >= max(2, (number + 1)/2)
        expected = math.nan
        if steady.any():
            expected = float(np.median([np.nanstd(seen[:, row, column]) for row, column in np.argwhere(steady)]))
        assert noise.noise == pytest.approx(expected, nan_ok=True)
    assert noise.noise == pytest.approx(0.01, rel=0.3)
    assert noise._counts.shape == (6, 8)


def test_a_meter_takes_means_over_the_frames():
    """Frames without a depth have a fill rate of 0, and no part in the other figures."""
    meter = RegionMeter(None, 1.0)
    for distance_m in (1.0, 1.1):
        meter.add(disparities(normal_at(0), distance_m).astype(np.float32), GEOMETRY)
    meter.add(np.full((120, 160), np.nan, np.float32), GEOMETRY)
    figures = meter.figures()
    assert set(figures) == {*FIGURES, *TEMPORAL_FIGURES} and meter.frames == 3
    assert figures["fill_rate"] == pytest.approx(200/3) and meter.measured == Region.middle(160, 120)
    assert figures["plane_distance_m"] == pytest.approx(1.05, rel=1e-4)
    assert figures["z_accuracy_percent"] == pytest.approx(5, abs=0.01)
    assert figures["temporal_noise_m"] == pytest.approx(0.05, rel=1e-3)
    assert figures["temporal_noise_px"] == pytest.approx((20 - 20/1.1)/2, rel=1e-3)


def test_a_meter_follows_a_decimated_map():
    meter = RegionMeter(Region(40, 20, 80, 60), None)
    meter.add(disparities(normal_at(0), 1.0).astype(np.float32)[::4, ::4], GEOMETRY, 4)
    assert meter.measured == Region(10, 5, 20, 15)


def test_texts():
    figures = measure_region(disparities(normal_at(10), 1.0).astype(np.float32), GEOMETRY, WHOLE, 1.0)
    figures |= {"temporal_noise_m": math.nan, "temporal_noise_px": math.nan}
    texts   = dict(figure_texts(figures, 1.0))
    assert texts["plane"] == "1.0000 m from the left camera, 10.00 degrees off, 1.0154 m on the axis"
    assert texts["Z accuracy"].startswith("+1.54") and "noise" not in texts
    assert "Z accuracy" not in dict(figure_texts(figures, None))
    figures |= dict.fromkeys(FIGURES, math.nan) | {"fill_rate": 1.0, "temporal_noise_m": 0.5, "temporal_noise_px": 1.25}
    texts   = dict(figure_texts(figures, 1.0))
    assert texts["plane RMS"] == "none, none" and texts["noise"] == "0.50000 m, 1.2500 pixels, over time"
