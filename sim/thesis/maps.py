#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Figures 5.4 to 5.6: disparity maps beside the truth."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ...host_tools.core.images import disparity_pixels
from ...host_tools.evaluation.metrics import measure_map
from ...soc.reports.markdown import table
from .measured import BENCH, METRICS
from .middlebury import PAIRS, stereo_pair
from .pictures import maps
from .presets import Scale
from .section import Section


def measure_pair(name: str) -> Callable[[Scale, Path], dict[str, Any]]:
    """Return a function that matches a pair with every preset, measures the maps and draws them beside the truth."""
    def measure(scale: Scale, folder: Path) -> dict[str, Any]:
        pair   = stereo_pair(name)
        images = [("truth", pair.truth)]
        rows   = []
        for preset in scale.presets:
            matcher = preset.cosim(scale.max_width)
            disparity, clocks, _ = matcher.match_settings(pair.left, pair.right, preset.settings())
            matcher.close()
            images.append((preset.name, disparity_pixels(disparity)))
            rows.append({"preset": preset.name, "clocks": clocks} | measure_map(images[-1][1], pair.truth))
        nearest = float(np.nanmax(pair.truth))
        maps(folder / f"{name}.png", images, nearest, (len(images) + 1)//2)
        return {"name": name, "rows": rows, "nearest": nearest}
    return measure


def fields(result: dict[str, Any]) -> dict[str, object]:
    """Return the fields of a figure."""
    header = ["configuration", "off by more than one pixel, % of the valid pixels", "mean error, pixels",
              "density, % of the known pixels", "clocks"]
    rows   = [[row["preset"], f"{row['bad_of_valid_1_0']:.2f}", f"{row['avgerr']:.3f}", f"{row['density']:.1f}",
               row["clocks"]] for row in result["rows"]]
    return {"table": table(header, rows), "nearest": f"{result['nearest']:g}", "pair": result["name"],
            "name": result["name"].capitalize()}


TEXT = """\
Maps by the matcher's Verilog in Verilator, next to the truth. The nearest point has {nearest} pixels of disparity;
a matcher with fewer disparities cannot find it. Black pixels have no disparity or an unknown one. `all stages` are
those of cv2.StereoBM at its defaults, with the left-right check: they refuse doubtful pixels, which lowers the
density. Known pixels have a true disparity; valid pixels are known ones with a disparity in the map. The mean error is
that of the valid pixels.

![{name}: truth and maps](images/thesis/{pair}.png)

{table}"""

SECTIONS = [Section(label, f"disparity maps of {name.capitalize()}", TEXT, measure_pair(name), fields, Scale.wide,
                    sources=(*BENCH, *METRICS), needs_pairs=True)
            for label, name in zip(("Figure 5.4", "Figure 5.5", "Figure 5.6"), PAIRS, strict=True)]
