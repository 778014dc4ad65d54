#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The device's console, which shares the line with the link protocol."""

from __future__ import annotations

import time

from .errors import LinkTimeout
from .link import Link

#: What the firmware prints when it waits for a line.
PROMPT = "litestereo> "

#: Wait for text in seconds, between two looks at what has come.
_LOOK_S = 0.05


def run_line(link: Link, line: str, timeout_s: float) -> str:
    """Types `line`; returns what the device prints, without echo and prompt.

    The text ends at the prompt, or when nothing has come for `timeout_s`. Raises LinkTimeout if nothing comes at all.
    """
    link.demux.take_console()
    link.write_console(line + "\n")
    text     = ""
    quiet_at = time.monotonic() + timeout_s
    while not text.endswith(PROMPT) and time.monotonic() < quiet_at:
        link.idle(_LOOK_S)
        if more := link.demux.take_console():
            text    += more.replace("\r", "")
            quiet_at = time.monotonic() + timeout_s
    if not text:
        raise LinkTimeout(f"the device's console printed nothing for {timeout_s:g} s")
    return _body(text, line)


def _body(text: str, line: str) -> str:
    """Console output without the echo of the line before it and the prompt after it."""
    text = text.removesuffix(PROMPT).removeprefix(PROMPT)
    echo, newline, rest = text.partition("\n")
    return rest if newline and echo.strip() == line.strip() else text
