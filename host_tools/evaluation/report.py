#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Rows of an evaluation as a table, as CSV, and as what JSON has."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import rich.box
import rich.table

from ..errors import ImageError
from .metrics import METRICS
from .regions import REGIONS
from .work import Row

#: Metrics of the table, which has no place for all of them, and the heads of their columns.
_COLUMNS = {
    "density":            "density %",
    "bad_1_0":            "bad-1.0 %",
    "bad_2_0":            "bad-2.0 %",
    "bad_or_invalid_2_0": "or inv. %",
    "avgerr":             "avgerr",
    "rms":                "rms",
    "a90":                "A90",
    "d1":                 "D1 %",
}

#: Name of the rows that are means over the pairs.
MEAN = "mean"


def means(rows: Sequence[Row]) -> list[Row]:
    """A row for each matcher and region: means over the pairs, each of the same weight, of those that have a value."""
    found: list[Row] = []
    kinds = dict.fromkeys((row.matcher, row.region) for row in rows)
    for matcher, region in sorted(kinds, key=lambda kind: REGIONS.index(kind[1])):
        same   = [row.metrics for row in rows if (row.matcher, row.region) == (matcher, region)]
        values = {name: [metrics[name] for metrics in same if not math.isnan(metrics[name])] for name in METRICS}
        found.append(Row(MEAN, matcher, region, {name: sum(numbers)/len(numbers) if numbers else math.nan
                                                 for name, numbers in values.items()}))
    return found


def table(rows: Sequence[Row]) -> rich.table.Table:
    """The rows for people, with means below if there are several pairs."""
    built = rich.table.Table(box=rich.box.SIMPLE)
    for name in ("pair", "region", "matcher"):
        built.add_column(name, overflow="fold")
    for head in _COLUMNS.values():
        built.add_column(head, justify="right", no_wrap=True)
    # Matchers one below the other, to be compared.
    pairs = list(dict.fromkeys((row.pair, row.region) for row in rows))
    lines = sorted(rows, key=lambda row: pairs.index((row.pair, row.region)))
    lines += means(rows) if len({row.pair for row in rows}) > 1 else []
    for number, row in enumerate(lines):
        last = number + 1 == len(lines) or lines[number + 1].pair != row.pair
        built.add_row(row.pair, row.region, row.matcher, *(_text(row.metrics[name]) for name in _COLUMNS),
                      end_section=last)
    return built


def _text(value: float) -> str:
    return "-" if math.isnan(value) else f"{value:.2f}"


def as_json(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """The rows as JSON has them: null where there is no value."""
    return [{"pair": row.pair, "matcher": row.matcher, "region": row.region,
             **{name: None if math.isnan(value) else value for name, value in row.metrics.items()}} for row in rows]


def write_csv(path: Path, rows: Sequence[Row]) -> None:
    """Writes the rows, empty where there is no value; raises ImageError if that cannot be."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, ["pair", "matcher", "region", *METRICS], lineterminator="\n")
            writer.writeheader()
            writer.writerows(as_json(rows))
    except OSError as error:
        raise ImageError(f"{path}: cannot be written: {error.strerror or error}") from None
