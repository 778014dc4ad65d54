#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Runs a program of `firmware/examples` on the full system in litex_sim, and prints its output."""

from __future__ import annotations

import argparse
import socket
import sys
from collections.abc import Iterator

from .build import SimulationError, examples
from .simulation import start_simulation


def run_example(name: str, silence_s: float = 300.0) -> Iterator[str]:
    """Run an example; yield its lines until it reports its end, which some examples never do.

    Parameters
    ----------
    name
        One of `build.examples`.
    silence_s
        Longest wait for a line, in seconds.

    Raises
    ------
    SimulationError
        There is no such example, a build failed, or the program is silent for too long.
    """
    with (start_simulation(example=name) as simulation,
          socket.create_connection(("127.0.0.1", simulation.port), timeout=silence_s) as console,
          console.makefile(encoding="ascii", errors="replace", newline="\n") as lines):
        try:
            for line in lines:
                if line.strip() == f"{name}: end":
                    return
                yield line.rstrip()
        except TimeoutError:
            raise SimulationError(f"{name} has printed nothing for {silence_s:.0f} s") from None
        raise SimulationError(f"the simulator ended: {simulation.log().strip()[-200:]}")


def main() -> int:
    """Run the example named on the command line; return the exit status."""
    parser = argparse.ArgumentParser(prog="make example", description=__doc__)
    parser.add_argument("name", metavar="NAME", help=f"one of {', '.join(examples())}")
    try:
        for line in run_example(parser.parse_args().name):
            print(line, flush=True)
    except SimulationError as error:
        print(f"example: error: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print()
    return 0


if __name__ == "__main__":
    sys.exit(main())
