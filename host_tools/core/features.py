#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What a device can have, by name."""

from __future__ import annotations

from collections.abc import Mapping

from .features_table import ALL_STAGES, CAPABILITY_TEXTS, DESCRIPTIONS, Capability, Feature

__all__ = ["ALL_STAGES", "CAPABILITY_TEXTS", "DESCRIPTIONS", "OPENCV_STAGES", "Capability", "Feature", "feature_names",
           "named_capabilities"]

#: The stages of cv2.StereoBM, which always has a prefilter, and no median.
OPENCV_STAGES = ALL_STAGES & ~(Feature.RAW | Feature.MEDIAN)


def feature_names(features: int) -> list[str]:
    """Names of the features in a capability word; bits that are not known count as their number."""
    known = [feature.name.lower() for feature in Feature if features & feature and feature.name]
    return known + [f"bit {bit}" for bit in range(len(Feature), 32) if features >> bit & 1]


def named_capabilities(values: Mapping[int, int]) -> dict[str, int]:
    """Return the values of a device by name, of those numbers that are known here."""
    return {known.name.lower(): values[known] for known in Capability if known in values}
