#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Small faults in the source of a core, as a slip of the author could make them."""

from __future__ import annotations

import ast
import random
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

COMPARISONS = {ast.Eq: ast.NotEq, ast.NotEq: ast.Eq, ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt}
OPERATORS   = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd}

# Places where a number is a width or a depth, or limits a parameter: a bit more changes nothing there.
SIZES = {"Signal", "Memory", "SyncFIFO", "Endpoint", "check", "bits_for", "range", "log2_int", "WaitTimer", "max"}


@dataclass(frozen=True)
class Mutant:
    """A core with one fault."""
    core:   str  #: module of the gateware
    line:   int  #: line of its source
    kind:   str  #: kind of the fault
    before: str
    after:  str
    code:   str  #: first source line of the fault, unchanged
    source: str  #: source of the whole module, with the fault

    @property
    def name(self) -> str:
        """Return place and kind of the fault, in a line."""
        return f"{self.core}.py:{self.line} {self.kind}: {self.before} -> {self.after}"


def faults(node: ast.AST) -> Iterator[tuple[str, ast.AST]]:
    """Yield the kinds of faults that are possible at this node, with the node that replaces it."""
    match node:
        case ast.Compare(left=left, ops=[operator], comparators=[right]) if type(operator) in COMPARISONS:
            yield "comparison", ast.Compare(left, [COMPARISONS[type(operator)]()], [right])
        case ast.BinOp(left=left, op=operator, right=right) if type(operator) in OPERATORS:
            yield "operator", ast.BinOp(left, OPERATORS[type(operator)](), right)
        case ast.UnaryOp(op=ast.Invert(), operand=operand):
            yield "sign", operand
        case ast.Constant(value=int() as value) if not isinstance(value, bool):
            yield "off by one", ast.Constant(value + 1)
        case ast.Call(func=ast.Name("Mux"), args=[choice, first, second]):
            yield "swapped operands", ast.Call(ast.Name("Mux"), [choice, second, first], [])
        case ast.Call(func=ast.Name("delayed"), args=[module, signal, ast.Constant(value=int() as clocks)]) if clocks:
            yield "missing register", ast.Call(ast.Name("delayed"), [module, signal, ast.Constant(clocks - 1)], [])
        case ast.Attribute(value=module, attr="sync"):
            yield "missing register", ast.Attribute(module, "comb")
        case ast.Call(func=ast.Attribute(value=target, attr="eq"), args=[ast.Name()]):
            yield "stuck at 0", ast.Call(ast.Attribute(target, "eq"), [ast.Constant(0)], [])


def hardware(tree: ast.Module) -> Iterator[ast.AST]:
    """Yield the nodes of a module that describe logic: statements of `comb`, `sync` or a state, and delays."""
    def walk(node: ast.AST) -> Iterator[ast.AST]:
        if isinstance(node, ast.Call):
            called = node.func.id if isinstance(node.func, ast.Name) else getattr(node.func, "attr", "")
            if called in SIZES:
                return
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            return
        yield node
        # Indices of bits and of lanes are wiring.
        children = [node.value] if isinstance(node, ast.Subscript) else ast.iter_child_nodes(node)
        for child in children:
            yield from walk(child)

    for function in ast.walk(tree):
        if isinstance(function, ast.FunctionDef):
            for statement in function.body:
                for part in ast.walk(statement):
                    match part:
                        case ast.AugAssign(target=ast.Attribute(attr="comb" | "sync") as target, value=value):
                            yield target
                            yield from walk(value)
                        case ast.Call(func=ast.Attribute(attr="act"), args=[_, *values]):
                            for value in values:
                                yield from walk(value)


def mutants_of(path: Path) -> list[Mutant]:
    """Return all mutants of a core, in the order of its source."""
    source = path.read_text()
    lines  = source.splitlines(keepends=True)
    starts = [0]
    for line in lines:
        starts.append(starts[-1] + len(line.encode()))
    data   = source.encode()
    result = {}
    for node in hardware(ast.parse(source)):
        for kind, other in faults(node):
            begin  = starts[node.lineno - 1] + node.col_offset
            end    = starts[node.end_lineno - 1] + node.end_col_offset
            before = ast.get_source_segment(source, node)
            after  = ast.unparse(ast.fix_missing_locations(other))
            # Parentheses keep the precedence of what is around it.
            text   = data[:begin] + f"({after})".encode() + data[end:]
            code   = lines[node.lineno - 1].strip()
            short  = [" ".join(part.split()) for part in (before, after)]
            result[begin, end, kind] = Mutant(path.stem, node.lineno, kind, *short, code, text.decode())
    return [result[key] for key in sorted(result)]


def source_of(folder: Path, core: str) -> Path:
    """Return the file of a core, whose name is unique in the folders of the gateware."""
    (path,) = folder.rglob(f"{core}.py")
    return path


def drawn(folder: Path, cores: list[str], count: int, seed: int) -> list[Mutant]:
    """Draw `count` different mutants of these cores, spread evenly over them; the seed decides."""
    rng   = random.Random(seed)
    pools = {core: mutants_of(source_of(folder, core)) for core in cores}
    for pool in pools.values():
        rng.shuffle(pool)
    result = []
    while len(result) < count and any(pools.values()):
        for core in rng.sample(cores, len(cores)):
            if pools[core] and len(result) < count:
                result.append(pools[core].pop())
    return result
