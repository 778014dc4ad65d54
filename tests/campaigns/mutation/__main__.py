#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""`make mutation`: break the gateware in small ways, and check that the tests of the broken core notice."""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import time

from litestereo.soc.build.paths import build_directory, content_key, source_key
from support.paths import CHECKOUT

from .explained import EQUIVALENT
from .gateware_faults import Mutant, drawn, source_of

GATEWARE = CHECKOUT / "gateware"

#: Fast tests of each core: arguments of pytest, with files relative to `tests`.
TESTS = {
    "absolute_difference": ["gateware/matcher/test_pixels.py", "-k", "absolute_difference"],
    "alignment":           ["gateware/matcher/test_pixels.py", "-k", "alignment"],
    "block_sum":           ["gateware/engines/test_sums.py", "-k", "block_sum"],
    "border":              ["gateware/post/test_map.py", "-k", "border"],
    "column_sum":          ["gateware/engines/test_sums.py", "-k", "column_sum"],
    "cost_delay":          ["gateware/post/test_selection.py", "-k", "cost_delay"],
    "left_right":          ["gateware/post/test_left_right.py"],
    "left_right_check":    ["gateware/post/test_left_right.py"],
    "line_buffer":         ["gateware/matcher/test_pixels.py", "-k", "line_buffer"],
    "median":              ["gateware/post/test_map.py", "-k", "median"],
    # The proof requires all marks, the peripheral does not.
    "pair_reader":         ["formal/test_formal.py", "gateware/peripherals/test_stereo_peripheral.py",
                            "-k", "test_stereo_peripheral or passes and PairReader"],
    "stereo_crossing":     ["gateware/peripherals/test_stereo_peripheral.py", "-k", "crossed or faster"],
    "port_crossing":       ["gateware/memory/test_port_crossing.py", "gateware/peripherals/test_stereo_peripheral.py",
                            "-k", "test_port_crossing or crossed or faster"],
    "prefilter":           ["gateware/matcher/test_pixels.py", "-k", "prefilter"],
    "pulse_crossing":      ["formal/test_formal.py", "-k", "passes and PulseCrossing"],
    "raster":              ["gateware/matcher/test_pixels.py", "-k", "raster"],
    "stream_writer":       ["gateware/peripherals/test_stereo_peripheral.py"],
    "subpixel":            ["gateware/post/test_selection.py", "-k", "subpixel or neighbours"],
    "uniqueness":          ["gateware/post/test_selection.py", "-k", "uniqueness or cost_limit"],
    "selection":           ["gateware/post/test_selection.py", "-k", "whole_selection"],
    "vote_row":            ["gateware/post/test_left_right.py"],
    "winner":              ["gateware/post/test_selection.py", "-k", "winner"],
}

#: Seconds that the tests of a mutant may take: a mutant that makes them hang is reported as such.
LIMIT_S = 1800


def outcome(mutant: Mutant, sources: str) -> str:
    """Return the verdict of the core's tests: "survived", "caught" or "hung"."""
    folder = build_directory() / "mutation"
    known  = folder / "results" / f"{content_key([mutant.source, sources, *TESTS[mutant.core]])}.txt"
    if known.is_file():
        return known.read_text()
    copy = folder / "copy" / "litestereo"
    shutil.rmtree(copy, ignore_errors=True)
    copy.mkdir(parents=True)
    for package in ("firmware", "host_tools", "sim", "soc"):
        (copy / package).symlink_to(CHECKOUT / package)
    shutil.copytree(GATEWARE, copy / "gateware", ignore=shutil.ignore_patterns("__pycache__"))
    source_of(copy / "gateware", mutant.core).write_text(mutant.source)
    # Each simulator runs once and briefly, so most of the time is for compiling it.
    environment = os.environ | {"PYTHONPATH": str(copy.parent), "PYTHONDONTWRITEBYTECODE": "1",
                                "LITESTEREO_BUILD": str(folder / "build"),
                                "LITESTEREO_OPTIMIZATION": "-O0", "MAKEFLAGS": " -- OPT_GLOBAL=-O0"}
    command = [sys.executable, "-m", "pytest", "-q", "-x", "--no-header", "-p", "no:cacheprovider",
               *(f"tests/{part}" if part.endswith(".py") else part for part in TESTS[mutant.core])]
    log = folder / "tests.log"
    with open(log, "w") as output:
        try:
            status = subprocess.run(command, cwd=CHECKOUT, env=environment, stdout=output, stderr=subprocess.STDOUT,
                                    timeout=LIMIT_S, check=False).returncode
        except subprocess.TimeoutExpired:
            # Not recorded: the computer may have been busy.
            return "hung"
    # 1: a test failed; 2: the core could not be made; below 0: its simulation was killed.
    if status > 2:
        raise RuntimeError(f"pytest ended with status {status}: see {log}")
    result = "caught" if status else "survived"
    known.parent.mkdir(parents=True, exist_ok=True)
    known.write_text(result)
    shutil.rmtree(folder / "build", ignore_errors=True)
    return result


def main() -> int:
    """Judge the mutants; the exit status is 1 if one survives that is not known to be equivalent."""
    parser = argparse.ArgumentParser(prog="mutation")
    parser.add_argument("--count", type=int, default=50, help="mutants to draw (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="what draws them (default: %(default)s)")
    parser.add_argument("--cores", nargs="+", choices=sorted(TESTS), default=sorted(TESTS), help="cores to break")
    options = parser.parse_args()
    sources = source_key(GATEWARE, CHECKOUT / "sim", CHECKOUT / "tests" / "gateware", CHECKOUT / "tests" / "support")
    judged  = {"caught": [], "hung": [], "equivalent": [], "survived": []}
    for mutant in drawn(GATEWARE, options.cores, options.count, options.seed):
        # Tests that already fail would catch every mutant.
        whole = Mutant(mutant.core, 0, "none", "", "", "", source_of(GATEWARE, mutant.core).read_text())
        if outcome(whole, sources) != "survived":
            print(f"mutation: the tests of {mutant.core} fail, or take too long, without a fault", file=sys.stderr)
            return 1
        begun  = time.monotonic()
        result = outcome(mutant, sources)
        if result == "survived" and (mutant.core, mutant.code, mutant.before, mutant.after) in EQUIVALENT:
            result = "equivalent"
        judged[result].append(mutant)
        print(f"{result:10} {time.monotonic() - begun:6.1f} s  {mutant.name[:90]}", flush=True)
    for mutant in judged["survived"]:
        print(f"survived: {mutant.name}")
    print(", ".join(f"{len(mutants)} {result}" for result, mutants in judged.items()) + ".")
    return 1 if judged["survived"] else 0


if __name__ == "__main__":
    sys.exit(main())
