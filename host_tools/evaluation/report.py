#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Rows of an evaluation as a table, as CSV and as JSON."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import rich.box
import rich.table
import rich.text

from ..core.outputs import write_file
from ..data.regions import REGIONS
from .metrics import METRICS, json_values
from .work import Row

#: Metrics of the table, and the heads of their columns, with unit and denominator: as many as fit 80 characters.
_COLUMNS = {
    "density":            "density\n% of\nknown",
    "bad_1_0":            "bad-1.0\n% of\nknown",
    "bad_2_0":            "bad-2.0\n% of\nknown",
    "bad_or_invalid_2_0": "or none\n% of\nknown",
    "avgerr":             "avgerr\npx of\nvalid",
    "a90":                "A90\npx of\nvalid",
    "d1":                 "D1\n% of\nknown",
}

#: What the heads mean.
_CAPTION = "known: pixels with a true disparity; valid: known pixels with a disparity in the map"

#: Least width of the column of names, in characters: what the other columns leave of 80.
_NAME_WIDTH = 20

#: Name of the rows that are means over the pairs.
MEAN = "mean"


def means(rows: Sequence[Row]) -> list[Row]:
    """Return a row for each matcher and region: the means over the pairs that have a value, each of equal weight."""
    found: list[Row] = []
    kinds = dict.fromkeys((row.matcher, row.region) for row in rows)
    for matcher, region in sorted(kinds, key=lambda kind: REGIONS.index(kind[1])):
        same   = [row.metrics for row in rows if (row.matcher, row.region) == (matcher, region)]
        values = {name: [metrics[name] for metrics in same if not math.isnan(metrics[name])] for name in METRICS}
        found.append(Row(MEAN, matcher, region, {name: sum(numbers)/len(numbers) if numbers else math.nan
                                                 for name, numbers in values.items()}))
    return found


def table(rows: Sequence[Row]) -> rich.table.Table:
    """Build a table of the rows, with the matchers of a pair one below the other.

    If there are several pairs the means are its last rows.
    """
    built = rich.table.Table(box=rich.box.SIMPLE, collapse_padding=True, pad_edge=False, show_edge=False,
                             caption=_CAPTION, caption_justify="left")
    built.add_column("pair, region\n  matcher", overflow="fold", min_width=_NAME_WIDTH)
    for head in _COLUMNS.values():
        built.add_column(head, justify="right", no_wrap=True)
    lines  = [*rows, *(means(rows) if len({row.pair for row in rows}) > 1 else ())]
    groups = dict.fromkeys((row.pair, row.region) for row in lines)
    for pair, region in groups:
        # A plain string would be parsed as rich's markup, and a name may have brackets.
        built.add_row(rich.text.Text(f"{pair}, {region}"))
        for row in lines:
            if (row.pair, row.region) == (pair, region):
                built.add_row(rich.text.Text(f"  {row.matcher}"), *(_text(row.metrics[name]) for name in _COLUMNS))
        built.add_section()
    return built


def _text(value: float) -> str:
    return "-" if math.isnan(value) else f"{value:.2f}"


def as_json(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """Return the rows for JSON: None where there is no value."""
    return [{"pair": row.pair, "matcher": row.matcher, "region": row.region, **json_values(row.metrics)}
            for row in rows]


def write_csv(path: Path, rows: Sequence[Row]) -> None:
    """Write the rows, with empty cells where there is no value; raise ImageError if the file cannot be written."""
    buffer = io.StringIO(newline="")
    writer = csv.DictWriter(buffer, ["pair", "matcher", "region", *METRICS], lineterminator="\n")
    writer.writeheader()
    writer.writerows(as_json(rows))
    write_file(path, buffer.getvalue().encode("utf-8", "surrogateescape"))
