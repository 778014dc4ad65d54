#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Counts operators, registers and memories of a core that migen has elaborated."""

from __future__ import annotations

from dataclasses import dataclass

from litex.gen import LiteXModule
from migen import Memory
from migen.fhdl.structure import Constant
from migen.fhdl.tools import list_targets
from migen.fhdl.visit import NodeVisitor


class _Operators(NodeVisitor):
    """Counts operators, except those with a constant, which belong to addresses and counters."""
    def __init__(self) -> None:
        self.counts: dict[str, int] = {}

    def visit_Operator(self, node) -> None:
        if not any(isinstance(operand, Constant) for operand in node.operands):
            self.counts[node.op] = self.counts.get(node.op, 0) + 1
        NodeVisitor.visit_Operator(self, node)


@dataclass(frozen=True)
class Contents:
    """Contents of a core with all its submodules.

    Parameters
    ----------
    operators
        Number of uses of each operator, by migen's name, without those with a constant operand.
    register_bits
        Bits of all registers.
    memories
        Width in bits and depth in words of each memory, by its name.
    """
    operators:     dict[str, int]
    register_bits: int
    memories:      dict[str, tuple[int, int]]

    def count(self, *operators: str) -> int:
        """Return the number of uses of these operators."""
        return sum(self.operators.get(operator, 0) for operator in operators)

    def memory_bits(self, name: str) -> int:
        """Return the size of a memory in bits."""
        width, depth = self.memories[name]
        return width*depth


def contents(core: LiteXModule) -> Contents:
    """Elaborate a core, if it is not yet, and count its contents."""
    fragment = core.get_fragment()
    visitor  = _Operators()
    visitor.visit(fragment)
    memories: dict[str, tuple[int, int]] = {}
    for memory in fragment.specials:
        if isinstance(memory, Memory):
            # Memories of the same name are side by side: their widths add up.
            width, depth = memories.get(memory.name_override, (0, memory.depth))
            memories[memory.name_override] = (width + memory.width, depth)
    return Contents(visitor.counts, sum(len(signal) for signal in list_targets(fragment.sync)), memories)
