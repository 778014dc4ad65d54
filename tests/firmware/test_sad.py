#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The firmware's matcher on the CPU against the reference model."""

import subprocess

import numpy as np
import pytest

from litestereo.sim import model


def sad(programs, left, right, disparities, block_size):
    height, width = left.shape
    header = f"{width} {height} {disparities} {block_size}\n".encode()
    done   = subprocess.run([programs / "run_sad"], input=header + left.tobytes() + right.tobytes(),
                            capture_output=True, check=False)
    assert done.returncode == 0, done.stderr.decode()
    return np.frombuffer(done.stdout, np.int16).reshape(height, width)


@pytest.mark.parametrize(("width", "height", "disparities", "block_size"), [
    (20, 5, 16, 5),
    (36, 21, 16, 21),
    (61, 43, 32, 9),
    (84, 21, 64, 21),
    (97, 33, 64, 7),
    (40, 11, 32, 9),
])
@pytest.mark.parametrize("levels", [256, 4, 1])
def test_sad_equals_the_model(programs, width, height, disparities, block_size, levels):
    """Few grey levels make many equal costs, of which the largest disparity has to win."""
    rng   = np.random.default_rng([width, height, disparities, levels])
    left  = rng.integers(0, levels, (height, width), np.uint8)
    right = rng.integers(0, levels, (height, width), np.uint8)
    right[:, :-5] = np.where(rng.random((height, width - 5)) < 0.8, left[:, 5:], right[:, :-5])
    assert np.array_equal(sad(programs, left, right, disparities, block_size),
                          model.match(left, right, disparities, block_size))
