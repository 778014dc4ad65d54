#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Runs the full system until Ctrl-C, as a device for `udp://` and `tcp://` URLs."""

from __future__ import annotations

import argparse
import sys

from ...host_tools.protocol.messages import UDP_PORT
from ...soc.boards import BOARDS
from .build import MEMORIES, SimulationError
from .simulation import start_simulation


def main() -> int:
    """Run the simulation; return the exit status."""
    parser = argparse.ArgumentParser(prog="make sim", description=__doc__,
                                     formatter_class=argparse.ArgumentDefaultsHelpFormatter)
    parser.add_argument("--port", type=int, default=2000, help="TCP port of 127.0.0.1 for the UART, 0 for any free one")
    parser.add_argument("--udp-port", type=int, default=UDP_PORT,
                        help="UDP port of 127.0.0.1 for the Ethernet, 0 for any free one")
    parser.add_argument("--ram", choices=(*MEMORIES, *BOARDS), default="integrated-ram",
                        help="main memory of the SoC, or a board for its SoC")
    options = parser.parse_args()
    for port in (options.port, options.udp_port):
        if not 0 <= port < 1 << 16:
            parser.error(f"a port is a number from 0 to 65535, not {port}")
    try:
        with start_simulation(options.ram, options.port, options.udp_port) as simulation:
            print(f"running; device URLs udp://127.0.0.1:{simulation.udp_port} and tcp://127.0.0.1:{simulation.port}, "
                  "Ctrl-C ends it", flush=True)
            simulation.wait()
    except SimulationError as error:
        print(f"sim: error: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print()
        return 0
    print("sim: error: the simulator ended by itself", file=sys.stderr)
    return 1


if __name__ == "__main__":
    sys.exit(main())
