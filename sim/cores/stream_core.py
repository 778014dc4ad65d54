#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Runs a stream core in Verilator: items into its sink, items out of its source."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from migen import Cat
from numpy.typing import NDArray

from .verilated import PortsTop
from .verilated_core import VerilatedCore


class StreamTop(PortsTop):
    """The core with its sink, source, settings and status as plain ports, for endpoints of any layout.

    A pipeline core never stalls, and its endpoints have no ready.
    """
    def __init__(self, core, settings: Sequence[str], pipeline: bool, status: Sequence[str] = ()) -> None:
        PortsTop.__init__(self, core)
        for side in ["sink", "source"]:
            endpoint = getattr(core, side)
            fields   = [getattr(endpoint, name) for name, *_ in endpoint.description.payload_layout]
            data     = self.port(f"{side}_data", sum(len(field) for field in fields))
            for name in ["valid", "ready", "first", "last"]:
                port  = self.port(f"{side}_{name}", 1)
                inner = getattr(endpoint, name)
                if pipeline and name == "ready":
                    self.comb += port.eq(1) if side == "sink" else []
                elif (side == "sink") != (name == "ready"):
                    self.comb += inner.eq(port)
                else:
                    self.comb += port.eq(inner)
            self.comb += Cat(*fields).eq(data) if side == "sink" else data.eq(Cat(*fields))
        for name in settings:
            setting = getattr(core, name)
            self.comb += setting.eq(self.port(f"setting_{name}", len(setting)))
        for name in status:
            signal = getattr(core, name)
            self.comb += self.port(f"status_{name}", len(signal)).eq(signal)


def ports_header(sink_bits: int, source_bits: int, settings: Sequence[str], status: Sequence[str] = ()) -> str:
    """Return C++ functions that move words to and from the model's ports, whose C++ types depend on their width."""
    def move(bits: int, port: str, target: str) -> list[str]:
        lines = []
        for index in range(-(-bits//32)):
            part = f"model.{port}[{index}]" if bits > 64 else f"model.{port} >> {32*index}"
            lines.append(f"    words[{index}] = {part};" if target == "words" else f"    {part} = words[{index}];")
        if target == "port" and bits <= 64:
            high  = " | (uint64_t)words[1] << 32" if bits > 32 else ""
            lines = [f"    model.{port} = words[0]{high};"]
        return lines

    cases = [f"    case {index}: model.setting_{name} = value; break;" for index, name in enumerate(settings)]
    shown = [f"    case {index}: return model.status_{name};" for index, name in enumerate(status)]
    return "\n".join([
        '#include "Vcore.h"',
        "using Model = Vcore;",
        f"constexpr unsigned SINK_WORDS = {-(-sink_bits//32)}, SOURCE_WORDS = {-(-source_bits//32)};",
        "static inline void set_sink(Model &model, const uint32_t *words)", "{",
        *move(sink_bits, "sink_data", "port"), "}",
        "static inline void get_source(Model &model, uint32_t *words)", "{",
        *move(source_bits, "source_data", "words"), "}",
        "static inline void set_setting(Model &model, uint32_t setting, uint32_t value)", "{",
        "    switch (setting) {", *cases, "    }", "}",
        "static inline uint32_t get_status(Model &model, uint32_t status)", "{",
        "    switch (status) {", *shown, "    }", "    return 0;", "}", ""])


class _Run(ctypes.Structure):
    """Mirror of `struct Run` in stream_bench.cpp."""
    _fields_ = ([("input", ctypes.c_void_p), ("input_marks", ctypes.c_void_p), ("inputs", ctypes.c_uint64),
                 ("output", ctypes.c_void_p), ("output_marks", ctypes.c_void_p), ("outputs", ctypes.c_uint64),
                 ("idle_clocks", ctypes.c_uint64), ("valid_per_mille", ctypes.c_uint32),
                 ("ready_per_mille", ctypes.c_uint32)]
                + [(name, ctypes.c_uint64) for name in ("seed", "reset_clock", "probe", "accepted", "captured",
                                                        "clocks", "probe_clock")])


@dataclass(frozen=True)
class RunResult:
    """Result of `StreamCore.run`."""
    words: NDArray[np.uint32]  #: captured items, N x words of an item
    first: NDArray[np.bool_]   #: mark of each
    last: NDArray[np.bool_]    #: mark of each
    accepted: int              #: items that the sink took
    clocks: int                #: from the first clock of the run to the last item captured
    probe_clock: int           #: from the first clock of the run to the item of `probe`


class StreamCore(VerilatedCore):
    """A stream core as Verilator runs it.

    Parameters
    ----------
    core
        Module with the endpoints `sink` and `source`.
    settings
        Names of the core's Signals that `set` may drive.
    pipeline
        The core never stalls and has no ready.
    status
        Names of the core's Signals that `get` may read.
    trace
        File for a waveform, .vcd or .fst: see `VerilatedCore`.
    """
    def __init__(self, core, settings: Sequence[str] = (), pipeline: bool = False, status: Sequence[str] = (),
                 trace: Path | None = None) -> None:
        self.settings    = list(settings)
        self.status      = list(status)
        top              = StreamTop(core, settings, pipeline, status)
        bits             = {side: sum(len(getattr(getattr(core, side), name))
                                      for name, *_ in getattr(core, side).description.payload_layout)
                            for side in ("sink", "source")}
        self.sink_words   = -(-bits["sink"]//32)
        self.source_words = -(-bits["source"]//32)
        VerilatedCore.__init__(self, top, ports_header(bits["sink"], bits["source"], settings, status),
                               "stream_bench.cpp", trace)
        for name, types in [("core_reset", []), ("core_run", [ctypes.POINTER(_Run)]),
                            ("core_set", [ctypes.c_uint32, ctypes.c_uint32]), ("core_get", [ctypes.c_uint32])]:
            function          = getattr(self._library, name)
            function.restype  = ctypes.c_uint32 if name == "core_get" else None
            function.argtypes = [ctypes.c_void_p, *types]
        self.reset()

    def reset(self) -> None:
        """Hold the reset for one clock."""
        self._library.core_reset(self._core)

    def set(self, **settings: int) -> None:
        """Drive settings, by name."""
        for name, value in settings.items():
            self._library.core_set(self._core, self.settings.index(name), value)

    def get(self, name: str) -> int:
        """Return a status, by name."""
        return int(self._library.core_get(self._core, self.status.index(name)))

    def run(self, words: NDArray[np.uint32], outputs: int, *, first: NDArray[np.bool_] | None = None,
            last: NDArray[np.bool_] | None = None, valid: float = 1.0, ready: float = 1.0, seed: int = 0,
            reset_clock: int = 0, probe: int = 0, idle_clocks: int = 20000) -> RunResult:
        """Feed the sink and capture the source, until `outputs` items have come or nothing moves any more.

        Parameters
        ----------
        words
            Items for the sink, uint32, N x `sink_words` (or N if an item fits one word); fields from bit 0 up in
            the order of the layout.
        outputs
            Number of items to capture.
        first, last
            Marks of the items.
        valid, ready
            Chance, per clock, that the next item is offered and that the source is ready.
        seed
            Seeds these chances.
        reset_clock
            Stop at this clock, if above 0; call `reset` afterwards.
        probe
            Index of the captured item whose clock is returned as `probe_clock`.
        idle_clocks
            Clocks without any transfer after which the run ends.
        """
        items  = np.ascontiguousarray(words, np.uint32).reshape(-1, self.sink_words)
        marks  = np.zeros(len(items), np.uint8)
        marks |= 0 if first is None else first.astype(np.uint8)
        marks |= 0 if last  is None else last.astype(np.uint8) << 1
        output       = np.zeros((outputs, self.source_words), np.uint32)
        output_marks = np.zeros(outputs, np.uint8)
        run = _Run(items.ctypes.data, marks.ctypes.data, len(items), output.ctypes.data, output_marks.ctypes.data,
                   outputs, idle_clocks, round(1000*valid), round(1000*ready), seed, reset_clock, probe)
        self._library.core_run(self._core, ctypes.byref(run))
        count = run.captured
        return RunResult(output[:count], (output_marks[:count] & 1) != 0, (output_marks[:count] & 2) != 0,
                         run.accepted, run.clocks, run.probe_clock)
