#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The firmware's matcher on the CPU against the reference model."""

import subprocess

import numpy as np

from litestereo.sim.models.stereo_bm import stereo_bm
from support.image_pairs import awkward_pairs
from support.pairs import generator
from support.settings import SettingDraws


def on_the_cpu(programs, left, right, settings):
    """Return the map that the C program computes of a pair."""
    height, width = left.shape
    numbers = [width, height, settings.disparities, settings.block_size, settings.min_disparity,
               int(settings.prefilter == "xsobel"), settings.prefilter_cap, settings.texture_threshold,
               settings.uniqueness_ratio, settings.disp12_max_diff, int(settings.subpixel), int(settings.median)]
    header  = " ".join(map(str, numbers)) + "\n"
    done    = subprocess.run([programs / "run_stereo_bm"], input=header.encode() + left.tobytes() + right.tobytes(),
                             capture_output=True, check=False)
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
