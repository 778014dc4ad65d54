#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The device's console, which shares the serial line with the link protocol."""

from __future__ import annotations

import time

from ..core.errors import LinkTimeout
from .link import Link
from .serial_channel import SerialChannel

#: Prompt of the firmware's console.
PROMPT = "litestereo> "

#: Seconds between two polls for console text.
_POLL_S = 0.02

#: Longest wait in seconds for the prompt after an empty line: if that line ended noise, no prompt follows.
_EMPTY_LINE_S = 2.0


def run_line(link: Link, channel: SerialChannel, line: str, timeout_s: float) -> str:
    """Type `line` at the console and return what the device prints, without echo and prompt.

    Parameters
    ----------
    link, channel
        The link, and the channel below it.
    line
        The command, without an end of line.
    timeout_s
        Seconds without further text after which the output counts as complete if no prompt has come.

    Raises
    ------
    LinkTimeout
        The device printed nothing at all.
    DeviceError
        The line is gone.
    """
    # The device may be busy with the command for a while: requests in flight would time out.
    link.drain()
    # An empty line ends what noise may have typed; ignore what the device prints up to its prompt.
    channel.write_console("\n")
    _read(link, channel, min(timeout_s, _EMPTY_LINE_S))
    channel.write_console(line + "\n")
    text = _read(link, channel, timeout_s)
    if not text:
        raise LinkTimeout(f"the device's console printed nothing for {timeout_s:g} s")
    echo, newline, rest = text.removesuffix(PROMPT).partition("\n")
    return rest if newline and echo.strip() == line.strip() else text


def _read(link: Link, channel: SerialChannel, timeout_s: float) -> str:
    """Return console text up to the next prompt, or until none comes for `timeout_s`; ends of line are newlines."""
    text     = ""
    quiet_at = time.monotonic() + timeout_s
    while not text.endswith(PROMPT) and time.monotonic() < quiet_at:
        link.idle(_POLL_S)
        if more := channel.take_console():
            text    += more.replace("\r", "")
            quiet_at = time.monotonic() + timeout_s
    return text
