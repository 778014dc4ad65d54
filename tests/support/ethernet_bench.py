#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The litex_sim module ethernet2socket without a simulator: see ethernet_bench.c."""

from __future__ import annotations

import fcntl
import functools
import importlib.util
import json
import re
import shlex
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import NamedTuple

import pytest

from .paths import CHECKOUT

MODULE = CHECKOUT / "sim" / "socs" / "modules" / "ethernet2socket"
OUT    = CHECKOUT / "build" / "ethernet_bench"

FLAGS = shlex.split("-std=c11 -Wall -Wextra -Werror -Wshadow -g -O1 -fsanitize=address,undefined "
                    "-fno-sanitize-recover=all -fno-omit-frame-pointer")

#: Counters of the module, in their order.
OUTCOMES = ("datagram", "arp_request", "other", "short", "long", "ip_length", "ip_checksum", "fragment", "udp_length",
            "udp_checksum", "sender", "unsent", "long_datagram", "datagram_elsewhere")


class Frame(NamedTuple):
    """A frame that the module has sent."""
    session: int
    clock:   int    #: clock of the first byte
    data:    bytes


def litex_sim_core() -> Path:
    """Return the folder of LiteX's sources of litex_sim."""
    (litex,) = importlib.util.find_spec("litex").submodule_search_locations
    return Path(litex) / "build" / "sim" / "core"


@functools.cache
def build() -> Path:
    """Build the program under the sanitizers; skip the test if there is no compiler."""
    if not shutil.which("gcc"):
        pytest.skip("gcc is needed to build the module for this computer")
    OUT.mkdir(parents=True, exist_ok=True)
    with open(OUT / "lock", "w", encoding="ascii") as lock:
        # Several test processes may build at the same time.
        fcntl.flock(lock, fcntl.LOCK_EX)
        command = ["gcc", *FLAGS, "-isystem", litex_sim_core(), f"-I{MODULE}",
                   CHECKOUT / "tests/support/ethernet_bench.c", "-o", OUT / "new", "-ljson-c"]
        done    = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        # A running program cannot be overwritten.
        (OUT / "new").rename(OUT / "ethernet_bench")
    return OUT / "ethernet_bench"


class EthernetBench:
    """The module with one or two sessions; an error of a sanitizer fails the test at the end.

    Parameters
    ----------
    arguments
        Arguments of each session, as in litex_sim's configuration; None for no arguments.
    """
    def __init__(self, *arguments: dict[str, object] | None) -> None:
        command: list[str | Path] = [build()]
        for one in arguments or (None,):
            command += [str((one or {}).get("clock", "sys_clk")), "" if one is None else json.dumps(one)]
        pipe              = subprocess.PIPE
        self._process     = subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, text=True)
        self.ports        = [self._port() for _ in arguments or (None,)]  #: of 127.0.0.1, one per session
        self.complaints: list[str] = []                                   #: standard error, known after the end

    def __enter__(self) -> EthernetBench:
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None,
                 trace: TracebackType | None) -> None:
        _, complaints   = self._process.communicate(timeout=10)
        self.complaints = complaints.splitlines()
        assert self._process.returncode == 0, complaints

    def _port(self) -> int:
        line  = self._process.stdout.readline()
        match = re.fullmatch(r"\[ethernet2socket\] listening on 127\.0\.0\.1:(\d+)\n", line)
        assert match, line + self._process.communicate()[1]
        return int(match[1])

    def _ask(self, command: str) -> list[list[str]]:
        self._process.stdin.write(command + "\n")
        self._process.stdin.flush()
        answers = []
        while (line := self._process.stdout.readline()) != "done\n":
            assert line, self._process.communicate()[1]
            answers.append(line.split())
        return answers

    def send(self, frames: Sequence[bytes], session: int = 0) -> None:
        """Queue frames of the SoC, a clock apart; they start with the next `run`."""
        for frame in frames:
            self._ask(f"send {session} {frame.hex()}")

    def run(self, clocks: int) -> list[Frame]:
        """Advance the time; return the frames that the SoC received."""
        return [Frame(int(session), int(clock), bytes.fromhex(data))
                for _, session, clock, data in self._ask(f"run {clocks}")]

    def deliver(self, frames: Sequence[bytes]) -> list[Frame]:
        """Send frames of the SoC, and advance the time until the last one is sent and answered."""
        self.send(frames)
        return self.run(sum(map(len, frames)) + len(frames) + 200)

    def fuzz(self, frames: Sequence[bytes], seed: int, count: int) -> int:
        """Send `count` mutations of `frames`; return how many were datagrams for a socket, which none reaches."""
        self.send(frames)
        ((_, delivered),) = self._ask(f"fuzz 0 {seed} {count}")
        return int(delivered)

    def set_clock(self, clock: int, session: int = 0) -> None:
        """Set the module's clock, as if so many clocks had passed."""
        self._ask(f"clock {session} {clock}")

    def outcomes(self, session: int = 0) -> dict[str, int]:
        """Return the counters that are not 0."""
        ((_, *numbers),) = self._ask(f"outcomes {session}")
        return {name: int(number) for name, number in zip(OUTCOMES, numbers, strict=True) if int(number)}
