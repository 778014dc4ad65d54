#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Small faults in Python: what the host tools compute and decide, not their texts."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from .mutant import Mutant, Splicer

COMPARISONS = {
    ast.Eq: ast.NotEq, ast.NotEq: ast.Eq, ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt,
    ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In,
}
OPERATORS = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.FloorDiv, ast.FloorDiv: ast.Mult, ast.Div: ast.Mult,
    ast.Mod: ast.FloorDiv, ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd, ast.LShift: ast.RShift, ast.RShift: ast.LShift,
}

#: Calls whose arguments nothing depends on: names, documents and declarations.
DECLARATIONS = {"TypeVar", "NewType", "namedtuple", "cast"}


def faults(node: ast.AST) -> Iterator[tuple[str, ast.AST]]:
    """Yield the kinds of faults that are possible at this node, with the node that replaces it."""
    match node:
        case ast.Compare(left=left, ops=operators, comparators=others):
            for place, operator in enumerate(operators):
                if type(operator) in COMPARISONS:
                    changed = [*operators[:place], COMPARISONS[type(operator)](), *operators[place + 1:]]
                    yield f"comparison {place + 1}", ast.Compare(left, changed, others)
        case ast.BinOp(left=left, op=operator, right=right) if type(operator) in OPERATORS:
            yield "operator", ast.BinOp(left, OPERATORS[type(operator)](), right)
        case ast.BoolOp(op=operator, values=values):
            yield "and or or", ast.BoolOp(ast.Or() if isinstance(operator, ast.And) else ast.And(), values)
        case ast.UnaryOp(op=ast.Not() | ast.USub() | ast.Invert(), operand=operand):
            yield "sign", operand
        case ast.Constant(value=bool() as value):
            yield "truth", ast.Constant(not value)
        case ast.Constant(value=int() as value):
            yield "off by one", ast.Constant(value + 1)
        case ast.Constant(value=float() as value):
            yield "another number", ast.Constant(value*2 + 1)
        case ast.Call(func=ast.Name("min"), args=args, keywords=keywords):
            yield "extreme", ast.Call(ast.Name("max"), args, keywords)
        case ast.Call(func=ast.Name("max"), args=args, keywords=keywords):
            yield "extreme", ast.Call(ast.Name("min"), args, keywords)
        case ast.Return(value=ast.AST() as value) if not isinstance(value, ast.Constant):
            yield "nothing returned", ast.Return(ast.Constant(None))
        case ast.Expr(value=ast.Call()) | ast.AugAssign() | ast.Raise() | ast.Continue() | ast.Break():
            yield "statement left out", ast.Pass()
        case ast.If(test=test) | ast.IfExp(test=test) if isinstance(test, (ast.Name, ast.Attribute, ast.Call)):
            # Place and length are those of the condition.
            yield "condition", ast.copy_location(ast.UnaryOp(ast.Not(), test), test)


def code(node: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes below this one that run: no annotations, decorators, docstrings or texts of errors."""
    match node:
        case ast.Expr(value=ast.Constant()) | ast.JoinedStr() | ast.Import() | ast.ImportFrom():
            return
        case ast.If(test=ast.Name("TYPE_CHECKING")):
            return
        case ast.Call(func=ast.Name(name)) if name in DECLARATIONS:
            return
    yield node
    for name, value in ast.iter_fields(node):
        if name in ("annotation", "returns", "decorator_list", "bases"):
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST):
                yield from code(child)


def mutants_of(file: str) -> list[Mutant]:
    """Return all mutants of a Python file, in the order of its source."""
    splicer = Splicer(file)
    result  = {}
    for node in code(ast.parse(splicer.source)):
        for kind, other in faults(node):
            place = other.operand if kind == "condition" else node
            begin = splicer.offset(place.lineno, place.col_offset)
            end   = splicer.offset(place.end_lineno, place.end_col_offset)
            after = ast.unparse(ast.fix_missing_locations(other))
            result[begin, end, kind] = splicer.mutant(kind, begin, end, after, grouped=not isinstance(other, ast.stmt))
    return [result[key] for key in sorted(result)]
