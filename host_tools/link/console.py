#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The device's console, which shares the line with the link protocol."""

from __future__ import annotations

import time

from ..core.errors import LinkTimeout
from .link import Link
from .serial_channel import SerialChannel

#: What the firmware prints when it waits for a line.
PROMPT = "litestereo> "

#: Wait for text in seconds, between two looks at what has come.
_LOOK_S = 0.02

#: Longest wait in seconds for the prompt after an empty line; noise that it ended gets no prompt.
_EMPTY_LINE_S = 2.0


def run_line(link: Link, channel: SerialChannel, line: str, timeout_s: float) -> str:
    """Types `line`; returns what the device prints, without echo and prompt.

    `channel` is that of `link`. The text ends at the prompt, or when nothing has come for `timeout_s`. Raises
    LinkTimeout then if there was no text at all.
    """
    # An empty line first: it ends what noise has typed, and what comes up to its prompt is of no interest.
    channel.write_console("\n")
    _read(link, channel, min(timeout_s, _EMPTY_LINE_S))
    channel.write_console(line + "\n")
    text = _read(link, channel, timeout_s)
    if not text:
        raise LinkTimeout(f"the device's console printed nothing for {timeout_s:g} s")
    echo, newline, rest = text.removesuffix(PROMPT).partition("\n")
    return rest if newline and echo.strip() == line.strip() else text


def _read(link: Link, channel: SerialChannel, timeout_s: float) -> str:
    """Console text up to the next prompt, or until nothing comes for `timeout_s`; line ends are newlines."""
    text     = ""
    quiet_at = time.monotonic() + timeout_s
    while not text.endswith(PROMPT) and time.monotonic() < quiet_at:
        link.idle(_LOOK_S)
        if more := channel.take_console():
            text    += more.replace("\r", "")
            quiet_at = time.monotonic() + timeout_s
    return text
