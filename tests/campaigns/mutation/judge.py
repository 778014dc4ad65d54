#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Judge a mutant by the narrow tests of its file, in a copy of the checkout; results are kept by content."""

from __future__ import annotations

import functools
import json
import os
import re
import shutil
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from litestereo.soc.build.paths import build_directory, code_key, content_key
from support.paths import CHECKOUT

from .areas import Area
from .mutant import Mutant

#: What tests need of the checkout.
COPIED  = ("firmware", "gateware", "host_tools", "sim", "soc", "tests", "Makefile", "README.md", "docs", "pyproject.toml")
IGNORED = shutil.ignore_patterns("__pycache__", ".pytest_cache", ".hypothesis")

#: Sanitizers without optimization: a third of the time. Warnings are errors of a style that no fault needs to keep.
SANITIZE = "-O0 -w -fsanitize=address,undefined -fno-sanitize-recover=all"

#: Name of a test program in C; all other tests are arguments of pytest.
PROGRAM = re.compile(r"test_\w+")


class CampaignError(RuntimeError):
    """The tests cannot judge; says why."""


@dataclass(frozen=True)
class Verdict:
    """What the tests of a mutant say."""
    result:  str    #: caught, survived, hung, or refused by the compiler
    seconds: float


def whole(file: str) -> Mutant:
    """Return a file without a fault, to judge its tests."""
    return Mutant(file, 0, "none", "", "", "", (CHECKOUT / file).read_text())


@functools.cache
def _code_key(path: Path) -> str:
    return code_key(path)


class Judge:
    """Run tests on mutants, one at a time, in a copy of the checkout.

    Parameters
    ----------
    number
        Of this judge: each has a separate copy and separate builds. Results are common to all.
    folder
        Where these are; by default `mutation` in the build folder.
    """

    def __init__(self, number: int = 0, folder: Path | None = None) -> None:
        folder        = folder or build_directory() / "mutation"
        self.results  = folder / "results"
        self.folder   = folder / str(number)
        self.copy     = self.folder / "copy" / "litestereo"
        self.programs = self.folder / "programs"
        self.builds   = self.folder / "builds"
        self.log      = self.folder / "tests.log"
        shutil.rmtree(self.copy, ignore_errors=True)
        self.copy.mkdir(parents=True)
        for name in COPIED:
            if (CHECKOUT / name).is_dir():
                shutil.copytree(CHECKOUT / name, self.copy / name, ignore=IGNORED)
            else:
                shutil.copy(CHECKOUT / name, self.copy / name)

    def judge(self, area: Area, mutant: Mutant) -> Verdict:
        """Return the verdict, of an earlier campaign if nothing has changed.

        Raises
        ------
        CampaignError
            The tests of the file fail without a fault: they would catch every mutant.
        """
        if mutant.kind == "none":
            return self._verdict(area, mutant, 10*area.limit_s)
        sound = self.judge(area, whole(mutant.file))
        if sound.result != "survived":
            raise CampaignError(f"the tests of {mutant.file} fail, or take too long, without a fault: see {self.log}")
        return self._verdict(area, mutant, max(area.limit_s, 5*sound.seconds))

    def _verdict(self, area: Area, mutant: Mutant, limit_s: float) -> Verdict:
        tests = area.tests[mutant.file.removeprefix(area.prefix)]
        known = self.results / f"{_key(area, mutant, tests)}.json"
        if known.is_file():
            return Verdict(**json.loads(known.read_text()))
        begun  = time.monotonic()
        path   = self.copy / mutant.file
        sound  = path.read_text()
        path.write_text(mutant.source)
        try:
            result = self._run(mutant, tests, begun + limit_s)
        except subprocess.TimeoutExpired:
            result = "hung"
        finally:
            path.write_text(sound)
            shutil.rmtree(self.builds, ignore_errors=True)
        verdict = Verdict(result, round(time.monotonic() - begun, 1))
        # What hung is not recorded: the computer may have been busy.
        if result != "hung":
            known.parent.mkdir(parents=True, exist_ok=True)
            known.write_text(json.dumps(vars(verdict)))
        return verdict

    def _run(self, mutant: Mutant, tests: tuple[str, ...], end: float) -> str:
        programs = [test for test in tests if PROGRAM.fullmatch(test)]
        with open(self.log, "w") as log:
            result = self._run_programs(programs, log, end)
            if result == "survived" and len(programs) < len(tests):
                result = self._run_pytest([test for test in tests if test not in programs], log, end)
            return result

    def _run_programs(self, programs: list[str], log, end: float) -> str:
        make = ["make", "-s", "-f", self.copy / "firmware" / "tests" / "Makefile", f"OUT={self.programs}"]
        for program in programs:
            if self._status([*make, program], log, end):
                return "refused"
            if self._status([self.programs / program], log, end):
                return "caught"
        return "survived"

    def _run_pytest(self, tests: list[str], log, end: float) -> str:
        command = [sys.executable, "-m", "pytest", "-q", "-x", "--no-header", "-p", "no:cacheprovider",
                   *(f"tests/{test}" if ".py" in test else test for test in tests)]
        status  = self._status(command, log, end)
        # 1: a test failed; 2: the core could not be made, or the module not be loaded; below 0: it was killed.
        if status > 2:
            raise CampaignError(f"pytest ended with status {status}: see {self.log}")
        return "caught" if status else "survived"

    def _status(self, command: list[str | Path], log, end: float) -> int:
        # Each simulator runs once and briefly, so most of the time is for compiling it.
        flags       = SANITIZE.replace(" ", "\\ ")
        environment = os.environ | {
            "PYTHONPATH": str(self.copy.parent), "PYTHONDONTWRITEBYTECODE": "1",
            "LITESTEREO_BUILD": str(self.builds), "LITESTEREO_OPTIMIZATION": "-O0",
            "MAKEFLAGS": f" -- OPT_GLOBAL=-O0 SANITIZE={flags}",
        }
        with subprocess.Popen(command, cwd=self.copy, env=environment, stdin=subprocess.DEVNULL, stdout=log, stderr=log,
                              start_new_session=True) as process:
            try:
                return process.wait(max(1.0, end - time.monotonic()))
            except BaseException:
                # With all that the tests have started.
                os.killpg(process.pid, 9)
                raise


def _key(area: Area, mutant: Mutant, tests: tuple[str, ...]) -> str:
    """Return the content key of a verdict: the mutant, its tests, and what these are made of."""
    files = [file for test in tests if (file := _test_file(test)) is not None]
    return content_key([mutant.file, mutant.source, *tests, *(_code_key(CHECKOUT / name) for name in area.needs),
                        *map(_code_key, files)])


def _test_file(test: str) -> Path | None:
    """Return the source of a test, or None for an argument of pytest."""
    if ".py" in test:
        return CHECKOUT / "tests" / test.partition("::")[0]
    if PROGRAM.fullmatch(test):
        (path,) = (CHECKOUT / "firmware" / "tests").rglob(f"{test}.c")
        return path
    return None
