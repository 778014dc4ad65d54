#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Count the lines of the gateware that the tests run.

`--count-gateware` starts, and saves its counts in the build folder. `--count-gateware-on` continues from the counts
of the first part of the tests, and fails if both parts together have run too few lines of a core: it is for the second
part. Without a first part of the same code it counts nothing.
"""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest
from migen.fhdl import tracer

from campaigns.coverage import gateware
from litestereo.sim.cores.verilated_core import coverage_directory
from litestereo.soc.build.paths import PACKAGE_DIR, build_directory, code_key

#: Percentage of the gateware's lines that the tests have run, and the cores below the floor, a line for each.
COUNTED = pytest.StashKey[tuple[float, list[str]]]()


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--count-gateware", action="store_true", help="begin to count the lines of the gateware")
    parser.addoption("--count-gateware-on", action="store_true",
                     help="go on counting after --count-gateware, and fail below the floor")


def _first_part() -> Path:
    """Return the file that holds the key of the counted code."""
    return build_directory() / "coverage.key"


def _gateware_key() -> str:
    return code_key(PACKAGE_DIR / "gateware")


def _begins(config: pytest.Config) -> bool:
    # With xdist the workers run the tests, and the main process reads their counts.
    return config.getoption("count_gateware") and not hasattr(config, "workerinput")


def _judges(config: pytest.Config) -> bool:
    known = _first_part().read_text() if _first_part().is_file() else ""
    return config.getoption("count_gateware_on") and not hasattr(config, "workerinput") and known == _gateware_key()


def pytest_configure(config: pytest.Config) -> None:
    if config.getoption("count_gateware") or config.getoption("count_gateware_on"):
        os.environ["LITESTEREO_COVERAGE"] = "line"
    if _begins(config):
        _first_part().unlink(missing_ok=True)
        shutil.rmtree(coverage_directory(), ignore_errors=True)
        coverage_directory().mkdir(parents=True)


def pytest_sessionfinish(session: pytest.Session) -> None:
    if _begins(session.config) and session.exitstatus == pytest.ExitCode.OK:
        _first_part().write_text(_gateware_key())
    if _judges(session.config):
        cores   = gateware.read(coverage_directory())
        percent = gateware.percent(cores)
        session.config.stash[COUNTED] = percent, gateware.low(cores)
        # The floor of each core is judged by make coverage, and named here.
        if percent < gateware.LINES_FLOOR and session.exitstatus == pytest.ExitCode.OK:
            session.exitstatus = pytest.ExitCode.TESTS_FAILED


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    if config.getoption("count_gateware_on") and COUNTED not in config.stash:
        terminalreporter.write_line("gateware: its lines were not counted, as make test has not run on this code")
    elif COUNTED in config.stash:
        percent, low = config.stash[COUNTED]
        for line in low:
            terminalreporter.write_line(f"gateware: {line}")
        terminalreporter.write_line(f"gateware: the tests have run {percent:.1f} % of its lines, and of each core "
                                    f"{'not always' if low else 'at least'} {gateware.LINES_FLOOR:g} %")


@pytest.fixture(autouse=True)
def _forget_names():
    """Forget the objects that migen keeps for every Signal ever made: it searches all of them for each new Signal."""
    tracer.classname_to_objs.clear()
