#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Figure 5.1: the size of the block."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...gateware.common.parameters import MIN_BLOCK_SIZE, MatcherParameters
from ...host_tools.core.images import disparity_pixels
from ...host_tools.data.datasets import StereoPair
from ...host_tools.evaluation.metrics import measure_map
from ...soc.reports.markdown import table
from ..cores.cosim import CosimMatcher
from ..models import block_matching as model
from .measured import BENCH, BLOCK_MATCHING, METRICS
from .middlebury import stereo_pair
from .pictures import Curve, maps, plot
from .presets import Preset, Scale
from .section import Section

#: Disparities that each pair is matched with: the fewest that reach its nearest point.
DISPARITIES = {"tsukuba": 16, "venus": 32, "cones": 64}

#: The pair of the pictures, as in the thesis, and how many of them are in a row.
SHOWN, COLUMNS = "tsukuba", 5


def matched(matcher: CosimMatcher, pair: StereoPair, disparities: int, sizes: tuple[int, ...]
            ) -> Iterator[tuple[int, NDArray[np.int16]]]:
    """Yield block size and map of each size: by gateware, or by the model if the gateware has no such block."""
    for size in sizes:
        if size < MIN_BLOCK_SIZE:
            yield size, model.match(pair.left, pair.right, disparities, size)
        else:
            yield size, matcher.match_settings(pair.left, pair.right, Preset(disparities, size).settings())[0]


def largest(scale: Scale) -> Preset:
    """Return the matcher of all maps."""
    return Preset(max(DISPARITIES.values()), max(scale.block_sizes))


def blocks_builds(scale: Scale) -> list[MatcherParameters]:
    """Return that matcher alone."""
    return [largest(scale).parameters(scale.max_width)]


def measure_blocks(scale: Scale, folder: Path) -> dict[str, Any]:
    """Measure the maps of every block size, draw the curves and the maps of one pair."""
    matcher = largest(scale).cosim(scale.max_width)
    result  = {}
    for name, disparities in DISPARITIES.items():
        pair    = stereo_pair(name)
        found   = dict(matched(matcher, pair, disparities, scale.block_sizes))
        result[name] = {size: measure_map(disparity_pixels(disparity), pair.truth) for size, disparity in found.items()}
        if name == SHOWN:
            maps(folder / "window_maps.png", [(f"{size}x{size}", disparity_pixels(disparity)) for size, disparity
                                              in found.items()], disparities - 1, COLUMNS)
    matcher.close()
    curves = [Curve(f"{name.capitalize()}, {DISPARITIES[name]} disparities", list(rows),
                    [row["bad_of_valid_1_0"] for row in rows.values()]) for name, rows in result.items()]
    plot(folder / "window_curves.png", curves, "side of the block, pixels",
         "off by more than one pixel, % of the valid pixels")
    return {"rows": result, "smallest": MIN_BLOCK_SIZE}


def fields(result: dict[str, Any]) -> dict[str, object]:
    """Return the fields of the figure."""
    header, rows = ["block"], []
    for name in result["rows"]:
        header += [f"{name.capitalize()}: bad, % of the valid pixels", "mean error, pixels",
                   "density, % of the known pixels"]
    for size in result["rows"][SHOWN]:
        quality = [pair[size] for pair in result["rows"].values()]
        rows.append([f"{size}x{size}", *(cell for one in quality for cell in (
            f"{one['bad_of_valid_1_0']:.2f}", f"{one['avgerr']:.3f}", f"{one['density']:.1f}"))])
    best = ", ".join(f"{name.capitalize()} {size}x{size}" for name, pair in result["rows"].items()
                     for size in [min(pair, key=lambda size: pair[size]["bad_of_valid_1_0"])])
    return {"table": table(header, rows), "smallest": result["smallest"], "best": best}


SECTIONS = [
    Section("Figure 5.1", "the size of the block", """\
The sum of absolute differences alone, as in the thesis, by the matcher's Verilog in Verilator. Blocks below
{smallest}x{smallest} are computed by the model, because the gateware does not have them. Known pixels have a true
disparity; valid pixels are known ones with a disparity in the map. `bad` is the share of the valid pixels that are
off by more than one pixel: `bad_of_valid` of `litestereo eval`, not Middlebury's bad, which is a share of the known
ones. The mean error is that of the valid pixels. Density is the share of the known pixels that are valid; a large
block leaves a wide border. Smallest share of bad pixels: {best}.

![Bad pixels over the side of the block](images/thesis/window_curves.png)

![Maps of Tsukuba with each block](images/thesis/window_maps.png)

{table}""", measure_blocks, fields, blocks_builds,
            sources=(*BENCH, *METRICS, *BLOCK_MATCHING), needs_pairs=True),
]
