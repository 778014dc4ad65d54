#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Judge a mutant by the narrow tests of its file, in a copy of the checkout.

Results are kept by content, and so are the models that the unchanged files give: of a mutant only those that differ are
built.
"""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from litestereo.soc.build.paths import build_directory, code_key, content_key
from support.paths import CHECKOUT

from .areas import PROGRAMS, Area
from .mutant import Mutant

#: What tests need of the checkout.
COPIED  = ("docs", "firmware", "gateware", "host_tools", "sim", "soc", "tests", "README.md", "pyproject.toml")
IGNORED = shutil.ignore_patterns("__pycache__", ".pytest_cache", ".hypothesis")

#: Sanitizers as in all tests of firmware, but no warnings: a fault may leave a variable unused.
SANITIZE = "-O1 -w -fsanitize=address,undefined -fno-sanitize-recover=all"

#: Seconds that the tests of a mutant may last per second of processor time that each of their processes may take.
PATIENCE = 20

#: Processor time of a mutant's tests, in seconds and in times of how long they take without a fault.
MARGIN_S, SLOWER = 30, 3

#: Folders of builds with a folder for each content, named after it.
MODELS = ("cosim", "formal")

#: What is put in the place of a fault that changes no model, to find out whether the tests come there.
UNREACHED = "(None.unreached)"

#: Compiler of what two sources give: without sanitizers, whose code has the places of the source.
COMPILE = ["gcc", "-std=c11", "-O2", "-w"]

#: Name of a test program in C; all other tests are arguments of pytest.
PROGRAM = re.compile(r"test_\w+")


class CampaignError(RuntimeError):
    """The tests cannot judge; says why."""


class _Hung(Exception):
    """The tests do not end."""


@dataclass(frozen=True)
class Verdict:
    """What the tests of a mutant say."""
    result:  str    #: caught, survived, unchanged, hung, or refused by the compiler
    seconds: float


class Judge:
    """Run tests on mutants, one at a time, in a copy of the checkout.

    Parameters
    ----------
    number
        Of this judge: each has a separate copy and separate builds. Results, and models of unchanged files, are common
        to all.
    folder
        Where these are; by default `mutation` in the build folder.
    """

    def __init__(self, number: int = 0, folder: Path | None = None) -> None:
        folder        = folder or build_directory() / "mutation"
        self.results  = folder / "results"
        self.sound    = folder / "sound"
        self.folder   = folder / str(number)
        self.copy     = self.folder / "copy" / "litestereo"
        self.programs = self.folder / "programs"
        self.builds   = self.folder / "builds"
        self.log      = self.folder / "tests.log"
        self._keys: dict[str, str] = {}
        self._judged_s = 0.0
        folder.mkdir(parents=True, exist_ok=True)
        self._lock    = open(folder / f"{number}.lock", "w")  # noqa: SIM115 (held as long as this object lives)
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise CampaignError(f"another campaign is running in {folder}: wait for its end") from None
        # With the programs of an earlier campaign: they may be of its last mutant.
        shutil.rmtree(self.folder, ignore_errors=True)
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
            Tests that are run fail without a fault too: they would catch every mutant.
        """
        tests = area.tests[mutant.file.removeprefix(area.prefix)]
        return self._known(self._key(area, [mutant.file, mutant.source], tests),
                           partial(self._faulty, area, mutant, tests))

    def _key(self, area: Area, mutant: list[str], tests: tuple[str, ...]) -> str:
        """Return the content key of a verdict: the mutant, its tests, and what these are made of."""
        files = [file for test in tests if (file := self._test_file(test)) is not None]
        return content_key([*mutant, *tests, *(self._code_key(name) for name in area.needs),
                            *map(self._code_key, files)])

    def _code_key(self, name: str) -> str:
        # Of the copy: the checkout may change meanwhile.
        if name not in self._keys:
            self._keys[name] = code_key(self.copy / name)
        return self._keys[name]

    def _test_file(self, test: str) -> str | None:
        """Return the source of a test, or None for an argument of pytest."""
        if ".py" in test:
            return f"tests/{test.partition('::')[0]}"
        if PROGRAM.fullmatch(test):
            (path,) = (self.copy / "firmware" / "tests").rglob(f"{test}.c")
            return path.relative_to(self.copy).as_posix()
        return None

    def _known(self, key: str, judge: Callable[[], str], worth: tuple[str, ...] | None = None) -> Verdict:
        """Return the verdict that is stored under this key, or judge, and store it if it is of these results."""
        known = self.results / f"{key}.json"
        if known.is_file():
            return Verdict(**json.loads(known.read_text()))
        begun, others_s = time.monotonic(), self._judged_s
        result          = judge()
        # Without the time of the tests without a fault that this judgement needed first.
        seconds         = time.monotonic() - begun - (self._judged_s - others_s)
        self._judged_s += seconds
        verdict         = Verdict(result, round(seconds, 1))
        if worth is None or verdict.result in worth:
            known.parent.mkdir(parents=True, exist_ok=True)
            known.write_text(json.dumps(vars(verdict)))
        return verdict

    def _faulty(self, area: Area, mutant: Mutant, tests: tuple[str, ...]) -> str:
        """Return what the tests say: the first part that fails ends them, and those after it need not be sound."""
        parts = _parts(tests)
        try:
            for part in parts:
                sound   = self._sound(area, mutant.file, part)
                limit_s = min(area.limit_s, round(MARGIN_S + SLOWER*sound.seconds))
                result  = self._run_with(mutant.file, mutant.source, part, limit_s)
                if result != "survived":
                    return result
            return "unchanged" if self._is_unchanged(area, mutant, parts) else "survived"
        finally:
            shutil.rmtree(self.builds, ignore_errors=True)

    def _is_unchanged(self, area: Area, mutant: Mutant, parts: list[tuple[str, ...]]) -> bool:
        """Return whether a survivor gives the same models or code as its file does, where the tests have built any."""
        if area.unchanged == "assembly":
            return self._same_code(area, mutant)
        if area.unchanged != "models" or self._new_models():
            return False
        # A test that comes to the place of the fault ends there.
        return any(self._run_with(mutant.file, mutant.replaced(UNREACHED), part, area.limit_s) == "caught"
                   for part in parts)

    def _sound(self, area: Area, file: str, part: tuple[str, ...]) -> Verdict:
        """Return the verdict of a file without a fault; raise CampaignError if its tests fail."""
        verdict = self._known(self._key(area, [], part), partial(self._run, part, area.limit_s, self.sound),
                              ("survived",))
        if verdict.result != "survived":
            raise CampaignError(f"tests of {file} say {verdict.result} without a fault: {' '.join(part)}; "
                                f"see {self.log}")
        return verdict

    def _run_with(self, file: str, source: str, part: tuple[str, ...], limit_s: int) -> str:
        """Run tests with another source of a file; the models of the unchanged files are there already."""
        # Models are only read once they are built, but the solver writes into the folder of a proof.
        (self.builds / "cosim").mkdir(parents=True, exist_ok=True)
        for model in self._models(self.sound, "cosim") - self._models(self.builds, "cosim"):
            (self.builds / "cosim" / model).symlink_to(self.sound / "cosim" / model)
        with self._source(file, source):
            return self._run(part, limit_s, self.builds)

    @contextlib.contextmanager
    def _source(self, file: str, source: str) -> Iterator[None]:
        path  = self.copy / file
        sound = path.read_text()
        path.write_text(source)
        try:
            yield
        finally:
            path.write_text(sound)

    def _new_models(self) -> bool:
        """Return whether the tests of a mutant have built a model or a proof that no unchanged file gives."""
        return any(self._models(self.builds, kind) - self._models(self.sound, kind) for kind in MODELS)

    @staticmethod
    def _models(builds: Path, kind: str) -> set[str]:
        folder = builds / kind
        return {path.name for path in folder.iterdir() if path.is_dir()} if folder.is_dir() else set()

    def _same_code(self, area: Area, mutant: Mutant) -> bool:
        """Return whether the compiler reads the fault, and gives the same assembly with it and without."""
        firmware = self.copy / "firmware"
        options  = [f"-I{firmware / name}" for name in ("include", ".", "tests/stubs", "tests/support")]
        sources  = [self.copy / mutant.file]
        if mutant.file.endswith(".h"):
            sources = sorted(path for folder in area.folders for path in (self.copy / folder).rglob("*.c"))

        def compiled(step: str) -> list[bytes]:
            return [subprocess.run([*COMPILE, *options, step, path, "-o", "-"], capture_output=True, check=False).stdout
                    for path in sources]

        def both(step: str) -> list[tuple[bytes, bytes]]:
            sound = compiled(step)
            with self._source(mutant.file, mutant.source):
                return list(zip(sound, compiled(step), strict=True))

        sources = [path for path, (sound, faulty) in zip(sources, both("-E"), strict=True) if sound != faulty]
        return bool(sources) and all(sound and sound == faulty for sound, faulty in both("-S"))

    def _run(self, tests: tuple[str, ...], limit_s: int, builds: Path) -> str:
        programs = [test for test in tests if PROGRAM.fullmatch(test)]
        try:
            with open(self.log, "w") as log:
                result = self._run_programs(programs, log, limit_s)
                if result == "survived" and len(programs) < len(tests):
                    result = self._run_pytest([test for test in tests if test not in programs], log, limit_s, builds)
                return result
        except _Hung:
            return "hung"

    def _run_programs(self, programs: list[str], log, limit_s: int) -> str:
        make = ["make", "-s", "-f", self.copy / "firmware" / "tests" / "Makefile", f"OUT={self.programs}"]
        for program in programs:
            if self._status([*make, program], log, limit_s):
                return "refused"
            if self._status([self.programs / program], log, limit_s):
                return "caught"
        return "survived"

    def _run_pytest(self, tests: list[str], log, limit_s: int, builds: Path) -> str:
        command = [sys.executable, "-m", "pytest", "-q", "-x", "--no-header", "-p", "no:cacheprovider",
                   *(f"tests/{test}" if ".py" in test else test for test in tests)]
        status  = self._status(command, log, limit_s, builds)
        # 1: a test failed; 2: the core could not be made, or the module not be loaded; below 0: it was killed.
        if status > 2:
            raise CampaignError(f"pytest ended with status {status}: see {self.log}")
        return "caught" if status else "survived"

    def _status(self, command: list[str | Path], log, limit_s: int, builds: Path | None = None) -> int:
        # Each simulator runs once and briefly, so most of the time is for compiling it.
        variables   = {"OPT_GLOBAL": "-O0", "SANITIZE": SANITIZE}
        if programs := {program for test, program in PROGRAMS.items()
                        if any(str(part).startswith(f"tests/{test}") for part in command)}:
            # These match whole images, and the programs before them have had the sanitizers.
            variables |= {"PROGRAMS": " ".join(sorted(programs)), "SANITIZE": "-O1 -w"}
        settings    = " ".join(f"{name}={value}".replace(" ", "\\ ") for name, value in variables.items())
        environment = os.environ | {
            "PYTHONPATH": str(self.copy.parent), "PYTHONDONTWRITEBYTECODE": "1",
            "LITESTEREO_BUILD": str(builds or self.builds), "LITESTEREO_OPTIMIZATION": "-O0",
            "MAKEFLAGS": f" -- {settings}",
        }
        # Processor time: how busy the computer is does not decide.
        limited = ["sh", "-c", 'ulimit -S -t "$0"; exec "$@"', str(limit_s), *command]
        with subprocess.Popen(limited, cwd=self.copy, env=environment, stdin=subprocess.DEVNULL, stdout=log, stderr=log,
                              start_new_session=True) as process:
            try:
                status = process.wait(PATIENCE*limit_s)
            except BaseException as error:
                # With all that the tests have started.
                os.killpg(process.pid, signal.SIGKILL)
                if isinstance(error, subprocess.TimeoutExpired):
                    raise _Hung from error
                raise
        if status == -signal.SIGXCPU:
            raise _Hung
        return status


def _parts(tests: tuple[str, ...]) -> list[tuple[str, ...]]:
    """Return tests in parts that several files may have: each program, and those of each file of pytest."""
    programs = [(test,) for test in tests if PROGRAM.fullmatch(test)]
    others   = [test for test in tests if not PROGRAM.fullmatch(test)]
    if "-k" in others:
        return [*programs, tuple(others)]
    files = dict.fromkeys(test.partition("::")[0] for test in others)
    return [*programs, *(tuple(test for test in others if test.partition("::")[0] == file) for file in files)]
