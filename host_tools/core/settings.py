#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Parameters of the matcher."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass

from .errors import SettingsError
from .features import Feature
from .settings_table import RULES, Parameter, SettingFields

__all__ = ["DEFAULT_BLOCK_SIZE", "DEFAULT_DISPARITIES", "DISPARITY_SCALE", "DISPARITY_STEP", "MIN_BLOCK_SIZE", "RULES",
           "MatcherSettings", "Parameter"]

#: A number of disparities is a multiple of this.
DISPARITY_STEP = RULES["disparities"].step

MIN_BLOCK_SIZE = RULES["block_size"].least

#: What is matched with unless the caller chooses, or the device has less.
DEFAULT_DISPARITIES = RULES["disparities"].default
DEFAULT_BLOCK_SIZE  = RULES["block_size"].default

#: A map counts in this fraction of a pixel.
DISPARITY_SCALE = 16

Value = int | str | bool


def to_number(name: str, value: Value) -> int:
    """Return a value of the setting `name` as the protocol counts it; raises ValueError if it is no such choice."""
    return RULES[name].values.index(str(value)) if RULES[name].choice else int(value)


def from_number(name: str, number: int) -> Value:
    """Return the value of the setting `name` that the protocol counts as `number`."""
    rule = RULES[name]
    if rule.choice:
        return rule.values[number]
    return bool(number) if rule.values else number


def checked(name: str, value: Value) -> None:
    """Raise SettingsError if no device takes the value of the setting `name`."""
    rule, title = RULES[name], name.replace("_", " ")
    if rule.choice:
        if value not in rule.values:
            raise SettingsError(f"the {title} must be one of {', '.join(rule.values)}, not {value}")
        return
    number = int(value)
    if number >= rule.least and (rule.most is None or number <= rule.most) and (number - rule.least) % rule.step == 0:
        return
    if rule.step == DISPARITY_STEP:
        raise SettingsError(f"the number of {title} must be a multiple of {rule.step}, from {rule.least} on, "
                            f"not {value}")
    kind  = "an odd number" if rule.step == 2 else "a number"
    limit = f", from {rule.least} on" if rule.most is None else f" from {rule.least} to {rule.most}"
    raise SettingsError(f"the {title} must be {kind}{limit}, not {value}")


@dataclass(frozen=True)
class MatcherSettings(SettingFields):
    """Parameters that a frame is matched with: those of `cv2.StereoBM` by its names, and a few more.

    They are described, with their ranges and defaults, in `SettingFields`.

    Raises
    ------
    SettingsError
        A value that no device takes.
    """

    def __post_init__(self) -> None:
        for name in RULES:
            checked(name, getattr(self, name))

    def number(self, name: str) -> int:
        """Return the value of a setting as the protocol counts it."""
        return to_number(name, getattr(self, name))

    def is_off(self, name: str) -> bool:
        """Return whether a setting is switched off, or has no effect as another one is."""
        rule = RULES[name]
        return self.number(name) == rule.off or bool(rule.unused_without) and self.is_off(rule.unused_without)

    @property
    def parameters(self) -> Mapping[Parameter, int]:
        """The settings as parameters of the link protocol. One that has no effect is sent as switched off."""
        numbers = {}
        for name, rule in RULES.items():
            off = rule.off is not None and self.is_off(name)
            numbers[rule.parameter] = rule.off if off and rule.off is not None else self.number(name)
        return numbers

    @property
    def minimum_size(self) -> tuple[int, int]:
        """Width and height in pixels of the smallest image that has one pixel with a disparity."""
        return self.min_disparity + self.disparities + self.block_size - 1, self.block_size

    @property
    def invalid(self) -> int:
        """Value of a pixel of the map that has no disparity, in sixteenths of a pixel; others are larger."""
        return (self.min_disparity - 1)*DISPARITY_SCALE

    @property
    def features(self) -> Feature:
        """Stages that a device needs for these settings."""
        needed = Feature(0)
        for name, rule in RULES.items():
            needed |= rule.off_feature if self.is_off(name) else rule.feature
        return needed

    def without(self, missing: Feature) -> MatcherSettings:
        """Return the settings for a device that lacks the stages `missing`: what needs them is switched off."""
        needed  = self.features & missing
        changes = {}
        for name, rule in RULES.items():
            if rule.feature & needed and rule.off is not None:
                changes[name] = from_number(name, rule.off)
            elif rule.off_feature & needed:
                changes[name] = from_number(name, rule.default)
        return dataclasses.replace(self, **changes)  # type: ignore[arg-type]  # each value has the type of its field
