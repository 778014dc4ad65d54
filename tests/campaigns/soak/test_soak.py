#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""A short soak, and soaks that must fail."""

from __future__ import annotations

import dataclasses
import shutil

import numpy as np
import pytest

from campaigns.soak import run
from campaigns.soak.device import machine
from campaigns.soak.frames import BatchDraws
from support.pairs import SEED

pytestmark = pytest.mark.skipif(not all(map(shutil.which, ("clang", "verilator"))),
                                reason="clang and verilator are needed")


def soaked(running, frames):
    return run.Host(running, np.random.default_rng(SEED), lambda tally: None).run(frames)


@pytest.mark.long
def test_soak():
    """With faults on all sides, many times as often as in `make soak`, no frame is lost and no map is wrong."""
    with machine(SEED, haste=40) as running:
        tally = soaked(running, 300)
    assert (tally.lost, tally.wrong) == (0, 0)
    assert tally.frames >= 300 and tally.recoveries > 0 and 0 < tally.streamed < tally.frames
    assert all(running.counts[name] > 0 for name in ("stalls", "freezes", "bus_errors", "resets", "hangs", "ratios"))
    assert running.counts["starts after watchdog"] == running.counts["hangs"]


@pytest.mark.long
def test_soak_of_a_matcher_with_its_own_clock():
    """The same holds if the matcher has a third clock, with any ratio to the system's from a quarter up."""
    with machine(SEED, haste=40, own_clock=True) as running:
        tally = soaked(running, 150)
    assert (tally.lost, tally.wrong) == (0, 0)
    assert tally.frames >= 150 and tally.recoveries > 0
    assert all(running.counts[name] > 0 for name in ("stalls", "freezes", "bus_errors", "resets", "hangs", "ratios"))


@pytest.mark.long
def test_a_wrong_map_is_found(monkeypatch):
    """A difference in one pixel of one expected map is found."""
    drawn = BatchDraws.batch

    def altered(draws, count):
        batch = drawn(draws, count)
        batch.maps[-1][-1, -1] += 1
        return batch
    monkeypatch.setattr(BatchDraws, "batch", altered)
    with machine(SEED) as running:
        assert soaked(running, 100).wrong == 1


@pytest.mark.long
def test_a_lost_frame_is_found(monkeypatch):
    """A network that passes nothing after the first frames loses a frame."""
    monkeypatch.setattr(run, "MOST_TRIES", 2)
    monkeypatch.setattr(run, "LINK", dataclasses.replace(run.LINK, silence_limit_s=0.5, hello_limit_s=0.5))

    def tick(tally):
        if tally.frames == 5:
            running.ways[0].loss = 1.0
    with machine(SEED) as running:
        tally = run.Host(running, np.random.default_rng(SEED), tick).run(100)
    assert tally.lost == 1 and tally.frames < 100


@pytest.mark.long
def test_a_machine_that_ends_by_itself_is_an_error():
    """The end of the machine is an error, not something to recover from."""
    with pytest.raises(RuntimeError, match="ended with status"), machine(SEED, haste=0) as running:
        # The first drawn fault divides by it.
        running.process.wait(600)
