#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""A core, assumptions about its surroundings, and the promises to be proven."""

from __future__ import annotations

import re
from collections.abc import Callable
from unittest import mock

from litex.gen import LiteXModule
from litex.gen.fhdl import verilog
from migen import Signal
from migen.fhdl.tools import list_signals

from litestereo.sim.cores.verilated import PortsTop


def inside(core: LiteXModule, name: str) -> list[Signal]:
    """Return the Signals of that name anywhere in the core, in the order of their creation.

    Proofs by induction relate the core's registers to each other, also those that only its constructor has names
    for.
    """
    found = {signal for signal in list_signals(core._fragment)
             if (signal.name_override or signal.backtrace[-1][0]) == name}
    if not found:
        raise LookupError(f"the core has no signal {name}")
    return sorted(found, key=lambda signal: signal.duid)


def smaller(core: type, **values: object) -> Callable[..., LiteXModule]:
    """Return a core made with other constants of its module: a small one with the same arithmetic."""
    names = next(vars(kind)["__init__"].__globals__ for kind in core.__mro__
                 if "__init__" in vars(kind) and set(values) <= set(vars(kind)["__init__"].__globals__))

    def make(*arguments: object, **options: object) -> LiteXModule:
        with mock.patch.dict(names, values):
            return core(*arguments, **options)

    return make


class Proof(PortsTop):
    """Top level around a core whose inputs are free; each condition becomes a port of the emitted Verilog.

    `assume`, `prove` and `reach` take a name and a condition, which holds while it is 1.
    """

    def __init__(self, core: LiteXModule) -> None:
        PortsTop.__init__(self, core)
        core.finalize()
        self.widths:    dict[str, int] = {}
        self.constants: dict[str, int] = {}
        self.wanted:    dict[str, dict[str, str]] = {"assume": {}, "assert": {}, "cover": {}}
        self.started = Signal()  # 0 in the first clock only.
        self.sync += self.started.eq(1)

    def free(self, *signals: Signal) -> None:
        """Let the solver choose the values of inputs, anew in each clock."""
        for signal in signals:
            name = f"free_{len(self.widths)}"
            self.widths[name] = len(signal)
            self.comb += signal.eq(self.port(name, len(signal)))

    def constant(self, bits: int) -> Signal:
        """Return a value that the solver chooses once."""
        name = f"constant_{len(self.constants)}"
        self.constants[name] = bits
        return self.port(name, bits)

    def past(self, signal: Signal) -> Signal:
        """Return the value of a clock ago."""
        before = Signal.like(signal)
        self.sync += before.eq(signal)
        return before

    def assume(self, name: str, condition) -> None:
        """Assume that the surroundings keep a condition."""
        self._want("assume", name, condition)

    def prove(self, name: str, condition) -> None:
        """Prove that the core keeps a condition."""
        self._want("assert", name, condition)

    def reach(self, name: str, condition) -> None:
        """Show that a condition can be met, so that the assumptions do not exclude everything."""
        self._want("cover", name, condition)

    def _want(self, kind: str, name: str, condition) -> None:
        port = f"{kind}_{len(self.wanted[kind])}"
        self.wanted[kind][port] = name
        self.comb += self.port(port, 1).eq(condition)

    def name_of(self, label: str) -> str:
        """Return the name of the condition that has a label in the emitted Verilog."""
        return self.wanted[label.split("_")[0]][label]

    def only(self, promise: str) -> Proof:
        """Leave out all promises but those that have `promise` in their names; return the proof."""
        kept = {port: name for port, name in self.wanted["assert"].items() if promise in name}
        if not kept:
            raise LookupError(f"the proof has no promise {promise!r}")
        self.wanted["assert"] = kept
        return self

    def core_verilog(self) -> str:
        """Return the Verilog of the core."""
        return str(verilog.convert(self, ios=self.ios, name="core"))

    def verilog(self) -> str:
        """Return the Verilog of the core, and around it a module `proof` that states the conditions."""
        core     = self.core_verilog()
        outputs  = [port for ports in self.wanted.values() for port in ports]
        lines    = ["module proof(", "    input wire sys_clk" + "".join(
                        f",\n    input wire [{bits - 1}:0] {name}" for name, bits in self.widths.items()), ");"]
        lines   += [f"    (* anyconst *) wire [{bits - 1}:0] {name};" for name, bits in self.constants.items()]
        lines   += [f"    wire {name};" for name in outputs]
        ports    = ["sys_clk", *self.widths, *self.constants, *outputs]
        lines   += ["    core core(.sys_rst(1'b0)" + "".join(f", .{name}({name})" for name in ports) + ");"]
        for kind, conditions in self.wanted.items():
            lines += [f"    always @* {port}_: {kind}({port});" for port in conditions]
        # Comments contain the date.
        return re.sub(r"^//.*$", "", core, flags=re.MULTILINE) + "\n".join([*lines, "endmodule", ""])
