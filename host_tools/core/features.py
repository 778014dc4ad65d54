#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Optional stages of a matcher."""

from __future__ import annotations

import enum


class Feature(enum.IntFlag):
    """What a device was built with: the bits of its capability word. All up to MEDIAN are stages of the matcher."""

    XSOBEL        = 1 << 0
    RAW           = 1 << 1
    TEXTURE       = 1 << 2
    UNIQUENESS    = 1 << 3
    SUBPIXEL      = 1 << 4
    LEFT_RIGHT    = 1 << 5
    MIN_DISPARITY = 1 << 6
    MEDIAN        = 1 << 7
    STREAMING     = 1 << 8
    UPDATE        = 1 << 9


#: Every stage that there is.
ALL_FEATURES = Feature(0xff)

#: What each stage is for, in a few words.
DESCRIPTIONS = {
    Feature.XSOBEL:        "the XSOBEL prefilter",
    Feature.RAW:           "matching without prefilter",
    Feature.TEXTURE:       "the texture test",
    Feature.UNIQUENESS:    "the uniqueness test",
    Feature.SUBPIXEL:      "fractions of a pixel",
    Feature.LEFT_RIGHT:    "the left-right check",
    Feature.MIN_DISPARITY: "a smallest disparity above 0",
    Feature.MEDIAN:        "the median",
}


def feature_names(features: int) -> list[str]:
    """Names of the features in a capability word; bits that are not known count as their number."""
    known = [feature.name.lower() for feature in Feature if features & feature and feature.name]
    return known + [f"bit {bit}" for bit in range(len(Feature), 32) if features >> bit & 1]
