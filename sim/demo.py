#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The demonstration: a real pair through the full system in litex_sim, each pixel compared with OpenCV's."""

from __future__ import annotations

import sys
import time

import cv2
import numpy as np
import rich.console
import rich.progress

from ..host_tools.core.errors import LiteStereoError
from ..host_tools.core.images import disparity_pixels, write_disparity
from ..host_tools.core.settings import MatcherSettings
from ..host_tools.data.datasets import StereoPair, downscale, load_motorcycle
from ..host_tools.devices.connect import Result, connect
from ..host_tools.evaluation.metrics import measure_map, summary_texts
from ..soc.build.paths import build_directory
from .models.stereo_bm import stereo_bm
from .system.build import SimulationError
from .system.simulation import start_simulation

#: The pair is shrunk, because the simulated UART, which is tried too, carries only some kilobytes per second. At this
#: size 32 disparities reach its nearest point.
FACTOR     = 3
SETTINGS   = MatcherSettings(disparities=32, block_size=9)
CLOCKS_MHZ = (50, 75, 100)


def match_over(link: str, url: str, pair: StereoPair) -> Result:
    """Match the pair on the device at `url`, with progress bars."""
    with connect(url) as device, rich.progress.Progress(console=rich.console.Console(stderr=True)) as bars:
        tasks: dict[str, rich.progress.TaskID] = {}

        def progress(phase: str, done: int, total: int) -> None:
            if phase not in tasks:
                tasks[phase] = bars.add_task(f"{link}: {phase}", total=total)
            bars.update(tasks[phase], completed=done)

        return device.compute(pair.left, pair.right, SETTINGS, progress)


def main() -> int:
    """Run the demonstration; return the exit status."""
    started = time.monotonic()
    folder  = build_directory() / "demo"
    folder.mkdir(parents=True, exist_ok=True)
    try:
        pair = downscale(load_motorcycle(build_directory() / "datasets" / "motorcycle"), FACTOR)
        print(f"pair: Middlebury 2014 Motorcycle, shrunk to {pair.left.shape[1]}x{pair.left.shape[0]}", flush=True)
        print("starting the SoC in litex_sim: VexRiscv with its firmware, matcher, 8 MiB of RAM", flush=True)
        with start_simulation() as simulation:
            result   = match_over("Ethernet", f"udp://127.0.0.1:{simulation.udp_port}", pair)
            # Again over the serial line, to compare the times.
            serial   = match_over("serial line", f"tcp://127.0.0.1:{simulation.port}", pair)
    except (LiteStereoError, SimulationError) as error:
        print(f"demo: error: {error}", file=sys.stderr)
        return 1

    yardstick = cv2.StereoBM_create(SETTINGS.disparities, SETTINGS.block_size)
    expected  = {"cv2.StereoBM":        np.asarray(yardstick.compute(pair.left, pair.right)),
                 "the reference model": stereo_bm(pair.left, pair.right, SETTINGS),
                 "the serial line":     serial.disparity}
    different = {name: int(np.count_nonzero(result.disparity != map_)) for name, map_ in expected.items()}
    cv2.imwrite(str(folder / "left.png"), pair.left)
    cv2.imwrite(str(folder / "right.png"), pair.right)
    write_disparity(folder, result.disparity, SETTINGS)
    quality = measure_map(disparity_pixels(result.disparity, SETTINGS.invalid), pair.truth)
    pixels  = result.disparity.size
    clocks  = result.clocks or 0
    print(f"settings: {SETTINGS.disparities} disparities, block size {SETTINGS.block_size}, else OpenCV's defaults")
    for name, count in different.items():
        print(f"against {name}: {count} of {pixels} pixels differ")
    print(f"accelerator: {clocks} clocks a frame, {clocks/pixels:.4f} a pixel")
    for mhz in CLOCKS_MHZ:
        print(f"  at {mhz:3} MHz: {mhz*1e6/clocks:7.1f} frames per second of this size")
    print(f"against the ground truth: {', '.join(f'{label} {text}' for label, text in summary_texts(quality).items())}")
    for link, times in (("Ethernet", result), ("serial line", serial)):
        print(f"time over {link}: upload {times.upload_s:.1f} s, match {times.match_s:.1f} s, "
              f"download {times.download_s:.1f} s, in all {times.upload_s + times.match_s + times.download_s:.1f} s")
    print(f"time of the demonstration: {time.monotonic() - started:.1f} s")
    print(f"pictures: {folder}/disparity_color.png, left.png, right.png")
    if any(different.values()):
        print("demo: FAILED: the system and its yardsticks disagree", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
