#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What all filters of disparity maps have in common: parameters with ranges and defaults, and the call.

Names, ranges and defaults are those of librealsense's filters (doc/post-processing-filters.md of librealsense 2), where
it has the filter. What librealsense counts in steps of its data is in sixteenths of a pixel here, the steps of a map.
"""

from __future__ import annotations

import abc
import contextlib
import dataclasses
import math
import operator
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from .disparity_map import DisparityMap
from .errors import SettingsError

_PARAMETER = "parameter"


@dataclass(frozen=True)
class FilterParameter:
    """A parameter of a filter: its name, its default, the least and the most it may be, and what it is.

    It is a whole number if its default is one.
    """

    name:    str
    default: int | float
    least:   int | float
    most:    int | float
    text:    str

    @property
    def whole(self) -> bool:
        """Whether it is a whole number."""
        return isinstance(self.default, int)

    @property
    def range_text(self) -> str:
        """What it may be."""
        return f"a {'whole ' if self.whole else ''}number from {self.least} to {self.most}"

    def check(self, filter_name: str, value: Any) -> None:
        """Raise SettingsError if a value is not one of this parameter."""
        if not self._allows(value):
            raise SettingsError(f"{self.name} of the filter {filter_name} must be {self.range_text}, not {value}")

    def parse(self, filter_name: str, text: str) -> int | float:
        """Return the value of a text; raise SettingsError if it is not one of this parameter."""
        value: int | float | str = text
        with contextlib.suppress(ValueError):
            value = int(text) if self.whole else float(text)
        self.check(filter_name, value)
        assert not isinstance(value, str), "a text is no value"
        return value

    def _allows(self, value: Any) -> bool:
        try:
            number = operator.index(value) if self.whole else float(value)
        except (TypeError, ValueError):
            return False
        return not isinstance(value, (bool, str)) and math.isfinite(number) and self.least <= number <= self.most


def parameter(default: Any, least: int | float, most: int | float, text: str) -> Any:
    """Return a dataclass field that is a parameter of a filter."""
    return dataclasses.field(default=default, metadata={_PARAMETER: (default, least, most, text)})


class MapFilter(abc.ABC):
    """A filter of disparity maps. Its parameters are the fields of a dataclass that `parameter` makes.

    A filter may keep what it needs of earlier maps, so each stream has its own filters.

    Raises
    ------
    SettingsError
        A parameter is out of its range.
    """

    #: Name on the command line, and what it does.
    name: ClassVar[str]
    text: ClassVar[str]

    #: Whether it needs the cameras, and whether it changes only what follows a first map.
    needs_geometry: ClassVar[bool] = False
    needs_frames:   ClassVar[bool] = False

    def __post_init__(self) -> None:
        for name, one in self.parameters().items():
            one.check(self.name, getattr(self, name))

    @classmethod
    def parameters(cls) -> Mapping[str, FilterParameter]:
        """Return the parameters by their names."""
        return {field.name: FilterParameter(field.name, *field.metadata[_PARAMETER])
                for field in dataclasses.fields(cls) # type: ignore[arg-type] # its subclasses are dataclasses
                if _PARAMETER in field.metadata}

    @property
    def values(self) -> dict[str, int | float]:
        """The values of the parameters, by their names."""
        return {name: getattr(self, name) for name in self.parameters()}

    @abc.abstractmethod
    def process(self, map_: DisparityMap) -> DisparityMap:
        """Return the filtered map; `map_` remains as it is."""

    def reset(self) -> None:  # noqa: B027 - filters that keep nothing do not override it
        """Forget all earlier maps."""
