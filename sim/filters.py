#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Writes docs/filters.md: the filters of disparity maps, and what they do to the maps of five real pairs."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import rich.console
import rich.progress
from numpy.typing import NDArray

from ..host_tools.core.disparity_map import DisparityMap
from ..host_tools.core.errors import LiteStereoError
from ..host_tools.core.filters import FILTERS, FilterChain
from ..host_tools.core.settings import MatcherSettings
from ..host_tools.data.datasets import StereoPair
from ..host_tools.evaluation.metrics import measure_map
from ..soc.build.pages import Page
from ..soc.build.paths import PACKAGE_DIR, build_directory, built_once, code_key, content_key
from ..soc.reports.markdown import table
from .accuracy import CREDIT, load_pairs
from .models.stereo_bm import stereo_bm

#: The maps are matched with the defaults.
SETTINGS = MatcherSettings()

#: Rows of the tables: the filters, one after the other.
CHAINS: tuple[tuple[str, ...], ...] = (
    (),
    *((f"decimation:filter_magnitude={factor}",) for factor in (2, 3, 4, 8)),
    ("spatial",), ("spatial:filter_magnitude=5,filter_smooth_alpha=0.25",), ("spatial:holes_fill=2",),
    *((f"hole_filling:holes_fill={mode}",) for mode in range(3)),
    ("speckle",), ("speckle", "spatial", "hole_filling"), ("decimation", "spatial", "hole_filling"),
)

#: The same for frames of one scene that follow each other.
SEQUENCE_CHAINS: tuple[tuple[str, ...], ...] = (
    (), ("temporal",), ("temporal:holes_fill=0",), ("temporal:holes_fill=8",),
    ("temporal:filter_smooth_alpha=0.1",), ("spatial", "temporal"),
)

#: Frames of such a scene, and the standard deviation of their noise, in grey levels.
FRAMES, NOISE = 8, 4.0

#: Figures: the title of each table, and the metric.
FIGURES = {
    "Density, % of the known pixels": "density",
    "bad-2.0, % of the known pixels": "bad_2_0",
    "Lost, % of the known pixels":    "bad_or_invalid_2_0",
}

#: What the figures depend on, apart from pairs and settings.
CODE = tuple(PACKAGE_DIR / name for name in (
    "sim/models", "host_tools/evaluation/metrics.py",
    *(f"host_tools/core/{name}.py" for name in ("decimation", "disparity_map", "filters", "geometry", "hole_filling",
                                                "map_filter", "spatial", "speckle", "temporal", "threshold"))))

HEADER = """\
# Filters

Filters change disparity maps on the host, after the match. They have the names, the parameters, the ranges and the
defaults of [librealsense's post-processing filters][librealsense]; `speckle` is OpenCV's. `make filters` writes this
page.

    litestereo stream left/ right/ --device model: -o maps --filter decimation --filter spatial:filter_magnitude=3
    litestereo match left.png right.png -o out --device model: --filter speckle --filter hole_filling:holes_fill=2

`match`, `stream`, `view`, `measure` and `eval` have `--filter`. It may be repeated: each filter gets the map of the one
before. In Python:

    from litestereo.host_tools import DisparityMap, FilterChain

    chain = FilterChain.parse(["spatial", "temporal:holes_fill=8"])
    for result in device.stream(pairs, settings):
        filtered = chain.process(DisparityMap(result.disparity, settings, geometry))

librealsense recommends the order decimation, spatial, temporal, hole_filling. It converts depths to disparities for the
two in the middle; here all maps are of disparities.

[librealsense]: https://github.com/IntelRealSense/librealsense/blob/master/doc/post-processing-filters.md

## What they do

- Maps are int16, in sixteenths of a pixel, before and after each filter. `spatial` and `temporal` count with real
  numbers inside, and round once, to the nearest sixteenth. `hole_filling`, `threshold` and `speckle` never change a
  disparity that remains.
- A pixel without a disparity is never mixed with others. `decimation` leaves it out; `spatial` smooths neither across
  it nor into it; `temporal` skips it. Four fill holes: `decimation`, where one of the pixels is known; `spatial` and
  `temporal` by their `holes_fill`; `hole_filling`. `threshold` and `speckle` make holes.
- `decimation` makes larger pixels, and all that counts in pixels changes with them: disparities and their range, focal
  lengths, principal points. Depth and points are computed with these; `geometry` in the JSON has them. The depth of a
  point stays, but its steps become coarser: disparities are still whole sixteenths, now of larger pixels. `export`
  refuses such a map with the cameras of the images, because their sizes differ.
- `temporal` keeps 5 bytes per pixel. It begins anew with each stream, and with a map of another size. A single frame
  remains as it is.
- `threshold` needs the cameras: `--calibration`.
- Lengths that librealsense counts in steps of its data (`filter_smooth_delta`) are sixteenths of a pixel.

| filter | does |
| --- | --- |
"""

FIGURES_TEXT = f"""\
## Effect on five pairs

The maps are those of the reference model with the default settings: {SETTINGS.disparities} disparities, block
{SETTINGS.block_size}x{SETTINGS.block_size}. The figures are those of `litestereo eval`, whose `--filter` repeats them
for any matcher. Density is the share of the known pixels that have a disparity; `bad-2.0` the share that has one more
than 2 pixels off; lost are both, the pixels without a disparity and the bad ones (`bad_or_invalid_2_0`). A decimated
map is rated in the images: each of its pixels is compared with the true disparities of all pixels that it is made of.
`threshold` is not in the tables, because it needs cameras.
"""

SEQUENCE_TEXT = f"""\
## Effect on frames that follow each other

`temporal` needs several frames. These are the figures of the last of {FRAMES} frames of each scene: the pair with
different normal noise in each frame, of {NOISE:g} grey levels (standard deviation), in both images.
"""


# Measurement --------------------------------------------------------------------------------------

def matched(pair: StereoPair) -> NDArray[np.int16]:
    """Return the model's map of a pair; it is computed once for each content."""
    key = content_key([repr(SETTINGS), pair.left.tobytes(), pair.right.tobytes(), repr(pair.left.shape),
                       code_key(PACKAGE_DIR / "sim/models")])

    def compute(folder: Path) -> None:
        np.save(folder / "map.npy", stereo_bm(pair.left, pair.right, SETTINGS))

    found: NDArray[np.int16] = np.load(built_once(build_directory() / "filters" / key, compute) / "map.npy")
    return found


def noisy(pair: StereoPair) -> Iterator[StereoPair]:
    """Yield the frames of a scene; equal at each call."""
    rng = np.random.default_rng(FRAMES)
    for _ in range(FRAMES):
        left, right = (np.clip(np.rint(image + rng.normal(0, NOISE, image.shape)), 0, 255).astype(np.uint8)
                       for image in (pair.left, pair.right))
        yield StereoPair(left, right, pair.truth)


def measure(maps: Sequence[NDArray[np.int16]], truth: NDArray[np.float32], chain: Sequence[str]) -> dict[str, float]:
    """Return the metrics of the last of several maps of a scene, after a chain of filters."""
    filters = FilterChain.parse(chain)
    last    = [filters.process(DisparityMap(disparity, SETTINGS)) for disparity in maps][-1]
    return measure_map(last.in_images(truth.shape), truth)


@dataclass(frozen=True)
class Row:
    """A row of the tables: the filters, and the metrics of each pair by its name."""

    chain:   tuple[str, ...]
    metrics: Mapping[str, Mapping[str, float]]


# Page ---------------------------------------------------------------------------------------------

def filter_rows() -> str:
    """Return the rest of the table of filters, and that of the parameters."""
    lines  = [f"| `{name}` | {kind.text} |" for name, kind in FILTERS.items()]
    header = ["filter", "parameter", "range", "default", "is"]
    rows: list[list[object]] = [[f"`{name}`", f"`{one.name}`", f"{one.least} to {one.most}", f"{one.default:g}",
                                 one.text]
                                for name, kind in FILTERS.items() for one in kind.parameters().values()]
    return "\n".join([*lines, "", table(header, rows)])


def result_rows(rows: Sequence[Row], metric: str) -> list[list[object]]:
    """Return the rows of a table: filters, the metric of each pair, and the mean."""
    found: list[list[object]] = []
    for row in rows:
        values = [metrics[metric] for metrics in row.metrics.values()]
        name   = ", ".join(f"`{text}`" for text in row.chain) or "none"
        found.append([name, *(f"{value:.1f}" for value in values), f"{sum(values)/len(values):.1f}"])
    return found


def document(rows: Sequence[Row], sequences: Sequence[Row], pairs: Sequence[str]) -> str:
    """Return the page."""
    header = ["filters", *(name.capitalize() for name in pairs), "mean"]
    parts  = [HEADER + filter_rows()]
    for text, measured in ((FIGURES_TEXT, rows), (SEQUENCE_TEXT, sequences)):
        parts.append(text)
        parts += [f"**{title}**\n\n{table(header, result_rows(measured, metric))}" for title, metric in FIGURES.items()]
    return "\n".join([*parts, CREDIT])


def key() -> str:
    """Return the content key of the page: the matcher, the filters and the metrics."""
    return content_key([repr(SETTINGS), code_key(*CODE, Path(__file__))])


PAGE = Page("docs/filters.md", "filters", key, minutes=5)


def main() -> int:
    """Write the page; return the exit status."""
    try:
        pairs   = load_pairs()
        single  = dict[str, list[NDArray[np.int16]]]()
        several = dict[str, list[NDArray[np.int16]]]()
        with rich.progress.Progress(console=rich.console.Console(stderr=True)) as bars:
            for name, pair in bars.track(pairs.items(), description="match"):
                single[name]  = [matched(pair)]
                several[name] = [matched(frame) for frame in noisy(pair)]

        def rows(chains: Sequence[tuple[str, ...]], maps: Mapping[str, list[NDArray[np.int16]]]) -> list[Row]:
            return [Row(chain, {name: measure(maps[name], pair.truth, chain) for name, pair in pairs.items()})
                    for chain in chains]

        PAGE.write(document(rows(CHAINS, single), rows(SEQUENCE_CHAINS, several), list(pairs)))
    except (LiteStereoError, OSError) as error:
        print(f"filters: error: {' '.join(str(error).split())}", file=sys.stderr)
        return 1
    print(f"written: {PAGE.path}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
