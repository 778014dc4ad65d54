#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""With `--count-gateware`, which is for a run of all tests, the lines of the gateware that they run are counted, and
too few are a failure."""

from __future__ import annotations

import os
import shutil

import pytest
from migen.fhdl import tracer

from campaigns.coverage import gateware
from litestereo.sim.cores.verilated_core import coverage_directory

#: Of the gateware's lines, what the tests have run.
PERCENT = pytest.StashKey[float]()


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--count-gateware", action="store_true",
                     help="count the lines of the gateware that are run, for all tests")


def _counts(config: pytest.Config) -> bool:
    # With xdist the workers run the tests, and the other process looks at what they have left.
    return config.getoption("count_gateware") and not hasattr(config, "workerinput")


def pytest_configure(config: pytest.Config) -> None:
    if config.getoption("count_gateware"):
        os.environ["LITESTEREO_COVERAGE"] = "line"
    if _counts(config):
        shutil.rmtree(coverage_directory(), ignore_errors=True)
        coverage_directory().mkdir(parents=True)


def pytest_sessionfinish(session: pytest.Session) -> None:
    if _counts(session.config):
        percent = gateware.percent(gateware.read(coverage_directory()))
        session.config.stash[PERCENT] = percent
        if percent < gateware.LINES_FLOOR and session.exitstatus == pytest.ExitCode.OK:
            session.exitstatus = pytest.ExitCode.TESTS_FAILED


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    if _counts(config):
        terminalreporter.write_line(f"gateware: the tests have run {config.stash[PERCENT]:.1f} % of its lines"
                                    f" (floor: {gateware.LINES_FLOOR:g} %)")


@pytest.fixture(autouse=True)
def _forget_names():
    """migen keeps whatever has ever made a Signal, and for each new one looks through all of that."""
    tracer.classname_to_objs.clear()
