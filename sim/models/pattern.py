#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The test images that the firmware's command `bench` matches."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

LEFT_SEED, RIGHT_SEED = 1, 2


def pattern(width: int, height: int, seed: int) -> NDArray[np.uint8]:
    """Return the image (uint8, H x W) that firmware/lib/pattern.h fills: words of xorshift32, little-endian.

    G. Marsaglia, Xorshift RNGs, Journal of Statistical Software 8, 2003; `seed` is the state before the first word.
    """
    words = []
    for _ in range(-(-width*height//4)):
        seed ^= seed << 13 & 0xffffffff
        seed ^= seed >> 17
        seed ^= seed << 5 & 0xffffffff
        words.append(seed)
    return np.array(words, "<u4").view(np.uint8)[:width*height].reshape(height, width)
