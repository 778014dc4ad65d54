#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The Motorcycle pair offline, and shrunk pairs."""

import subprocess
from pathlib import Path

import numpy as np
import pytest

from litestereo.host_tools.core.errors import DatasetError
from litestereo.host_tools.data import datasets
from support.pairs import generator, textured_pair
from support.paths import CHECKOUT

CACHE = CHECKOUT / datasets.MOTORCYCLE_FOLDER


def small_pair(width, height):
    left, right = textured_pair(width, height, generator(30))
    truth       = np.full((height, width), 12, np.float32)
    return datasets.StereoPair(left, right, truth)


@pytest.mark.parametrize(("size", "factor", "shrunk"), [
    ((741, 500), 3, (247, 166)),
    ((12, 8), 4, (3, 2)),
    ((7, 5), 1, (7, 5)),
])
def test_shrunk_sizes(size, factor, shrunk):
    pair = datasets.downscale(small_pair(*size), factor)
    for array in (pair.left, pair.right, pair.truth):
        assert array.shape == shrunk[::-1]
    assert pair.left.dtype == pair.right.dtype == np.uint8 and pair.truth.dtype == np.float32
    assert np.allclose(pair.truth, 12/factor)


def test_shrinking_takes_the_mean_of_areas():
    pair = small_pair(12, 9)
    pair.truth[:3, :3] = np.arange(9).reshape(3, 3) + 3
    pair.truth[4, 4]   = np.nan
    shrunk = datasets.downscale(pair, 3)
    means  = pair.left.reshape(3, 3, 4, 3).mean(axis=(1, 3))
    assert np.abs(shrunk.left - means).max() <= 0.5
    assert shrunk.truth[0, 0] == pytest.approx(7/3)
    assert np.isnan(shrunk.truth[1, 1])
    assert np.isnan(shrunk.truth).sum() == 1


@pytest.mark.parametrize("factor", [0, -1, 10])
def test_impossible_factors_are_refused(factor):
    with pytest.raises(DatasetError):
        datasets.downscale(small_pair(12, 9), factor)


def test_no_network_is_one_clear_line(tmp_path, monkeypatch):
    def fail(*_, **__):
        raise subprocess.CalledProcessError(1, "pip")

    monkeypatch.setattr(datasets.subprocess, "run", fail)
    with pytest.raises(DatasetError, match="cannot fetch scikit-image") as caught:
        datasets.load_motorcycle(tmp_path / "none")
    assert "\n" not in str(caught.value)


def test_another_wheel_is_refused(tmp_path, monkeypatch):
    def fetch(command, **_):
        Path(command[command.index("--dest") + 1], "scikit_image-0.17.2-any.whl").write_bytes(b"other")

    monkeypatch.setattr(datasets.subprocess, "run", fetch)
    with pytest.raises(DatasetError, match="SHA-256"):
        datasets.load_motorcycle(tmp_path / "none")
    assert not (tmp_path / "none").exists()


def test_a_damaged_cache_does_not_count(tmp_path):
    for name in ("motorcycle_left.png", "motorcycle_right.png", "motorcycle_disp.npz"):
        (tmp_path / name).write_bytes(b"damaged")
    assert not datasets.motorcycle_cached(tmp_path)


def test_motorcycle_from_the_cache_needs_no_network(monkeypatch):
    if not datasets.motorcycle_cached(CACHE):
        pytest.skip(f"the Motorcycle pair is not in {CACHE}")
    monkeypatch.setattr(datasets.subprocess, "run", None)
    pair = datasets.load_motorcycle(CACHE)
    assert pair.left.shape == pair.right.shape == pair.truth.shape == (500, 741)
    assert np.isnan(pair.truth).sum() == 27226
    assert 7 < np.nanmin(pair.truth) < np.nanmax(pair.truth) < 64
