#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Tables 5.5 and 5.6 and figure 5.2: clocks of an image pair, and the frame rates that follow from them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...gateware.common.parameters import MatcherParameters
from ...host_tools.devices.connect import Device, connect
from ...soc.reports.markdown import table
from ..models.pattern import LEFT_SEED, RIGHT_SEED, pattern
from ..models.stereo_bm import stereo_bm
from ..socs.matcher import MATCHER
from ..system.build import MEMORIES
from .area import placed_by, placed_mhz
from .measured import BENCH, MODEL
from .pictures import Curve, plot
from .presets import PUBLISHED, Preset, Scale
from .section import PACKAGE, Section

Row = dict[str, Any]

#: Largest frame, in pixels, whose map is compared with that of the model, which is slow.
CHECKED_PIXELS = 640*480


class WrongMap(RuntimeError):
    """The gateware's map is not the model's."""


def cosim_clocks(scale: Scale, preset: Preset, sizes: Sequence[tuple[int, int]]) -> list[int]:
    """Return the clocks from the first pixel pair in to the last pixel of the map out, for each width and height.

    Raises
    ------
    WrongMap
        A map that is compared is not the model's.
    """
    matcher  = preset.cosim(scale.max_width)
    settings = preset.settings()
    found    = []
    for width, height in sizes:
        left, right = (pattern(width, height, seed) for seed in (LEFT_SEED, RIGHT_SEED))
        matcher.core.reset()  # Immediately after a frame the next one waits a clock longer.
        disparity, clocks, _ = matcher.match_settings(left, right, settings)
        if width*height <= CHECKED_PIXELS and not np.array_equal(disparity, stereo_bm(left, right, settings)):
            raise WrongMap(f"the map of {preset.name} at {width}x{height} is not the model's")
        found.append(clocks)
    matcher.close()
    return found


def fits_system(scale: Scale, preset: Preset) -> bool:
    """Return whether the matcher of the simulated SoC, which has all stages, is large enough for a preset."""
    return (scale.width <= MATCHER.max_width and preset.disparities <= MATCHER.disparities
            and preset.block_size <= MATCHER.max_block_size)


def system_clocks(device: Device, scale: Scale, preset: Preset) -> int:
    """Return the clocks of a frame from memory to memory on a device; raise WrongMap if its map is wrong."""
    settings    = preset.settings()
    left, right = (pattern(scale.width, scale.height, seed) for seed in (LEFT_SEED, RIGHT_SEED))
    result      = device.compute(left, right, settings)
    if not np.array_equal(result.disparity, stereo_bm(left, right, settings)):
        raise WrongMap(f"the full system's map of {preset.name} is not the model's")
    return result.clocks or 0


# Table 5.5 ----------------------------------------------------------------------------------------

def measure_clocks(scale: Scale, folder: Path) -> list[Row]:
    """Measure the clocks of the matcher alone, and from memory to memory in the full system."""
    rows = []
    for preset in scale.presets:
        (clocks,) = cosim_clocks(scale, preset, [(scale.width, scale.height)])
        rows.append({"preset": preset.name, "width": scale.width, "height": scale.height, "clocks": clocks})
    if any(fits_system(scale, preset) for preset in scale.presets):
        with connect(f"sim:?ram={MEMORIES[0]}") as device:
            for preset, row in zip(scale.presets, rows, strict=True):
                if fits_system(scale, preset):
                    row["system"] = system_clocks(device, scale, preset)
    return rows


def clock_fields(result: list[Row]) -> dict[str, object]:
    """Return the fields of table 5.5."""
    names  = {"clocks": "matcher alone", "system": "full system"}
    header = ["configuration", *(f"{name}, clocks" for name in names.values()),
              *(f"{name}, clocks per pixel" for name in names.values())]
    rows   = [[row["preset"], *(row.get(key, "") for key in names),
               *(f"{row[key]/(row['width']*row['height']):.4f}" if key in row else "" for key in names)]
              for row in result]
    return {"table": table(header, rows), "width": result[0]["width"], "height": result[0]["height"]}


# Table 5.6 and figure 5.2 -------------------------------------------------------------------------

def rate_builds(scale: Scale) -> list[MatcherParameters]:
    """Return the matchers that are simulated, and those that are placed."""
    return scale.wide() + scale.narrow()


def measure_rates(scale: Scale, folder: Path) -> dict[str, Any]:
    """Measure the clocks of frames of many sizes and the clock that each preset reaches, and draw the plot."""
    rows   = []
    curves = []
    for preset in scale.presets:
        clocks = cosim_clocks(scale, preset, scale.sizes)
        rows.append({"preset": preset.name, "clocks": clocks, "published_fps": preset.published_fps,
                     "mhz": placed_mhz(scale, preset)})
        curves.append(Curve(preset.name, [width*height for width, height in scale.sizes],
                            [1e6*scale.clock_mhz/count for count in clocks]))
    thesis = [preset for preset in scale.presets if preset.published_fps]
    blocks = " and ".join(f"{preset.block_size}x{preset.block_size}" for preset in thesis)
    curves.append(Curve(f"thesis, {blocks} {PUBLISHED}", [scale.width*scale.height]*len(thesis),
                        [preset.published_fps or 0.0 for preset in thesis], published=True))
    plot(folder / "frame_rate.png", curves, "pixels of an image",
         f"frames per second, ours at {scale.clock_mhz} MHz", logarithmic=True)
    return {"rows": rows, "sizes": scale.sizes, "clock_mhz": scale.clock_mhz,
            "frame": scale.sizes.index((scale.width, scale.height))}


def rate_fields(result: dict[str, Any]) -> dict[str, object]:
    """Return the fields of table 5.6."""
    mhz, frame = result["clock_mhz"], result["frame"]
    header = ["configuration", "frames per second in the thesis", f"at {mhz} MHz", "clock on the ECP5, MHz",
              "frames per second at it", "clock that equals the thesis, MHz"]
    rows   = []
    for row in result["rows"]:
        clocks, fps, placed = row["clocks"][frame], row["published_fps"], row["mhz"]
        rows.append([row["preset"], f"{fps} {PUBLISHED}" if fps else "", f"{1e6*mhz/clocks:.2f}",
                     placed or "", f"{1e6*placed/clocks:.2f}" if placed else "",
                     f"{fps*clocks/1e6:.2f}" if fps else ""])
    by_size = [[f"{width} x {height}", *(f"{1e6*mhz/row['clocks'][place]:.1f}" for row in result["rows"])]
               for place, (width, height) in enumerate(result["sizes"])]
    width, height = result["sizes"][frame]
    return {"table": table(header, rows), "mhz": mhz, "width": width, "height": height,
            "by_size": table(["image", *(row["preset"] for row in result["rows"])], by_size)}


SECTIONS = [
    Section("Table 5.5", "clock cycles of an image pair", """\
Frames of {width} x {height} pixels. `matcher alone` is its Verilog in Verilator, from the first pixel pair in to
the last pixel of the map out. `full system` is litex_sim with integrated RAM, from memory to memory, with a
matcher that has all stages. Every map is compared with the reference model's. A preset that is too large for this
SoC has no figure. The number of disparities only changes the length of the pipeline.

{table}""", measure_clocks, clock_fields, Scale.wide, system=True, sources=(*BENCH, *MODEL)),
    Section("Table 5.6", "frame rates", """\
Frames of {width} x {height} pixels. The two rates of the thesis are published, from its author's simulation; we do
not know its clock. Our rates follow from the clocks of the matcher alone: at {mhz} MHz, a round number and not a
measurement, and at the clock that each preset reaches after place and route (Table 5.4). Memory must keep up with
them. At the clock in the last column our rate equals that of the thesis.

{table}
Figure 5.2: frames per second by image size, ours at {mhz} MHz.

![Frames per second over image sizes](images/thesis/frame_rate.png)

{by_size}""", measure_rates, rate_fields, rate_builds, sources=(*BENCH, PACKAGE / "area.py"), more=placed_by),
]
