#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Runs any core in Verilator, pin by pin: for those that speak more than one stream."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping

from litex.gen import LiteXModule
from migen import Signal

from .verilated import PortsTop, build_library


def ports_header(ports: Mapping[str, int]) -> str:
    """C++ functions that set and get a port, by its index, as 32-bit words."""
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


class PinCore:
    """A core as Verilator runs it, one clock at a time.

    Parameters
    ----------
    core
        Any module.
    inputs, outputs
        Signals of the core to drive and to read, by the names that the ports get.
    """
    def __init__(self, core: LiteXModule, inputs: Mapping[str, Signal], outputs: Mapping[str, Signal]) -> None:
        top = PortsTop(core)
        for name, signal in inputs.items():
            top.comb += signal.eq(top.port(name, len(signal)))
        for name, signal in outputs.items():
            top.comb += top.port(name, len(signal)).eq(signal)
        widths       = {"sys_rst": 1} | {name: len(signal) for name, signal in [*inputs.items(), *outputs.items()]}
        self._ports  = {name: index for index, name in enumerate(widths)}
        self._words  = {name: (ctypes.c_uint32*-(-bits//32))() for name, bits in widths.items()}
        library      = ctypes.CDLL(str(build_library(top, ports_header(widths), "pin_bench.cpp")))
        library.core_new.restype = ctypes.c_void_p
        self._library = library
        self._core    = ctypes.c_void_p(library.core_new())
        self.reset()

    def set(self, **values: int) -> None:
        """Drive inputs, by name; they take effect at once."""
        for name, value in values.items():
            words = self._words[name]
            for index in range(len(words)):
                words[index] = value >> 32*index & 0xffffffff
            self._library.core_set(self._core, self._ports[name], words)
        self._library.core_eval(self._core)

    def get(self, name: str) -> int:
        """Value of an output."""
        words = self._words[name]
        self._library.core_get(self._core, self._ports[name], words)
        return sum(word << 32*index for index, word in enumerate(words))

    def clock(self) -> None:
        """One rising edge of the clock."""
        self._library.core_clock(self._core)

    def reset(self) -> None:
        """One clock of reset."""
        self.set(sys_rst=1)
        self.clock()
        self.set(sys_rst=0)

    def close(self) -> None:
        """Free the model."""
        if self._core:
            self._library.core_free(self._core)
            self._core = ctypes.c_void_p(None)
