#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The page of the boards' accuracy: it follows the presets, and its figures are those of their maps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from litestereo.gateware.common.parameters import FEATURES, OPENCV_FEATURES
from litestereo.host_tools.core.errors import DatasetError
from litestereo.host_tools.core.images import disparity_pixels
from litestereo.host_tools.data.datasets import StereoPair
from litestereo.host_tools.evaluation.metrics import measure_map
from litestereo.sim import accuracy
from litestereo.sim.models.stereo_bm import stereo_bm
from litestereo.soc.boards import BOARDS, soc_class
from support.pairs import byte_generator, generator, textured_pair


@pytest.fixture
def build(tmp_path, monkeypatch):
    """Use a new build folder, so that everything is measured."""
    monkeypatch.setattr(accuracy, "build_directory", lambda: tmp_path)


def test_every_board_has_its_settings():
    """The search of the rows is that of the preset, and no stage is on that the preset lacks."""
    found = {case.board: case for case in accuracy.cases()}
    assert list(found) == list(BOARDS)
    for board, case in found.items():
        preset = soc_class(board).preset
        for settings in case.rows.values():
            assert (settings.disparities, settings.block_size) == (preset.disparities, preset.max_block_size)
        assert ("left-right check" in case.rows) == ("left_right" in preset.features)


@pytest.mark.parametrize("number", range(20))
def test_drawn_presets(number):
    """Each setting is OpenCV's default if its stage is built, and off if it is not."""
    rng      = byte_generator(851, number)
    optional = [name for name in FEATURES if name not in ("xsobel", "raw")]
    chosen   = rng.sample(optional, rng.randrange(len(optional) + 1))
    preset   = replace(soc_class("arty").preset, features=("xsobel", *chosen),
                       max_block_size=rng.choice([7, 9, 15, 21]), disparities=rng.choice([16, 32, 64, 128]))
    case     = accuracy.case_of("a board", preset)
    settings = case.rows["defaults"]
    assert (settings.disparities, settings.block_size) == (preset.disparities, preset.max_block_size)
    assert settings.prefilter == "xsobel" and not settings.median and settings.disp12_max_diff == -1
    assert settings.texture_threshold == (10 if "texture" in chosen else 0)
    assert settings.uniqueness_ratio  == (15 if "uniqueness" in chosen else 0)
    assert settings.subpixel          == ("subpixel" in chosen)
    assert list(case.rows) == ["defaults"] + ["left-right check"]*("left_right" in chosen)
    if "left_right" in chosen:
        assert case.rows["left-right check"] == replace(settings, disp12_max_diff=1)


def test_the_key_follows_the_presets(monkeypatch):
    """Another stage on a board makes the page stale, and the original presets make it current again."""
    before = accuracy.key()
    assert accuracy.key() == before
    board  = soc_class("atlys")
    preset = board.preset
    wanted = ("xsobel", "texture") if set(preset.features) != {"xsobel", "texture"} else OPENCV_FEATURES
    monkeypatch.setattr(board, "preset", replace(preset, features=wanted))
    assert accuracy.key() != before
    monkeypatch.setattr(board, "preset", preset)
    assert accuracy.key() == before


def test_figures(build):
    """They are those of the model's map, measured with the metrics of the host tools; the mean is over the pairs."""
    pairs = {}
    for number, (name, shift) in enumerate({"tsukuba": 7, "venus": 11}.items()):
        left, right = textured_pair(90, 40, generator(852, number), shift)
        pairs[name] = StereoPair(left, right, np.full(left.shape, shift + 2.5*number, np.float32))
    case     = accuracy.case_of("arty", soc_class("arty").preset)
    settings = case.rows["defaults"]
    found    = {name: accuracy.measure(pair, settings) for name, pair in pairs.items()}
    for name, pair in pairs.items():
        disparity = stereo_bm(pair.left, pair.right, settings)
        expected  = measure_map(disparity_pixels(disparity, settings.invalid), pair.truth)
        assert found[name] == accuracy.Quality(expected["bad_2_0"], expected["density"])
    assert found["tsukuba"].bad < 2 < found["venus"].bad
    text = accuracy.document([(case, "defaults", found)], pairs)
    mean = (found["tsukuba"].bad + found["venus"].bad)/2
    assert f"| {found['tsukuba'].bad:.1f} | {found['venus'].bad:.1f} | {mean:.1f} |" in text
    assert "| Venus | 90 x 40 | 14 |" in text
    for board in BOARDS:
        assert f"\n| {board} | {soc_class(board).preset.disparities} |" in text


@pytest.mark.parametrize(("width", "limit", "factor"), [(640, 640, 1), (641, 640, 2), (90, 640, 1), (90, 30, 3),
                                                        (91, 30, 4)])
def test_wide_pairs_are_shrunk(width, limit, factor):
    """By the least whole number with which they fit; disparities shrink with them."""
    left, right = textured_pair(width, 20, generator(853), 5)
    pair, used  = accuracy.fitting(StereoPair(left, right, np.full(left.shape, 12, np.float32)), limit)
    assert (used, pair.left.shape) == (factor, (20//factor, width//factor))
    assert pair.left.shape[1] <= limit
    assert np.allclose(pair.truth, 12/factor)


def test_without_the_pairs(monkeypatch, tmp_path, capsys):
    """The command says in one line what it needs."""
    monkeypatch.delenv("LITESTEREO_DATA", raising=False)
    assert accuracy.main() == 1
    assert capsys.readouterr().err == ("accuracy: error: LITESTEREO_DATA is not set: set it to the folder of the "
                                       "Middlebury pairs tsukuba, venus, teddy, cones\n")
    monkeypatch.setenv("LITESTEREO_DATA", str(tmp_path))
    with pytest.raises(DatasetError, match="tsukuba: there is no such folder"):
        accuracy.load_pairs()
