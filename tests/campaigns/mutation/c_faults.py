#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Small faults in the bodies of C functions, made of the source's tokens."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from .mutant import Mutant, Splicer

TOKEN = re.compile(r"""
    (?P<blank>\s+ | //[^\n]* | /\*.*?\*/ | ^\#(?:[^\n\\]|\\.)* )
  | (?P<text>"(?:\\.|[^"\\])*" | '(?:\\.|[^'\\])*')
  | (?P<number>0[xX][0-9a-fA-F]+[uUlL]* | \d+[uUlL]*)
  | (?P<word>\w+)
  | (?P<sign><<= | >>= | \.\.\. | -> | \+\+ | -- | << | >> | <= | >= | == | != | && | \|\| | [-+*/%&|^]= | .)
""", re.DOTALL | re.MULTILINE | re.VERBOSE)

#: Operators between two operands, each with what a slip makes of it.
SWAPS = {
    "==": "!=", "!=": "==", "<": "<=", "<=": "<", ">": ">=", ">=": ">", "&&": "||", "||": "&&",
    "+": "-", "-": "+", "*": "/", "/": "*", "%": "/", "&": "|", "|": "&", "^": "|", "<<": ">>", ">>": "<<",
    "+=": "-=", "-=": "+=", "|=": "&=", "&=": "|=", "^=": "|=", "<<=": ">>=", ">>=": "<<=",
}
KINDS = {"==": "comparison", "!=": "comparison", "<": "comparison", "<=": "comparison", ">": "comparison",
         ">=": "comparison", "&&": "and or or", "||": "and or or"}

#: Words that may be before an operand, as an operator is.
KEYWORDS = {"return", "case", "if", "while", "else", "do", "for", "switch", "break", "continue", "goto", "sizeof",
            "static", "const", "struct", "union", "enum", "default"}
TYPES    = {"bool", "char", "int", "long", "unsigned", "signed", "short", "size_t", "void", "float", "double"}


@dataclass(frozen=True)
class Token:
    """A token of C."""
    kind:  str
    text:  str
    begin: int
    end:   int


def tokens(source: str) -> list[Token]:
    """Return the tokens of a source, without blanks, comments and preprocessor lines."""
    found = ((match.lastgroup, match) for match in TOKEN.finditer(source))
    return [Token(kind, match[0], match.start(), match.end()) for kind, match in found if kind != "blank"]


def bodies(source: list[Token]) -> Iterator[tuple[int, int]]:
    """Yield the places of the functions' bodies: first token after `{`, and its `}`."""
    depth = 0
    begin = None
    for place, token in enumerate(source):
        if token.text == "{":
            if depth == 0 and source[place - 1].text == ")":
                begin = place + 1
            depth += 1
        elif token.text == "}":
            depth -= 1
            if depth == 0 and begin is not None:
                yield begin, place
                begin = None


def _is_type(word: str) -> bool:
    return word in TYPES or word.endswith("_t")


def _is_operand(token: Token) -> bool:
    return token.text in (")", "]") or token.kind in ("number", "text") or (
        token.kind == "word" and token.text not in KEYWORDS and not _is_type(token.text))


def _is_length(body: list[Token], place: int) -> bool:
    # `uint8_t bytes[16]`, `char *texts[2]`: with more of them nothing changes.
    if place < 3 or body[place - 1].text != "[" or body[place - 2].kind != "word":
        return False
    before = place - 3
    while before > 0 and body[before].text in ("*", "const"):
        before -= 1
    return body[before].kind == "word" and body[before].text not in KEYWORDS and (
        before == place - 3 or _is_type(body[before].text))


def _after_cast(body: list[Token], place: int) -> bool:
    # `(uint8_t) *text`, `(char *) &word`: what is before the operator is no operand.
    if body[place - 1].text != ")":
        return False
    inner = place - 2
    while inner >= 0 and body[inner].text in ("*", "const"):
        inner -= 1
    return inner >= 0 and _is_type(body[inner].text)


def _statements(body: list[Token]) -> Iterator[tuple[int, int]]:
    """Yield the places of calls and assignments that are statements: first token, and `;`."""
    parentheses = 0
    for place, token in enumerate(body):
        parentheses += (token.text == "(") - (token.text == ")")
        begins = place == 0 or body[place - 1].text in (";", "{", "}", "else") or (
            body[place - 1].text == ")" and _closes_condition(body, place - 1)) or (
            body[place - 1].text == ":" and _ends_label(body, place - 1))
        if parentheses or not begins or not (token.kind == "word" or token.text in ("*", "++", "--")):
            continue
        if token.text in KEYWORDS or _is_type(token.text) or token.text == "void":
            continue
        following = body[place + 1] if place + 1 < len(body) else None
        if following is None or (token.kind == "word" and following.kind == "word") or following.text == ":":
            continue
        end = next((n for n in range(place, len(body)) if body[n].text in (";", "{")), None)
        if end is not None and body[end].text == ";":
            yield place, end


def _ends_label(body: list[Token], place: int) -> bool:
    for n in range(place - 1, -1, -1):
        if body[n].text in ("case", "default"):
            return True
        if body[n].text in (";", "{", "}", "?"):
            return False
    return False


def _closes_condition(body: list[Token], place: int) -> bool:
    depth = 0
    for n in range(place, -1, -1):
        depth += (body[n].text == ")") - (body[n].text == "(")
        if depth == 0:
            return n > 0 and body[n - 1].text in ("if", "while", "for")
    return False


def _faults(body: list[Token]) -> Iterator[tuple[str, int, int, str]]:
    """Yield the faults of a body: kind, place of the first and the last token, replacement."""
    for place, token in enumerate(body):
        before = body[place - 1] if place else None
        binary = before is not None and _is_operand(before) and not _after_cast(body, place)
        # A declaration of a pointer or of an array is no expression.
        if token.text == "*" and before is not None and _is_type(before.text):
            continue
        if token.text in SWAPS and (binary or token.text.endswith("=")):
            yield KINDS.get(token.text, "operator"), place, place, SWAPS[token.text]
        elif token.text in ("++", "--"):
            yield "operator", place, place, "--" if token.text == "++" else "++"
        elif token.text in ("!", "~") or (token.text == "-" and not binary):
            yield "sign", place, place, ""
        elif token.kind == "number" and not _is_length(body, place):
            digits = token.text.rstrip("uUlL")
            value  = int(digits, 16 if digits.lower().startswith("0x") else 10)
            yield "off by one", place, place, f"{value + 1}{token.text[len(digits):]}"
        elif token.text in ("true", "false"):
            yield "truth", place, place, "false" if token.text == "true" else "true"
        elif token.text in ("break", "continue") and body[place + 1].text == ";":
            yield "statement left out", place, place, ""
    for first, last in _statements(body):
        yield "statement left out", first, last, ";"


def mutants_of(file: str) -> list[Mutant]:
    """Return all mutants of a C file, in the order of its source."""
    splicer = Splicer(file)
    source  = tokens(splicer.source)
    result  = {}
    for begin, end in bodies(source):
        body = source[begin:end]
        for kind, first, last, after in _faults(body):
            places = body[first].begin, body[last].end
            result[(*places, kind)] = splicer.mutant(kind, *places, after)
    return [result[key] for key in sorted(result)]
