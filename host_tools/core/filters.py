#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Filters of disparity maps, one after the other.

::

    chain = FilterChain.parse(["decimation", "spatial:filter_smooth_alpha=0.6", "temporal", "hole_filling"])
    for disparity in maps:
        filtered = chain.process(DisparityMap(disparity, settings, geometry))

docs/filters.md has the filters with their parameters, and their effect on real pairs.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from .decimation import DecimationFilter
from .disparity_map import DisparityMap
from .errors import SettingsError
from .hole_filling import HoleFillingFilter
from .map_filter import MapFilter
from .spatial import SpatialFilter
from .speckle import SpeckleMapFilter
from .temporal import TemporalFilter
from .threshold import ThresholdFilter

#: All filters, by their names.
FILTERS: dict[str, type[MapFilter]] = {one.name: one for one in (
    DecimationFilter, SpatialFilter, TemporalFilter, HoleFillingFilter, ThresholdFilter, SpeckleMapFilter)}


def parse_filter(text: str) -> MapFilter:
    """Return the filter of a text: NAME, or NAME:key=value,key=value.

    Raises
    ------
    SettingsError
        There is no such filter or parameter, a parameter is there twice, or its value is out of its range. The message
        says what is possible.
    """
    name, _, rest = text.partition(":")
    if name not in FILTERS:
        raise SettingsError(f"there is no filter '{name}', there are {', '.join(FILTERS)}")
    kind   = FILTERS[name]
    known  = kind.parameters()
    values = dict[str, Any]()
    for part in rest.split(",") if rest else []:
        key, equals, value = part.partition("=")
        if not equals or key not in known:
            raise SettingsError(f"the filter {name} has no parameter '{key}', it has "
                                + ", ".join(f"{one.name}={one.default:g}" for one in known.values())
                                if key not in known else f"{key} of the filter {name} has no value: {key}=value")
        if key in values:
            raise SettingsError(f"{key} of the filter {name} is given twice")
        values[key] = known[key].parse(name, value)
    return kind(**values)


class FilterChain:
    """Filters that are applied one after the other, in their order.

    It remembers what its filters need of earlier maps: each stream has its own chain.

    Parameters
    ----------
    filters
        The filters; none, and the chain changes nothing.
    """

    def __init__(self, filters: Iterable[MapFilter] = ()) -> None:
        self.filters = tuple(filters)

    @classmethod
    def parse(cls, texts: Iterable[str]) -> FilterChain:
        """Return the chain of the filters of texts; raise SettingsError as `parse_filter`."""
        return cls(map(parse_filter, texts))

    def __bool__(self) -> bool:
        return bool(self.filters)

    def process(self, map_: DisparityMap) -> DisparityMap:
        """Return the filtered map; `map_` remains as it is.

        Raises
        ------
        GeometryError
            A filter needs the cameras, and the map has none.
        ImageError
            The map is too small for a filter.
        """
        for one in self.filters:
            map_ = one.process(map_)
        return map_

    def reset(self) -> None:
        """Forget all earlier maps: the next one is of another scene."""
        for one in self.filters:
            one.reset()

    def needing_geometry(self) -> list[str]:
        """Return the names of the filters that need the cameras."""
        return [one.name for one in self.filters if one.needs_geometry]

    def needing_frames(self) -> list[str]:
        """Return the names of the filters that change nothing in a single frame."""
        return [one.name for one in self.filters if one.needs_frames]

    def summary(self) -> list[dict[str, Any]]:
        """Return what JSON says of the filters: name and parameters of each."""
        return [{"filter": one.name, **one.values} for one in self.filters]
