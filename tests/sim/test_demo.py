#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The demonstration, `match` and `eval` print the same metrics: one map has one bad-2.0."""

from __future__ import annotations

import contextlib
import re
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from litestereo.host_tools.cli import evaluate, match
from litestereo.host_tools.core.images import disparity_pixels, pfm_of
from litestereo.host_tools.data.datasets import StereoPair
from litestereo.host_tools.data.ground_truth import read_ground_truth
from litestereo.host_tools.devices.base import DeviceInfo, Result
from litestereo.host_tools.evaluation import matchers
from litestereo.host_tools.evaluation.metrics import measure_map
from litestereo.sim import demo
from support.command import run
from support.pairs import generator, textured_pair

WIDTH, HEIGHT = 60, 40

#: Figures that all three print, by their names in eval's table.
FIGURES = {"density": "density", "bad-1.0": "bad-1.0", "bad-2.0": "bad-2.0"}


class DrawnDevice:
    """A device that returns a given map for any pair."""

    link_counters = None

    def __init__(self, disparity):
        self._disparity = disparity

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        """Release nothing."""

    def info(self):
        """Describe a device that accepts every pair of the test."""
        return DeviceInfo("model:", "drawn", 1000, 1000, 10**6, 32, 5, 21)

    def compute(self, left, right, settings, progress=None):
        """Return the map."""
        return Result(self._disparity, settings, WIDTH*HEIGHT, WIDTH, 0.1, 0.1, 0.1)


def drawn(salt):
    """Draw a map in sixteenths with holes, and a truth in which nan, inf and 0 are unknown."""
    rng       = generator(160, salt)
    truth     = rng.uniform(1, 31, (HEIGHT, WIDTH)).astype(np.float32)
    disparity = np.round(16*(truth + rng.normal(0, 1 + salt, truth.shape))).clip(0, 31*16).astype(np.int16)
    disparity[rng.random(truth.shape) < 0.3] = -16
    for value in (np.nan, np.inf, 0):
        truth[rng.random(truth.shape) < 0.1] = value
    return disparity, truth


@pytest.fixture
def printed(tmp_path, monkeypatch, capfd):
    """Return a function that returns the output of the three commands for a map and a truth, by command."""
    def print_all(disparity, truth):
        device      = DrawnDevice(disparity)
        folder      = tmp_path / "pair"
        left, right = textured_pair(WIDTH, HEIGHT, generator(161))
        folder.mkdir()
        cv2.imwrite(str(folder / "im0.png"), left)
        cv2.imwrite(str(folder / "im1.png"), right)
        (folder / "disp0.pfm").write_bytes(pfm_of(truth))
        known       = read_ground_truth(folder / "disp0.pfm")
        texts       = {}
        for module in (match, evaluate, matchers, demo):
            monkeypatch.setattr(module, "connect", lambda url: device)
        assert run("match", folder / "im0.png", folder / "im1.png", "-o", tmp_path / "out", "--device", "model:",
                   "--disparities", 32, "--ground-truth", folder / "disp0.pfm") == 0
        texts["match"] = capfd.readouterr().out
        assert run("eval", folder, "--device", "model:", "--disparities", 32) == 0
        texts["eval"] = capfd.readouterr().out
        simulation = contextlib.nullcontext(SimpleNamespace(udp_port=1, port=2))
        monkeypatch.setattr(demo, "load_motorcycle", lambda folder: None)
        monkeypatch.setattr(demo, "downscale", lambda pair, factor: StereoPair(left, right, known))
        monkeypatch.setattr(demo, "start_simulation", lambda: simulation)
        monkeypatch.setattr(demo, "build_directory", lambda: tmp_path)
        assert demo.main() == 1  # The drawn map does not belong to the pair.
        texts["demo"] = capfd.readouterr().out
        return texts

    return print_all


def figure(text, label):
    """Return a figure of `match` or the demonstration, named with its denominator."""
    return re.search(rf"{re.escape(label)} +(\d+\.\d\d) % of the known pixels", text)[1]


def figures_of_eval(text):
    """Return the figures of the first region, all pixels, by column."""
    heads  = text.splitlines()[0].split()
    (line,) = [line for line in text.splitlines() if line.strip().startswith("model:")][:1]
    return dict(zip(heads[heads.index("density"):], line.split()[1:], strict=False))


@pytest.mark.parametrize("salt", range(4))
def test_one_map_has_one_figure(salt, printed):
    disparity, truth = drawn(salt)
    texts    = printed(disparity, truth)
    by_eval  = figures_of_eval(texts["eval"])
    assert texts["eval"].count("known") > 4
    for label, head in FIGURES.items():
        assert figure(texts["match"], label) == figure(texts["demo"], label) == by_eval[head]
    # The common figure is bad of known, and differs from bad of valid.
    known = np.isfinite(truth) & (truth > 0)
    both  = known & (disparity > -16)
    wrong = np.count_nonzero(np.abs(disparity[both]/16 - truth[both]) > 2)
    assert by_eval["bad-2.0"] == f"{100*wrong/np.count_nonzero(known):.2f}"
    values = measure_map(disparity_pixels(disparity), np.where(known, truth, np.nan).astype(np.float32))
    assert f"{values['bad_of_valid_2_0']:.2f}" != by_eval["bad-2.0"]
