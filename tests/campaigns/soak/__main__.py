#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""`make soak`: small frames through gateware, firmware and host tools, with faults on all sides; none may be lost."""

from __future__ import annotations

import argparse
import sys

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeElapsedColumn, TimeRemainingColumn

from .build import build
from .device import machine
from .run import Host, Tally


def report(tally: Tally, counts: dict[str, int], ways) -> str:
    """Return a report of the faults and the results."""
    network = {name: sum(getattr(way, name) for way in ways) for name in ("lost", "duplicated", "reordered", "flipped")}
    faults  = {**{f"datagrams {name}": count for name, count in network.items()},
               "accesses to memory that waited": counts["stalls"], "times that memory froze": counts["freezes"],
               "bus errors": counts["bus_errors"], "resets": counts["resets"], "hangs of the firmware": counts["hangs"],
               "changes of the clocks' ratio": counts["ratios"], "batches given up": tally.aborted,
               "hosts that vanished": tally.vanished}
    rows    = [f"{count:12,} {name}" for name, count in faults.items()]
    starts  = [f"{count:12,} {name}" for name, count in counts.items() if name.startswith("starts") and count]
    causes  = [f"{count:12,} {name}" for name, count in sorted(tally.causes.items())]
    return "\n".join([f"{counts['clocks']:,} clocks of the system, {counts['wire_clocks']:,} of the wire", "faults:",
                      *rows, "starts of the firmware:", *starts, "what the host had to recover from:", *causes,
                      f"{tally.frames} frames, {tally.streamed} of them streamed; {sum(faults.values())} faults; "
                      f"{tally.recoveries} recoveries; {tally.lost} lost, {tally.wrong} wrong"])


def main() -> int:
    """Run the soak and report; the exit status is 1 if a frame was lost or is wrong."""
    parser = argparse.ArgumentParser(prog="soak")
    parser.add_argument("--frames", type=int, default=100_000, help="frames to match (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="what draws everything (default: %(default)s)")
    parser.add_argument("--haste", type=int, default=1, help="faults come so many times as often (default: 1)")
    parser.add_argument("--own-clock", action="store_true", help="the matcher has a separate clock")
    options = parser.parse_args()
    console = Console(stderr=True)
    with console.status("building the simulated SoC with its firmware for this computer (a minute)"):
        build(options.own_clock)
    columns = (BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TimeRemainingColumn())
    try:
        with machine(options.seed, options.haste, options.own_clock) as running, \
                Progress(*columns, console=console) as progress:
            task  = progress.add_task("soak", total=options.frames)
            tally = Host(running, np.random.default_rng(options.seed),
                         lambda tally: progress.update(task, completed=tally.frames)).run(options.frames)
    except RuntimeError as error:
        print(f"soak: {error}", file=sys.stderr)
        return 1
    print(report(tally, running.counts, running.ways))
    return 1 if tally.lost or tally.wrong else 0


if __name__ == "__main__":
    sys.exit(main())
