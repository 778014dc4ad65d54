#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Writes docs/accuracy.md: how good the maps of each board's preset are, by the reference model on five pairs."""

from __future__ import annotations

import dataclasses
import json
import os
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import rich.console
import rich.progress

from ..host_tools.core.errors import DatasetError, LiteStereoError
from ..host_tools.core.features import feature_names
from ..host_tools.core.images import disparity_pixels
from ..host_tools.core.settings import MIN_BLOCK_SIZE, MatcherSettings
from ..host_tools.data.datasets import StereoPair, downscale, load_motorcycle
from ..host_tools.data.layouts import find_samples
from ..host_tools.devices.base import DeviceInfo, choose_settings
from ..host_tools.evaluation.metrics import measure_map
from ..soc.boards import BOARDS, soc_class
from ..soc.boards.preset import Preset
from ..soc.build.pages import Page
from ..soc.build.paths import PACKAGE_DIR, build_directory, built_once, code_key, content_key
from ..soc.reports.markdown import table
from .models.stereo_bm import stereo_bm

#: Pairs of the folder that LITESTEREO_DATA names, and the one that is downloaded.
PAIRS, MOTORCYCLE = ("tsukuba", "venus", "teddy", "cones"), "motorcycle"

#: What the errors depend on, apart from settings and pairs.
CODE = tuple(PACKAGE_DIR / name for name in ("sim/models", "host_tools/evaluation/metrics.py"))

#: Limit of the left-right check where it is on, in pixels.
CHECK_PX = 1

HEADER = """\
# Accuracy of the boards

What a board delivers depends on its preset: the stages that are built, its disparities, its largest block and its
widest image ([boards.md](boards.md) has resources and clocks). `make accuracy` writes this page. The reference model in
NumPy matches five Middlebury pairs with the stages of each preset. Gateware and model return the same map, so these are
the figures of the boards.

- Settings are the defaults of `cv2.StereoBM`, with the disparities and the largest block of the preset; stages that the
  preset lacks are off. The rows `left-right check` switch the check on, with {check} pixel; OpenCV's default is off.
- `bad-2.0` is the share of the known pixels that have a disparity more than 2 pixels off, in percent. Density is the
  share of the known pixels that have a disparity. Read them together: a test that removes wrong pixels lowers both.
- A pair that is wider than the widest image is shrunk by a whole number, with its disparities.
- A pixel that is nearer than the preset's disparities reach cannot be found.
"""

CREDIT = ("Tsukuba: Y. Ohta, University of Tsukuba. Venus: D. Scharstein, R. Szeliski, IJCV 47, 2002. Teddy and Cones: "
          "D. Scharstein, R. Szeliski, CVPR 2003. Motorcycle: D. Scharstein et al., GCPR 2014.")


@dataclass(frozen=True)
class Case:
    """A preset as it is measured: the settings of its rows, and the widest image."""

    board:     str
    rows:      Mapping[str, MatcherSettings]  #: by the name of the row
    max_width: int


def info_of(board: str, preset: Preset) -> DeviceInfo:
    """Return what a device with the preset says of itself, as far as settings depend on it."""
    parameters = preset.parameters
    width, height = parameters.max_width, parameters.max_height
    return DeviceInfo("", board, width, height, width*height, parameters.disparities, MIN_BLOCK_SIZE,
                      parameters.max_block_size, features=parameters.feature_bits)


def case_of(board: str, preset: Preset) -> Case:
    """Return the settings with which a board's preset is measured."""
    sizes    = {"disparities": preset.disparities, "block_size": preset.max_block_size}
    settings = choose_settings([info_of(board, preset)], sizes).settings
    rows     = {"defaults": settings}
    if "left_right" in preset.features:
        rows["left-right check"] = dataclasses.replace(settings, disp12_max_diff=CHECK_PX)
    return Case(board, rows, preset.max_width)


def cases() -> list[Case]:
    """Return the cases of all boards."""
    return [case_of(board, soc_class(board).preset) for board in BOARDS]


# Pairs --------------------------------------------------------------------------------------------

def load_pairs() -> dict[str, StereoPair]:
    """Return the pairs by their names; raise DatasetError if one is missing."""
    folder = os.environ.get("LITESTEREO_DATA")
    if not folder:
        raise DatasetError("LITESTEREO_DATA is not set: set it to the folder of the Middlebury pairs "
                           f"{', '.join(PAIRS)}")
    found = {}
    for name in PAIRS:
        (files,)    = find_samples([Path(folder) / name])
        sample      = files.load()
        found[name] = StereoPair(sample.left, sample.right, sample.truth)
    found[MOTORCYCLE] = load_motorcycle(build_directory() / "datasets" / MOTORCYCLE)
    return found


def fitting(pair: StereoPair, max_width: int) -> tuple[StereoPair, int]:
    """Return a pair, shrunk so that it is not wider than `max_width`, and the factor."""
    factor = -(-pair.left.shape[1]//max_width)
    return (pair if factor == 1 else downscale(pair, factor)), factor


# Measurement --------------------------------------------------------------------------------------

@dataclass(frozen=True)
class Quality:
    """Quality of a map: `bad_2_0` and `density` of `measure_map`, in percent of the known pixels."""

    bad:     float
    density: float


def measure(pair: StereoPair, settings: MatcherSettings) -> Quality:
    """Return the quality of the model's map of a pair; it is computed once for each content."""
    key = content_key([repr(settings), pair.left.tobytes(), pair.right.tobytes(), pair.truth.tobytes(),
                       code_key(*CODE)])

    def compute(folder: Path) -> None:
        disparity = disparity_pixels(stereo_bm(pair.left, pair.right, settings), settings.invalid)
        (folder / "result.json").write_text(json.dumps(measure_map(disparity, pair.truth)))

    found = json.loads((built_once(build_directory() / "accuracy" / key, compute) / "result.json").read_text())
    return Quality(found["bad_2_0"], found["density"])


# Page ---------------------------------------------------------------------------------------------

def stages(settings: MatcherSettings) -> str:
    """Return what the settings of a row are."""
    return f"{settings.disparities} disparities, block {settings.block_size}x{settings.block_size}"


def preset_rows() -> list[list[object]]:
    """Return the stages of each board's preset."""
    rows: list[list[object]] = []
    for board in BOARDS:
        info = info_of(board, soc_class(board).preset)
        rows.append([board, info.max_disparities, info.max_block_size, info.max_width,
                     ", ".join(feature_names(info.features)), ", ".join(feature_names(info.missing_features))])
    return rows


def result_rows(measured: Iterable[tuple[Case, str, Mapping[str, Quality]]], value: str) -> list[list[object]]:
    """Return the rows of a table: board, settings, the value of each pair and their mean."""
    rows: list[list[object]] = []
    for case, name, qualities in measured:
        values = [getattr(quality, value) for quality in qualities.values()]
        rows.append([case.board, name, stages(case.rows[name]), *(f"{one:.1f}" for one in values),
                     f"{sum(values)/len(values):.1f}"])
    return rows


def document(measured: list[tuple[Case, str, Mapping[str, Quality]]], pairs: Mapping[str, StereoPair]) -> str:
    """Return the page."""
    header = ["board", "settings", "search", *(name.capitalize() for name in pairs), "mean"]
    sizes  = table(["pair", "pixels", "nearest point, pixels of disparity"],
                   [[name.capitalize(), f"{pair.left.shape[1]} x {pair.left.shape[0]}",
                     f"{float(pair.truth[pair.truth == pair.truth].max()):.0f}"] for name, pair in pairs.items()])
    return "\n".join([
        HEADER.format(check=CHECK_PX),
        "## Presets\n", table(["board", "disparities", "largest block", "widest image", "stages", "lacks"],
                              preset_rows()),
        "## Pairs\n", sizes, f"{CREDIT}\n",
        "## bad-2.0, % of the known pixels\n", table(header, result_rows(measured, "bad")),
        "## Density, % of the known pixels\n", table(header, result_rows(measured, "density"))])


def key() -> str:
    """Return the content key of the page: the presets, the model and the metrics."""
    presets = [repr((case.board, dict(case.rows), case.max_width)) for case in cases()]
    return content_key([*presets, repr(preset_rows()), code_key(*CODE, Path(__file__))])


PAGE = Page("docs/accuracy.md", "accuracy", key, minutes=10)


def main() -> int:
    """Write the page; return the exit status."""
    try:
        pairs    = load_pairs()
        measured = list[tuple[Case, str, Mapping[str, Quality]]]()
        work     = [(case, name) for case in cases() for name in case.rows]
        with rich.progress.Progress(console=rich.console.Console(stderr=True)) as bars:
            for case, name in bars.track(work, description="match"):
                measured.append((case, name, {pair: measure(fitting(images, case.max_width)[0], case.rows[name])
                                              for pair, images in pairs.items()}))
        PAGE.write(document(measured, pairs))
    except (LiteStereoError, OSError) as error:
        print(f"accuracy: error: {' '.join(str(error).split())}", file=sys.stderr)
        return 1
    print(f"written: {PAGE.path}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
