#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""A person at the serial line: the console without a session, also while a host holds one."""

from __future__ import annotations

import re
import socket
import time

_PROMPT = "litestereo> "


def typed(port: int, line: str, timeout_s: float = 20.0) -> str:
    """Return what the console at TCP port `port` prints for `line`, without echo and prompt."""
    give_up_at = time.monotonic() + timeout_s
    text       = ""
    with socket.create_connection(("127.0.0.1", port), timeout=1) as terminal:
        terminal.sendall(f"\n{line}\n".encode())
        while not (found := re.search(rf"{re.escape(line)}\r\n(.*){_PROMPT}$", text, re.DOTALL)):
            assert time.monotonic() < give_up_at, f"no answer to {line!r}: {text!r}"
            try:
                received = terminal.recv(4096)
            except TimeoutError:
                continue
            assert received, f"the simulator hung up: {text!r}"
            text += received.decode("ascii", "replace")
    return found[1].replace("\r", "")


def counters(port: int) -> dict[str, int]:
    """Return the counters that the console prints, by name; to ask changes no counter of a network."""
    return {name: int(value) for name, value in re.findall(r"^(\w+): (\d+)$", typed(port, "stats"), re.MULTILINE)}
