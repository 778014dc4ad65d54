#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""`litestereo eval`: compares matchers on pairs whose true disparities are known."""

from __future__ import annotations

import argparse
import dataclasses
import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path

import rich.console

from ..core.errors import ImageError, UsageError
from ..core.outputs import METRICS_CSV, Outputs
from ..core.settings import DISPARITY_STEP, MatcherSettings
from ..data.datasets import load_motorcycle
from ..data.layouts import find_samples
from ..data.samples import SampleFiles
from ..devices.base import Choice
from ..devices.connect import connect
from ..evaluation.matchers import OPENCV, check_opencv, opencv_name
from ..evaluation.metrics import METRICS
from ..evaluation.report import as_json, means, table, write_csv
from ..evaluation.work import Job, LoadedSample, evaluate, tasks_of
from ..link.urls import DEVICE_VARIABLE
from .arguments import Parser, add_force, add_json, count, device_url, positive
from .filters import add_filters, chosen_filters, single_frame_notices
from .matching import add_settings, chosen_speckle_filter, device_settings, print_notices, stages_off
from .progress import terminal_bars

_MOTORCYCLE = "motorcycle"

#: Width of the table in characters if stdout is not a terminal.
_TABLE_WIDTH = 140

_EPILOG = f"""\
examples:
  litestereo eval data/teddy data/cones --device model: --opencv bm --opencv sgbm --disparities 64
  litestereo eval MiddEval3/trainingQ --device 'cosim:?disparities=128' --opencv bm --jobs 4 --csv results.csv
  litestereo eval --motorcycle --device udp://192.168.1.50 --device model: --json
  litestereo eval kitti/training --opencv sgbm --disparities 128 --cluster tcp://scheduler:8786
  litestereo eval data/teddy --device model: --filter decimation:filter_magnitude=3 --filter spatial

data sets (each PATH is a pair, or a folder of pairs):
  LiteStereo       left.png, right.png, disp_left_u16.png (256 times the disparity)
  Middlebury 2014  im0.png, im1.png, disp0GT.pfm or disp0.pfm, mask0nocc.png, calib.txt (ndisp)
  Middlebury 2005  and 2006: view1 and view5; disp1, disp5
  Middlebury v2    2001 and 2003: im2 and im6, or imL and imR; disp2, truedisp or groundtruth; disp6; Tsukuba as
                   scene1.row3.col3, scene1.row3.col4 and truedisp.row3.col3
  KITTI            image_2 and image_3, or image_0 and image_1; disp_occ_0, disp_noc_0

scales of 8-bit truths of Middlebury, by their size: 3 (370 rows), 2 (555) and 1 (1110) of 2005 and 2006; 4, 2 and 1 of
2003 (450, 900 and 1800 columns); 16 of Tsukuba, 8 of 2001. For another size the scale is what the images agree with,
which is said on stderr; if that is not certain --ground-truth-scale is needed. A scale that the images contradict is
refused.

regions:
  all     pixels whose true disparity is known
  nonocc  those that both cameras see: by the mask (nonocc.png, mask0nocc.png, or KITTI's noc), or, without one, where
          the truth of the right image agrees within a pixel; without both the region is missing
  disc    those of nonocc near a depth discontinuity: by the mask (disc.png), or, without one, within 4 rows and columns
          of two neighbours whose true disparities differ by more than 2 pixels

metrics:
{chr(10).join(f"  {name:18}  {text}" for name, text in METRICS.items())}

As in Middlebury's version 3 bad is a share of the known pixels, and a pixel without a disparity is not bad: read bad
beside density, or take bad_or_invalid. A true disparity of 0, nan or inf is unknown. Maps are clipped to 0 up to ndisp
if the data set has it. The table shows some of the metrics, --csv and --json have all of them; "or none" is
bad_or_invalid_2_0. Its means are over the pairs.

--filter filters the maps of all matchers. A decimated map is enlarged again: each of its pixels is compared with the
true disparities of all pixels that it is made of.

bm and our devices agree pixel for pixel in the valid region, where whole blocks lie in both images. Outside of it the
map of bm is set to invalid: OpenCV 5.0 with a smallest disparity above 0 writes that many values past the end of a row.
"""


def add_parser(commands: argparse._SubParsersAction[Parser]) -> None:
    """Add the command."""
    parser = commands.add_parser("eval", help="compare matchers on pairs with known disparities", epilog=_EPILOG,
                                 description="Match pairs whose true disparities are known, with several matchers and "
                                             "equal settings, and measure the errors of the maps.")
    parser.add_argument("paths", metavar="PATH", type=Path, nargs="*", help="folder of a pair, or of pairs")
    parser.add_argument("--motorcycle", action="store_true",
                        help="use the Motorcycle pair too, which is downloaded if needed (default: no)")
    parser.add_argument("--device", metavar="URL", type=device_url, action="append", dest="devices",
                        help="a device, may be repeated (default: the environment variable "
                             f"{DEVICE_VARIABLE}, unless --opencv is given)")
    parser.add_argument("--opencv", choices=OPENCV, action="append", default=[],
                        help="cv2.StereoBM or cv2.StereoSGBM, may be repeated (default: none)")
    parser.add_argument("--ground-truth-scale", metavar="S", type=positive,
                        help="divisor from the truths' values to pixels (default: 256 for 16-bit images, 16 for "
                             "int16; by the size for 8-bit images of Middlebury, see below; else 1)")
    parser.add_argument("--csv", metavar="FILE", type=Path, help="write all metrics to this file too (default: none)")
    parser.add_argument("--jobs", metavar="N", type=count, default=1, help="processes (default: %(default)s)")
    parser.add_argument("--cluster", metavar="ADDRESS",
                        help="scheduler of a Dask cluster to work on, such as tcp://host:8786; its workers must see "
                             "the same files (default: none)")
    add_json(parser)
    add_force(parser)
    add_settings(parser)
    add_filters(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Run the command. All that can be checked before the first match is checked before it."""
    devices = options.devices or []
    if not devices and not options.opencv:
        if DEVICE_VARIABLE not in os.environ:
            raise UsageError(f"nothing to rate: give --device or --opencv, or set {DEVICE_VARIABLE}")
        devices = [device_url(os.environ[DEVICE_VARIABLE])]
    if not options.paths and not options.motorcycle:
        raise UsageError("no pairs to rate: give the folder of a data set, or --motorcycle")
    if options.csv is not None and options.csv.is_dir():
        raise ImageError(f"{options.csv}: is a folder, --csv needs a file")
    filters = chosen_filters(options, "eval does not know them, leave it out")
    samples: list[SampleFiles | LoadedSample] = [*find_samples(options.paths, options.ground_truth_scale)]
    samples += [LoadedSample(_MOTORCYCLE, load_motorcycle())] if options.motorcycle else []

    if options.csv is not None:
        Outputs([path for sample in samples for path in sample.files], options.force).add(options.csv, METRICS_CSV)

    matchers = list(dict.fromkeys([*devices, *map(opencv_name, options.opencv)]))
    choices  = _choices(options, samples, devices)
    jobs: list[Job] = [(sample, choice.settings) for sample, choice in zip(samples, choices, strict=True)]
    print_notices([*(notice for choice in choices for notice in choice.notices), *single_frame_notices(filters)])
    tasks    = tasks_of(matchers, jobs, chosen_speckle_filter(options), filters)
    with terminal_bars() as bars:
        bar  = bars.add_task("match", total=sum(len(task.jobs) for task in tasks))
        rows = evaluate(tasks, lambda pairs: bars.advance(bar, pairs), options.jobs, options.cluster)

    for note in dict.fromkeys(note for row in rows for note in row.notes):
        print(f"litestereo: note: {note}", file=sys.stderr)
    if options.csv is not None:
        write_csv(options.csv, rows)
    if options.json:
        settings = [{"pair": sample.name, **dataclasses.asdict(choice.settings), **stages_off(choice)}
                    for sample, choice in zip(samples, choices, strict=True)]
        print(json.dumps({"settings": settings, "filters": filters.summary(), "results": as_json(rows),
                          "means": as_json(means(rows))}, indent=2))
    else:
        width = None if sys.stdout.isatty() else _TABLE_WIDTH
        rich.console.Console(width=width).print(table(rows))
    return 0


def _choices(options: argparse.Namespace, samples: Sequence[SampleFiles | LoadedSample], devices: Sequence[str]
             ) -> list[Choice]:
    """Return the settings of each pair. These are equal for all matchers: defaults are what every device has."""
    infos = []
    for url in devices:
        with connect(url) as device:
            infos.append(device.info())
    choices: list[Choice] = []
    for sample in samples:
        default = MatcherSettings()
        if sample.ndisp is not None:
            default = dataclasses.replace(default, disparities=-(-sample.ndisp//DISPARITY_STEP)*DISPARITY_STEP)
        choices.append(device_settings(options, infos, default))
        for kind in options.opencv:
            check_opencv(kind, choices[-1].settings)
    return choices
