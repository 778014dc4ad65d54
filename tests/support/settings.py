#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Random settings, at and around every limit of their ranges."""

from __future__ import annotations

from litestereo.host_tools.core.settings import MatcherSettings, from_number

from .limits import Draws, Rng, setting_ranges

#: Values for maps with disparities, which most values of these settings have not: see `Draws`.
USUAL = {
    "min_disparity":     [0, 0, 0, 1, 5, 40],
    "texture_threshold": [0, 10, 200, 1500],
    "uniqueness_ratio":  [0, 1, 5, 15, 40],
    "disp12_max_diff":   [-1, 0, 1, 2, 10],
}

#: Largest cap for which cv2.StereoBM's left-right check has correct costs.
LARGEST_CAP_WITH_CHECK = 31


#: Largest block and most disparities, unless a test has its own device.
SMALL_DEVICE = {"block_size": 21, "disparities": 64}


class UncheckedSettings(MatcherSettings):
    """Settings outside the range of any device: the model's range is OpenCV's, with disparities below zero."""

    def __post_init__(self) -> None:
        """Check nothing."""


class SettingDraws(Draws):
    """Draw settings from the whole range of the gateware, which is wider than that of OpenCV.

    Parameters
    ----------
    rng
        It seeds the draws.
    most
        Narrower ranges of some settings, as a device has them.
    """
    def __init__(self, rng: Rng, **most: int) -> None:
        super().__init__(rng, setting_ranges(**SMALL_DEVICE | most), USUAL)

    def settings(self) -> MatcherSettings:
        """Draw settings."""
        return _settings({name: self(name) for name in self.ranges})


class OpenCVDraws(Draws):
    """Draw settings from the whole range that cv2.StereoBM has, and computes without an error.

    Parameters
    ----------
    rng
        It seeds the draws.
    fixed_min_disparity
        Smallest disparity, if it is not drawn; negative ones are none of a device's.
    most
        Narrower ranges of some settings, as a device has them.
    """
    def __init__(self, rng: Rng, fixed_min_disparity: int | None = None, **most: int) -> None:
        ranges = setting_ranges(**SMALL_DEVICE | most)
        absent = {"prefilter", "subpixel", "median"} | ({"min_disparity"} if fixed_min_disparity is not None else set())
        super().__init__(rng, {name: one for name, one in ranges.items() if name not in absent},
                         USUAL | {"prefilter_cap": range(1, LARGEST_CAP_WITH_CHECK + 1)})
        self._fixed = {} if fixed_min_disparity is None else {"min_disparity": fixed_min_disparity}

    def settings(self) -> MatcherSettings:
        """Draw settings."""
        numbers  = self._fixed | {name: self(name) for name in self.ranges if name != "disp12_max_diff"}
        numbers |= {"disp12_max_diff": self("disp12_max_diff") if numbers["prefilter_cap"] <= LARGEST_CAP_WITH_CHECK
                    else -1}
        return _settings(numbers)


def _settings(numbers: dict[str, int]) -> MatcherSettings:
    """Return settings by the numbers that the protocol has for them."""
    make = MatcherSettings if numbers["min_disparity"] >= 0 else UncheckedSettings
    return make(**{name: from_number(name, number) for name, number in numbers.items()})
