#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Made-up stereo pairs."""

from __future__ import annotations

import os
import random

import numpy as np
from numpy.typing import NDArray

#: Seed of all random tests; set LITESTEREO_SEED to repeat a run, or to try another.
SEED = int(os.environ.get("LITESTEREO_SEED", "1"))


def generator(*salt: int) -> np.random.Generator:
    """Return a NumPy generator for one test, and print its seed for the report of a failure."""
    print(f"LITESTEREO_SEED={SEED}, salt {salt}")
    return np.random.default_rng([SEED, *salt])


def byte_generator(*salt: int) -> random.Random:
    """Return a Python generator for one test, and print its seed for the report of a failure."""
    print(f"LITESTEREO_SEED={SEED}, salt {salt}")
    return random.Random(repr((SEED, *salt)))


def textured_pair(width: int, height: int, rng: np.random.Generator, shift: int = 7
                  ) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Return a left and a right image (uint8, H x W) of noise, `shift` pixels apart."""
    scene = rng.integers(0, 256, (height, width + shift), np.uint8)
    return np.ascontiguousarray(scene[:, :width]), np.ascontiguousarray(scene[:, shift:])


def pairs(count: int, width: int = 110, height: int = 60, salt: int = 50
          ) -> list[tuple[NDArray[np.uint8], NDArray[np.uint8]]]:
    """Return pairs with shifts of 3 to 22 pixels, which 32 disparities cover: maps that are all invalid look alike."""
    rng = generator(salt)
    return [textured_pair(width, height, rng, 3 + index % 20) for index in range(count)]
