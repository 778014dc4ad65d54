#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Figures 5.4 to 5.6: disparity maps beside the truth."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from ...host_tools.core.images import disparity_pixels
from ...host_tools.evaluation.quality import rate
from ...soc.reports.markdown import table
from .middlebury import PAIRS, stereo_pair
from .pictures import maps
from .presets import Scale
from .section import Section


def measure(name: str) -> Callable[[Scale, Path], dict[str, Any]]:
    """What matches a pair with every preset, rates the maps and draws them beside the truth."""
    def measure_pair(scale: Scale, folder: Path) -> dict[str, Any]:
        pair   = stereo_pair(name)
        images = [("truth", pair.truth)]
        rows   = []
        for preset in scale.presets:
            matcher = preset.cosim(scale.max_width)
            disparity, clocks, _ = matcher.match_settings(pair.left, pair.right, preset.settings())
            matcher.close()
            images.append((preset.name, disparity_pixels(disparity)))
            rows.append({"preset": preset.name, "clocks": clocks} | asdict(rate(disparity, pair.truth)))
        nearest = float(np.nanmax(pair.truth))
        maps(folder / f"{name}.png", images, nearest, (len(images) + 1)//2)
        return {"name": name, "rows": rows, "nearest": nearest}
    return measure_pair


def fields(result: dict[str, Any]) -> dict[str, object]:
    """Fields of a figure."""
    header = ["configuration", "off by more than one pixel, %", "mean error, pixels", "density, %", "clocks"]
    rows   = [[row["preset"], f"{row['bad_1_0']:.2f}", f"{row['mean_error']:.3f}", f"{row['density']:.1f}",
               row["clocks"]] for row in result["rows"]]
    return {"table": table(header, rows), "nearest": f"{result['nearest']:g}", "pair": result["name"],
            "name": result["name"].capitalize()}


TEXT = """\
Maps by the matcher's Verilog in Verilator, next to the truth. The nearest point has {nearest} pixels of disparity;
a matcher with fewer disparities cannot find it. Black pixels have no disparity or an unknown one. `all stages` are
those of cv2.StereoBM at its defaults, with the left-right check: they refuse doubtful pixels, which lowers the
density.

![{name}: truth and maps](images/thesis/{pair}.png)

{table}"""

SECTIONS = [Section(label, f"disparity maps of {name.capitalize()}", TEXT, measure(name), fields, needs_pairs=True)
            for label, name in zip(("Figure 5.4", "Figure 5.5", "Figure 5.6"), PAIRS, strict=True)]
