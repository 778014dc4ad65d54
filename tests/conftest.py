#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""With `--floors`, which is for a run of all tests: the lines of the gateware that they run are counted, and too few of
them fail the run."""

from __future__ import annotations

import os
import shutil

import pytest

from covered import gateware
from litestereo.sim.verilated_core import coverage_directory


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--floors", action="store_true",
                     help="count the lines of the gateware that are run, and fail if they are too few: for all tests")


def _counts(config: pytest.Config) -> bool:
    # With xdist the workers run the tests, and the other process looks at what they have left.
    return config.getoption("floors") and not hasattr(config, "workerinput")


def pytest_configure(config: pytest.Config) -> None:
    if config.getoption("floors"):
        os.environ["LITESTEREO_COVERAGE"] = "line"
    if _counts(config):
        shutil.rmtree(coverage_directory(), ignore_errors=True)
        coverage_directory().mkdir(parents=True)


@pytest.hookimpl(tryfirst=True)
def pytest_sessionfinish(session: pytest.Session) -> None:
    if _counts(session.config) and gateware.percent(gateware.read(coverage_directory())) < gateware.LINES_FLOOR:
        session.exitstatus = session.exitstatus or pytest.ExitCode.TESTS_FAILED


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    if _counts(config):
        percent = gateware.percent(gateware.read(coverage_directory()))
        terminalreporter.write_line(f"gateware: the tests have run {percent:.1f} % of its lines"
                                    f" (floor: {gateware.LINES_FLOOR:g} %)")
