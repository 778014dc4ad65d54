#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Optional stages of a matcher."""

from __future__ import annotations

from .features_table import ALL_STAGES, DESCRIPTIONS, Feature

__all__ = ["ALL_STAGES", "DESCRIPTIONS", "Feature", "feature_names"]


def feature_names(features: int) -> list[str]:
    """Names of the features in a capability word; bits that are not known count as their number."""
    known = [feature.name.lower() for feature in Feature if features & feature and feature.name]
    return known + [f"bit {bit}" for bit in range(len(Feature), 32) if features >> bit & 1]
