#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The images that the firmware generates: firmware/lib/pattern.h."""

import numpy as np


def pattern(width, height, seed):
    """Return words of xorshift32, little-endian, the first one after one step from the seed."""
    words = np.empty((width * height + 3) // 4, "<u4")
    state = seed
    for index in range(len(words)):
        state ^= state << 13 & 0xffffffff
        state ^= state >> 17
        state ^= state << 5 & 0xffffffff
        words[index] = state
    return words.view(np.uint8)[:width * height].reshape(height, width)
