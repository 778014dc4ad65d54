#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Waveforms of cores contain every clock, and the signals by name."""

from __future__ import annotations

import re
from urllib.parse import quote

import numpy as np
import pytest
from litex.gen import LiteXModule
from litex.soc.interconnect import stream
from migen import Signal

from litestereo.host_tools import MatcherSettings, connect
from litestereo.host_tools.core.errors import DeviceError
from litestereo.host_tools.devices import local
from litestereo.sim.cores.pin_core import PinCore
from litestereo.sim.cores.stream_core import StreamCore
from litestereo.sim.cores.verilated import TRACE_OPTIONS
from support.pairs import generator, textured_pair


class Counter(LiteXModule):
    """Counts the clocks, and passes its input on."""
    def __init__(self):
        self.sink   = stream.Endpoint([("data", 8)])
        self.source = stream.Endpoint([("data", 8)])
        self.clocks = Signal(8)
        self.sync += self.clocks.eq(self.clocks + 1)
        self.comb += self.sink.connect(self.source)


def changes(text, name):
    """Return the values of a signal in the order of a VCD file."""
    code = re.search(rf"\$var wire +\d+ (\S+) {name} ", text)[1]
    return [int(value, 2) for value in re.findall(rf"^b?([01]+) ?{re.escape(code)}$", text, re.MULTILINE)]


def test_each_clock_is_in_it(tmp_path):
    """The trace has a reset, ten clocks, and their time at 100 MHz."""
    core = Counter()
    path = tmp_path / "waves" / "counter.vcd"
    pins = PinCore(core, {}, {"clocks": core.clocks}, trace=path)
    for _ in range(10):
        pins.clock()
    assert pins.get("clocks") == 10
    pins.close()
    text = path.read_text()
    assert changes(text, "pin_clocks")[-10:] == list(range(1, 11))
    assert "$timescale 1ps $end" in text
    assert int(re.findall(r"^#(\d+)$", text, re.MULTILINE)[-1]) == 11*10_000


def test_a_stream_core_has_one_too(tmp_path):
    """A stream core writes the smaller format, chosen by its ending."""
    path = tmp_path / "stream.fst"
    core = StreamCore(Counter(), trace=path)
    core.run(np.arange(5, dtype=np.uint32), 5)
    core.close()
    assert core.waveform == path
    assert path.stat().st_size > 100


def test_every_model_of_a_test_run(tmp_path, monkeypatch):
    """The folder of the variable gets a file for each model; a requested trace goes to its path."""
    monkeypatch.setenv("LITESTEREO_TRACE", str(tmp_path))
    asked = tmp_path / "asked.vcd"
    for trace in (None, asked, None):
        PinCore(Counter(), {}, {}, trace=trace).close()
    assert len(list(tmp_path.glob("Counter-*.fst"))) == 2
    assert asked.is_file()


def test_the_device_cosim_writes_one(tmp_path):
    """The URL names the file, which has every clock of a frame and its settings."""
    left, right = textured_pair(24, 6, generator(841), shift=2)
    path = tmp_path / "waves" / "match.vcd"
    with connect(f"cosim:?disparities=16&max_width=24&max_block_size=5&trace={path}") as device:
        clocks = device.compute(left, right, MatcherSettings(16, 5)).clocks
    text = path.read_text()
    assert clocks > left.size
    assert changes(text, "setting_width") == [0, left.shape[1]]
    # 10 ns per clock; all clocks of the frame come after the reset.
    assert int(re.findall(r"^#(\d+)$", text, re.MULTILINE)[-1]) >= (clocks + 1)*10_000


def test_the_device_cosim_knows_the_endings():
    """The host tools refuse others before anything is built."""
    assert sorted(local._WAVEFORMS) == sorted(TRACE_OPTIONS)


@pytest.mark.parametrize("name", ["folder.fst", "folder.fst/file/wave.fst", "no\0.fst"])
def test_a_file_that_cannot_be_written_is_one_line(tmp_path, name):
    """Before Verilator, which would end the program."""
    (tmp_path / "folder.fst").mkdir()
    (tmp_path / "folder.fst" / "file").write_text("")
    with pytest.raises((OSError, ValueError)):
        PinCore(Counter(), {}, {}, trace=tmp_path / name)
    with pytest.raises(DeviceError, match="^cosim:.* cannot be built: .*") as caught:
        connect(f"cosim:?disparities=16&max_width=24&max_block_size=5&trace={quote(str(tmp_path / name))}")
    assert "\n" not in str(caught.value)


def test_another_ending_is_refused(tmp_path):
    """The error lists the known endings."""
    with pytest.raises(ValueError, match="ends in .vcd or .fst, not .*wave.txt"):
        PinCore(Counter(), {}, {}, trace=tmp_path / "wave.txt")
