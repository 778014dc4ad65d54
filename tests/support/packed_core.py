#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""A core pin by pin, whose inputs and outputs are moved all at once: for tests of many clocks."""

from __future__ import annotations

from collections.abc import Mapping

from litex.gen import LiteXModule
from migen import Cat, Signal

from litestereo.sim.cores.pin_core import PinCore


class PackedCore:
    """A core in Verilator.

    Parameters
    ----------
    core
        Any module.
    inputs, outputs
        Signals of the core to drive and to read, by name.
    """
    def __init__(self, core: LiteXModule, inputs: Mapping[str, Signal], outputs: Mapping[str, Signal]) -> None:
        self._core    = PinCore(core, {"inputs": Cat(*inputs.values())}, {"outputs": Cat(*outputs.values())})
        self._inputs  = self._places(inputs)
        self._outputs = self._places(outputs)
        self._word    = 0
        #: Clock and reset.
        self.clock, self.reset, self.close = self._core.clock, self._core.reset, self._core.close

    @staticmethod
    def _places(signals: Mapping[str, Signal]) -> dict[str, tuple[int, int]]:
        result, start = {}, 0
        for name, signal in signals.items():
            result[name] = (start, (1 << len(signal)) - 1)
            start       += len(signal)
        return result

    def set(self, **values: int) -> None:
        """Drive inputs, by name; they take effect at once."""
        for name, value in values.items():
            start, mask = self._inputs[name]
            self._word  = self._word & ~(mask << start) | (int(value) & mask) << start
        self._core.set(inputs=self._word)

    def input(self, name: str) -> int:
        """Return what drives an input."""
        start, mask = self._inputs[name]
        return self._word >> start & mask

    def get(self) -> dict[str, int]:
        """Return all outputs, by name."""
        word = self._core.get("outputs")
        return {name: word >> start & mask for name, (start, mask) in self._outputs.items()}
