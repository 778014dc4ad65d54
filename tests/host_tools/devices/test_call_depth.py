#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""How short and flat a `compute` over UDP is: modules entered, and depth of the stack at the socket."""

import contextlib
import sys
from pathlib import Path

import pytest

from litestereo import host_tools
from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.host_tools.devices.connect import connect
from support.expected import SETTINGS, expect
from support.pairs import pairs
from support.udp_device import made_up_map, udp_device

#: Most modules of the host tools that a `compute` may enter, and most of their frames on the stack at the socket.
MOST_MODULES = 13
MOST_FRAMES  = 8

HOST_TOOLS = str(Path(host_tools.__file__).parent)


class Trace:
    """What this thread calls: the `modules` entered, the number of `calls`, and the `stacks` at the socket."""

    def __init__(self):
        self.modules = set()
        self.calls   = 0
        self.deepest = []
        self.stacks  = set()

    def note(self, frame, event, argument):
        if event == "call" and frame.f_code.co_filename.startswith(HOST_TOOLS):
            self.modules.add(frame.f_code.co_filename.removeprefix(HOST_TOOLS + "/"))
            self.calls  += 1
            self.deepest = max(self.deepest, self.stack(frame), key=len)
        if event == "c_call" and argument.__name__ in ("sendmsg", "send", "recv", "recv_into", "poll"):
            self.stacks.add((argument.__name__, *self.stack(frame)))

    @staticmethod
    def stack(frame):
        """Names of the functions of the host tools on the stack, the first one called first."""
        names = []
        while frame is not None:
            if frame.f_code.co_filename.startswith(HOST_TOOLS):
                names.append(frame.f_code.co_name)
            frame = frame.f_back
        return names[::-1]


@contextlib.contextmanager
def traced():
    """Trace what this thread does inside."""
    trace = Trace()
    sys.setprofile(trace.note)
    try:
        yield trace
    finally:
        sys.setprofile(None)


def check(trace):
    """Print what was traced, for the report of a failure, and assert the limits."""
    for call, *names in sorted(trace.stacks, key=len):
        print(f"{len(names):2} {call}: {', '.join(names)}")
    print(f"deepest {len(trace.deepest)}: {', '.join(trace.deepest)}")
    print(f"{len(trace.modules)} modules, {trace.calls} calls")
    print("\n".join(sorted(trace.modules)))
    kinds = {call for call, *_ in trace.stacks}
    assert {"sendmsg", "recv"} <= kinds
    assert max(len(names) for _, *names in trace.stacks) <= MOST_FRAMES
    assert len(trace.modules) <= MOST_MODULES


@pytest.mark.parametrize("computes", [0, 1])
def test_compute_is_short_and_flat(computes):
    """The first one, which configures the device, and a later one."""
    (pair,) = pairs(1, 64, 20)
    with udp_device() as there, connect(there.url) as device:
        for _ in range(computes):
            device.compute(*pair, SETTINGS)
        with traced() as trace:
            result = device.compute(*pair, SETTINGS)
    expect(result, pair, expected=made_up_map)
    check(trace)


def test_compute_with_other_settings_is_as_flat():
    """A change of the settings begins another session first."""
    (pair,) = pairs(1, 64, 20)
    with udp_device() as there, connect(there.url) as device:
        device.compute(*pair, MatcherSettings(16, 5))
        with traced() as trace:
            result = device.compute(*pair, SETTINGS)
    expect(result, pair, expected=made_up_map)
    check(trace)
