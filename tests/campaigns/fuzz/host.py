#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Fuzz the host tools' readers of files: `PYTHONPATH=tests .venv/bin/python -m campaigns.fuzz.host`.

A target reads the bytes of a file. For any bytes it returns, or raises an error of the host tools with one line:
anything else is a fault. Inputs are valid files with some bytes replaced, removed, repeated or swapped for those of
another file, and numbers at the limits of their types.
"""

from __future__ import annotations

import argparse
import collections
import random
import re
import resource
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from litestereo.host_tools.core.errors import LiteStereoError
from litestereo.soc.build.paths import build_directory

from . import host_cameras, host_files, host_recordings

Target = Callable[[bytes], None]

#: All targets by their names. Another module of files has to add its own here, and its seeds to `SEEDS`.
TARGETS: dict[str, Target] = {**host_files.TARGETS, **host_cameras.TARGETS, **host_recordings.TARGETS}

#: Valid files, from which the inputs are made.
SEEDS: dict[str, list[bytes]] = {**host_files.SEEDS, **host_cameras.SEEDS, **host_recordings.SEEDS}

#: Memory that this process may use in a campaign, in bytes: an input that asks for more fails.
MEMORY_BYTES = 6 << 30

#: Seconds that one input may take.
LIMIT_S = 10.0

#: Bytes that parsers treat in a special way.
_TOKENS = (b"\0", b"\xff", b"\n", b"\r\n", b" ", b"-", b"nan", b"inf", b"1e999", b"0", b"9"*9, b"9"*30, b"[", b"("*50,
           b"\x7f\xff\xff\xff", b"\x80\0\0\0", b"\xff\xff\xff\xff", b"|O", b"<f4", b"'shape': (1000000000000,)")


@dataclass
class Result:
    """What a target did: executions, how often each outcome came, and the input of a fault."""

    target:     str
    executions: int = 0
    outcomes:   collections.Counter[str] = field(default_factory=collections.Counter)
    fault:      str = ""
    input:      Path | None = None

    def __str__(self) -> str:
        """Return the result in one line."""
        line = f"{self.target:12} {self.executions:8} executions {len(self.outcomes):4} outcomes"
        return f"{line}  FAULT: {self.fault}: {self.input}" if self.fault else line


def mutated(rng: random.Random, seeds: list[bytes]) -> bytes:
    """Return a file with some changes."""
    data = bytearray(rng.choice(seeds))
    for _ in range(rng.choice((0, 1, 1, 1, 2, 3, 8))):
        # The header is at the beginning, and a change of it does more.
        end   = min(len(data), 160) if rng.random() < 0.7 else len(data)
        place = rng.randrange(end + 1)
        kind  = rng.randrange(6)
        if kind == 0 and data:
            data[min(place, len(data) - 1)] ^= 1 << rng.randrange(8)
        elif kind == 1:
            del data[place:place + rng.choice((1, 2, 4, 64, len(data)))]
        elif kind == 2:
            data[place:place] = rng.choice(_TOKENS)
        elif kind == 3:
            token = rng.choice(_TOKENS)
            data[place:place + len(token)] = token
        elif kind == 4:
            data[place:place] = data[place:place + rng.choice((1, 4, 32))]
        else:
            other = rng.choice(seeds)
            data[place:] = other[rng.randrange(len(other) + 1):]
    return bytes(data)


def outcome(target: Target, data: bytes) -> tuple[str, str]:
    """Run a target; return what came, without numbers and names of files, and what is wrong with it, "" if nothing."""
    began = time.monotonic()
    try:
        target(data)
        came, fault = "read", ""
    except LiteStereoError as error:
        text  = str(error)
        came  = re.sub(r"\S*/\S+|\d+|'[^']*'", "#", f"{type(error).__name__}: {text}")[:90]
        fault = "" if text and text.isprintable() else f"an error that is not one line: {text!r}"
    except Exception as error: # The faults that this looks for.
        came  = type(error).__name__
        where = traceback.extract_tb(error.__traceback__)[-1]
        fault = f"{came}: {' '.join(str(error).split())} ({Path(where.filename).name}:{where.lineno})"
    took_s = time.monotonic() - began
    return came, fault or (f"took {took_s:.1f} s" if took_s > LIMIT_S else "")


def run(name: str, seconds: float, seed: int = 1, targets: dict[str, Target] | None = None) -> Result:
    """Run a target for some seconds, or until a fault, whose input is written to a file."""
    target = (TARGETS if targets is None else targets)[name]
    seeds  = SEEDS.get(name) or [b""]
    rng    = random.Random(f"{name} {seed}")
    result = Result(name)
    end    = time.monotonic() + seconds
    while time.monotonic() < end and not result.fault:
        data = seeds[result.executions] if result.executions < len(seeds) else mutated(rng, seeds)
        came, result.fault = outcome(target, data)
        result.executions += 1
        result.outcomes[came] += 1
    if result.fault:
        folder = build_directory() / "fuzz_crashes"
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(prefix=f"host-{name}-", dir=folder, delete=False) as file:
            file.write(data)
        result.input = Path(file.name)
    return result


def main() -> int:
    """Run, and print a line for each target; return 1 if one has a fault."""
    parser = argparse.ArgumentParser(prog="fuzz.host", description="fuzz the host tools' readers of files")
    parser.add_argument("--seconds", type=int, default=60, help="for each target (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="of what is tried (default: %(default)s)")
    parser.add_argument("--targets", nargs="+", choices=sorted(TARGETS), default=sorted(TARGETS), help="targets to run")
    parser.add_argument("--outcomes", action="store_true", help="print the outcomes too, the most frequent first")
    options = parser.parse_args()
    if options.seconds < 1:
        parser.error("--seconds: 1 or more")
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
    faults = 0
    for name in options.targets:
        result = run(name, options.seconds, options.seed)
        print(result, flush=True)
        if options.outcomes:
            print("\n".join(f"{count:8} {came}" for came, count in result.outcomes.most_common()))
        faults += bool(result.fault)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
