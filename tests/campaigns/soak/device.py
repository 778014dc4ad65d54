#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The simulated SoC as a process, behind a bad network."""

from __future__ import annotations

import contextlib
import json
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass, field

from support.pairs import byte_generator
from support.udp_faults import Faults
from support.udp_proxy import udp_proxied

from .build import build

#: Chances per datagram, in each direction.
NETWORK = {"loss": 0.02, "duplication": 0.02, "reordering": 0.05, "flips": 0.005}

ANNOUNCEMENT = "[ethernet2socket] listening on 127.0.0.1:"


@dataclass
class Machine:
    """A running system: its address, and, after its end, the counts of its faults."""
    url:     str
    ways:    tuple[Faults, Faults]
    process: subprocess.Popen
    streams: bool  #: whether it supports streamed frames
    counts:  dict[str, int] = field(default_factory=dict)


@contextlib.contextmanager
def machine(seed: int, haste: int = 1, own_clock: bool = False) -> Iterator[Machine]:
    """Run the system until the end of the block.

    Parameters
    ----------
    seed
        Draws all faults.
    haste
        How many times as often resets, hangs, bus errors and changes of stalls and clocks happen: for short soaks.
    own_clock
        The matcher has a separate clock.

    Raises
    ------
    RuntimeError
        The system ended by itself: the DMA left the memory, a register did not answer, or the firmware did something
        undefined.
    """
    ways = tuple(Faults(**NETWORK, rng=byte_generator(90, seed, way)) for way in (0, 1))
    pipe = subprocess.PIPE
    soak = build(own_clock)
    log  = soak.parents[1] / f"soak-{seed}.log"
    with open(log, "w") as errors, \
            subprocess.Popen([soak, str(seed), str(haste)], stdout=pipe, stderr=errors, text=True) as process:
        try:
            line = process.stdout.readline()
            if not line.startswith(ANNOUNCEMENT):
                raise RuntimeError(f"the simulated SoC does not start: see {log}")
            with udp_proxied(int(line.removeprefix(ANNOUNCEMENT)), *ways) as network:
                running = Machine(network.url, ways, process, streams=not own_clock)
                yield running
        finally:
            process.terminate()
            out, _ = process.communicate(timeout=600)
    if process.returncode:
        raise RuntimeError(f"the simulated SoC ended with status {process.returncode}: see {log}")
    running.counts = json.loads(out)
