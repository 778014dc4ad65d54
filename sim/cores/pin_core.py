#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Runs any core in Verilator, pin by pin, for cores with several streams."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from pathlib import Path

from litex.gen import LiteXModule
from migen import Signal

from .verilated import PortsTop
from .verilated_core import VerilatedCore


def ports_header(ports: Mapping[str, int]) -> str:
    """Return C++ functions that set and get a port, by its index, as 32-bit words."""
    setters, getters = [], []
    for index, (name, bits) in enumerate(ports.items()):
        words = range(-(-bits//32))
        if bits > 64:
            put  = " ".join(f"model.{name}[{word}] = words[{word}];" for word in words)
            take = " ".join(f"words[{word}] = model.{name}[{word}];" for word in words)
        else:
            value = " | ".join(f"(uint64_t)words[{word}] << {32*word}" for word in words)
            put   = f"model.{name} = {value};"
            take  = " ".join(f"words[{word}] = (uint64_t)model.{name} >> {32*word};" for word in words)
        setters.append(f"    case {index}: {put} break;")
        getters.append(f"    case {index}: {take} break;")
    return "\n".join([
        '#include "Vcore.h"', "using Model = Vcore;",
        "static inline void set_port(Model &model, uint32_t port, const uint32_t *words)", "{",
        "    switch (port) {", *setters, "    }", "}",
        "static inline void get_port(Model &model, uint32_t port, uint32_t *words)", "{",
        "    switch (port) {", *getters, "    }", "}", ""])


class PinCore(VerilatedCore):
    """A core as Verilator runs it, one clock at a time.

    Parameters
    ----------
    core
        Any module.
    inputs, outputs
        Signals of the core to drive and to read, by the names that the ports get.
    trace
        File for a waveform, .vcd or .fst: see `VerilatedCore`.
    """
    def __init__(self, core: LiteXModule, inputs: Mapping[str, Signal], outputs: Mapping[str, Signal],
                 trace: Path | None = None) -> None:
        top = PortsTop(core)
        for name, signal in inputs.items():
            top.comb += signal.eq(top.port(f"pin_{name}", len(signal)))
        for name, signal in outputs.items():
            top.comb += top.port(f"pin_{name}", len(signal)).eq(signal)
        pins         = {f"pin_{name}": len(signal) for name, signal in [*inputs.items(), *outputs.items()]}
        widths       = {"sys_rst": 1} | pins
        self._ports  = {name: index for index, name in enumerate(widths)}
        self._words  = {name: (ctypes.c_uint32*-(-bits//32))() for name, bits in widths.items()}
        VerilatedCore.__init__(self, top, ports_header(widths), "pin_bench.cpp", trace)
        self.reset()

    def set(self, **values: int) -> None:
        """Drive inputs, by name; they take effect at once."""
        for name, value in values.items():
            self._drive(f"pin_{name}", value)
        self._library.core_eval(self._core)

    def _drive(self, port: str, value: int) -> None:
        words = self._words[port]
        for index in range(len(words)):
            words[index] = value >> 32*index & 0xffffffff
        self._library.core_set(self._core, self._ports[port], words)

    def get(self, name: str) -> int:
        """Return the value of an output."""
        words = self._words[f"pin_{name}"]
        self._library.core_get(self._core, self._ports[f"pin_{name}"], words)
        return sum(word << 32*index for index, word in enumerate(words))

    def clock(self) -> None:
        """Run for one rising edge of the clock."""
        self._library.core_clock(self._core)

    def reset(self) -> None:
        """Hold the reset for one clock."""
        self.hold_reset(1)
        self.clock()
        self.hold_reset(0)

    def hold_reset(self, value: int) -> None:
        """Drive the reset, without a clock."""
        self._drive("sys_rst", value)
        self._library.core_eval(self._core)
