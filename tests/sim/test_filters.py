#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The page of the filters: it has all of them, and its figures are those of their maps."""

from __future__ import annotations

import numpy as np
import pytest

from litestereo.host_tools.core.disparity_map import DisparityMap
from litestereo.host_tools.core.filters import FILTERS, FilterChain
from litestereo.host_tools.data.datasets import StereoPair
from litestereo.host_tools.evaluation.metrics import measure_map
from litestereo.sim import filters
from litestereo.sim.models.stereo_bm import stereo_bm
from support.pairs import generator, textured_pair


@pytest.fixture
def build(tmp_path, monkeypatch):
    """Use a new build folder, so that everything is matched."""
    monkeypatch.setattr(filters, "build_directory", lambda: tmp_path)


def pair():
    left, right = textured_pair(100, 30, generator(861), 7)
    return StereoPair(left, right, np.full(left.shape, 7.5, np.float32))


def test_every_filter_is_on_the_page():
    """With its parameters, their ranges and defaults; and all but threshold, which needs cameras, are measured."""
    text = filters.document([filters.Row((), {"venus": dict.fromkeys(filters.FIGURES.values(), 1.25)})], [
        filters.Row(("temporal",), {"venus": dict.fromkeys(filters.FIGURES.values(), 2.5)})], ["venus"])
    for name, kind in FILTERS.items():
        assert f"| `{name}` | {kind.text} |" in text
        for one in kind.parameters().values():
            assert f"| `{name}` | `{one.name}` | {one.least} to {one.most} | {one.default:g} | {one.text} |" in text
    assert text.count("| none | 1.2 | 1.2 |") == 3 and text.count("| `temporal` | 2.5 | 2.5 |") == 3
    measured = {one.partition(":")[0] for chain in (*filters.CHAINS, *filters.SEQUENCE_CHAINS) for one in chain}
    assert measured == set(FILTERS) - {"threshold"}
    for chain in (*filters.CHAINS, *filters.SEQUENCE_CHAINS):
        FilterChain.parse(chain)


def test_figures(build):
    """They are those of the last map of a scene, rated in the images."""
    one    = pair()
    frames = [filters.matched(frame) for frame in filters.noisy(one)]
    assert len(frames) == filters.FRAMES and not np.array_equal(frames[0], frames[1])
    for chain in (("decimation:filter_magnitude=3", "temporal:holes_fill=8"), ()):
        chained = FilterChain.parse(chain)
        for disparity in frames:
            map_ = chained.process(DisparityMap(disparity, filters.SETTINGS))
        expected = measure_map(map_.in_images(one.truth.shape), one.truth)
        assert filters.measure(frames, one.truth, chain) == pytest.approx(expected, nan_ok=True)
    assert np.array_equal(filters.matched(one), stereo_bm(one.left, one.right, filters.SETTINGS))


def test_frames_are_equal_at_each_call():
    once, again = list(filters.noisy(pair())), list(filters.noisy(pair()))
    assert all(np.array_equal(one.left, other.left) and np.array_equal(one.right, other.right)
               for one, other in zip(once, again, strict=True))


def test_the_key_follows_the_settings(monkeypatch):
    before = filters.key()
    monkeypatch.setattr(filters, "SETTINGS", filters.MatcherSettings(32, 9))
    assert filters.key() != before


def test_without_the_pairs(monkeypatch, capsys):
    """The command says in one line what it needs."""
    monkeypatch.delenv("LITESTEREO_DATA", raising=False)
    assert filters.main() == 1
    assert capsys.readouterr().err.startswith("filters: error: LITESTEREO_DATA is not set: ")
