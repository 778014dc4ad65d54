#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Small faults in the source of a core: in what describes its logic."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from .mutant import Mutant, Splicer

COMPARISONS = {ast.Eq: ast.NotEq, ast.NotEq: ast.Eq, ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt}
OPERATORS   = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd}

# Places where a number is a width or a depth, or limits a parameter: a bit more changes nothing there.
SIZES = {"Signal", "Memory", "SyncFIFO", "Endpoint", "check", "bits_for", "range", "log2_int", "WaitTimer", "max"}


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
        case ast.Call(func=ast.Attribute(value=target, attr="eq"), args=[ast.Name() | ast.Attribute()]):
            yield "stuck at 0", ast.Call(ast.Attribute(target, "eq"), [ast.Constant(0)], [])
        case ast.Call(func=ast.Attribute(attr="connect")):
            yield "not connected", ast.List([])


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


def mutants_of(file: str) -> list[Mutant]:
    """Return all mutants of a core, in the order of its source."""
    splicer = Splicer(file)
    result  = {}
    for node in hardware(ast.parse(splicer.source)):
        for kind, other in faults(node):
            begin = splicer.offset(node.lineno, node.col_offset)
            end   = splicer.offset(node.end_lineno, node.end_col_offset)
            after = ast.unparse(ast.fix_missing_locations(other))
            result[begin, end, kind] = splicer.mutant(kind, begin, end, after, grouped=True)
    return [result[key] for key in sorted(result)]
