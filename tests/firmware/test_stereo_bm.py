#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The firmware's matcher on the CPU against the reference model."""

import subprocess

import numpy as np
import pytest

from litestereo.host_tools.core.settings import RULES, MatcherSettings
from litestereo.sim.models.stereo_bm import stereo_bm
from support.image_pairs import awkward_pairs
from support.limits import setting_ranges
from support.pairs import generator
from support.settings import SettingDraws


def run(programs, left, right, numbers):
    """Run the C program on a pair, with the settings as numbers."""
    header = " ".join(map(str, (left.shape[1], left.shape[0], *numbers))) + "\n"
    return subprocess.run([programs / "run_stereo_bm"], input=header.encode() + left.tobytes() + right.tobytes(),
                          capture_output=True, check=False)


def on_the_cpu(programs, left, right, settings):
    """Return the map that the C program computes of a pair."""
    height, width = left.shape
    done = run(programs, left, right, [settings.number(name) for name in RULES])
    assert done.returncode == 0, done.stderr.decode()
    return np.frombuffer(done.stdout, np.int16).reshape(height, width)


def test_equals_the_model(programs):
    """With any settings and every stage, the map of an awkward pair is the model's, down to the smallest size."""
    rng   = generator(80)
    draws = SettingDraws(rng)
    for number in range(25):
        settings      = draws.settings()
        width, height = settings.minimum_size
        if number % 4:
            width  += int(rng.integers(0, 40))
            height += int(rng.integers(0, 12))
        for name, left, right in awkward_pairs(rng, width, height):
            found = on_the_cpu(programs, left, right, settings)
            assert np.array_equal(found, stereo_bm(left, right, settings)), (name, width, height, settings)
    draws.check()


@pytest.mark.parametrize("name", RULES)
def test_settings_at_and_beyond_every_limit(programs, name):
    """The firmware accepts the values at each limit, and refuses the first ones beyond it."""
    one      = setting_ranges()[name]
    image    = np.zeros((255, 255 + 256 + 254), np.uint8)
    plain    = MatcherSettings(16, 5, prefilter="none", disp12_max_diff=-1)
    for value in [*one.ends, *one.beyond(-2**31, 2**31 - 1)]:
        numbers = [value if name == other else plain.number(other) for other in RULES]
        small   = image if value in one and name in ("disparities", "block_size", "min_disparity") else image[:5, :20]
        done    = run(programs, small, small, numbers)
        assert (done.returncode == 0) == (value in one), (value, done.stderr.decode())
        assert value in one or b"stereo_settings_set" in done.stderr
