#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""House rules that a program can judge, each on the source of one file.

A rule takes the source and returns what breaks it, as (line, what is wrong). `RULES` are those of gateware and SoC,
`banned_words` is for all files.
"""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections.abc import Callable, Iterable, Iterator
from pathlib import PurePath

Problems = list[tuple[int, str]]
Rule     = Callable[[str], Problems]

LONGEST_LINE        = 120
LONGEST_CONSTRUCTOR = 60

#: Where the ports of a core end and its hardware begins, as in LiteX.
PORTS_END = "# # #"

#: Words and turns that a native reader stumbles over, with what to write instead.
BANNED = {
    r"nobody|somebody":           "say who: the host, the device, the caller",
    r"whatever":                  "any, or say what",
    r"besides":                   "also, or apart from",
    r"likewise":                  "also, or say it again",
    r"of (?:its|their) own":      "own, separate",
    r"stands? (?:for|in|on)":     "is, means",
    r"takes? in":                 "handle, accept",
    r"in line":                   "queued",
    r"is through":                "finished",
    r"befalls?":                  "happens to",
}


def line_length(source: str) -> Problems:
    """Refuse lines that are too long."""
    return [(number, f"{len(line)} columns, at most {LONGEST_LINE}")
            for number, line in enumerate(source.splitlines(), 1) if len(line) > LONGEST_LINE]


def docstrings(source: str) -> Problems:
    """Refuse a module that neither has a docstring itself nor has one in each of its classes, or else functions."""
    tree = ast.parse(source)
    if ast.get_docstring(tree):
        return []
    classes   = [node for node in tree.body if isinstance(node, ast.ClassDef)]
    functions = [node for node in tree.body if isinstance(node, ast.FunctionDef)]
    if not classes and not functions:
        return [(1, "no docstring")]
    return [(node.lineno, f"{node.name} has no docstring, nor has the module") for node in classes or functions
            if not ast.get_docstring(node)]


def port_comments(source: str) -> Problems:
    """Refuse Signals and endpoints of a constructor, in front of its hardware, without a comment.

    It is on the first or on the last line of the statement, or directly above.
    """
    lines, comments = source.splitlines(), dict(_comments(source))
    result          = []
    for _, constructor in _constructors(ast.parse(source)):
        end = next((number for number, text in comments.items()
                    if constructor.lineno < number <= constructor.end_lineno and text == PORTS_END), None)
        for statement in constructor.body:
            if end is None or statement.lineno > end:
                break
            if not isinstance(statement, ast.Assign) or not _calls(statement.value) & {"Signal", "Endpoint"}:
                continue
            names = [target.attr for target in statement.targets if _of_self(target)]
            above = statement.lineno - 1 in comments and lines[statement.lineno - 2].lstrip().startswith("#")
            if names and not above and not {statement.lineno, statement.end_lineno} & set(comments):
                result.append((statement.lineno, f"port {names[0]} has no comment"))
    return result


def latency(source: str) -> Problems:
    """Refuse a core with a sink and a source that does not say how many clocks are between them, or None."""
    result = []
    for core, constructor in _constructors(ast.parse(source)):
        endpoints = {target.attr for node in ast.walk(constructor) if isinstance(node, ast.Assign)
                     if "Endpoint" in _calls(node.value) for target in node.targets if _of_self(target)}
        if {"sink", "source"} <= endpoints and "latency" not in _attributes_set(core):
            result.append((core.lineno, f"{core.name} has a sink and a source, but no latency"))
    return result


def reset(source: str) -> Problems:
    """Refuse a core with registers that has no reset, nor says in its docstring what a reset does."""
    result = []
    for core, _ in _constructors(ast.parse(source)):
        state = _attributes_set(core) & {"sync"} or _calls(core) & {"FSM", "NextValue"}
        if "LiteXModule" not in [ast.unparse(base) for base in core.bases] or not state:
            continue
        inserted = any("ResetInserter" in ast.unparse(decorator) for decorator in core.decorator_list)
        if not inserted and "reset" not in (ast.get_docstring(core) or "").lower():
            result.append((core.lineno, f"{core.name} has registers: no ResetInserter, no `reset` in its docstring"))
    return result


def constructor_length(source: str) -> Problems:
    """Refuse constructors that are more than a list of contents."""
    return [(constructor.lineno, f"the constructor of {core.name} has {length} lines, at most {LONGEST_CONSTRUCTOR}")
            for core, constructor in _constructors(ast.parse(source))
            if (length := constructor.end_lineno - constructor.lineno + 1) > LONGEST_CONSTRUCTOR]


def words(source: str) -> Problems:
    """Refuse banned words and turns in comments, strings and names."""
    return _banned(_texts(source))


def banned_words(name: str, source: str) -> Problems:
    """Refuse banned words and turns in a file of any kind, which its name tells.

    Python, C and C++: comments, strings and names. Markdown: all but fences and code marks. Others: all.
    """
    suffix = PurePath(name).suffix
    if suffix == ".py":
        return _banned(_texts(source))
    if suffix in (".c", ".h", ".cpp"):
        return _banned(_c_texts(source))
    if suffix == ".md":
        return _banned([(1, _without_code(source))])
    return _banned([(1, re.sub(r"(?m)^[ \t]*#+", "", source))])


def import_order(source: str) -> Problems:
    """Refuse imports out of order: groups by origin, and the lines of a group in the order of their modules.

    The groups are `__future__`, other packages, migen with litex and its relatives, this project.
    """
    result, before = [], None
    for node in ast.parse(source).body:
        if not isinstance(node, ast.Import | ast.ImportFrom):
            continue
        key = _import_key(node)
        if before is not None and key < before:
            result.append((node.lineno, f"`{ast.unparse(node)}` belongs further up"))
        before = key
    return result


RULES: dict[str, Rule] = {rule.__name__: rule for rule in (
    line_length, docstrings, port_comments, latency, reset, constructor_length, words, import_order)}


# Reading ----------------------------------------------------------------------------------------------

def _import_key(node: ast.Import | ast.ImportFrom) -> tuple:
    if isinstance(node, ast.Import):
        name, level = node.names[0].name, 0
    else:
        name, level = node.module or "", node.level
    root  = name.split(".")[0]
    # Modules that are imported whole come first, as isort has it; the dots of a relative import count from the far end.
    if level:
        return 3, -level, name
    if root == "__future__":
        return 0, 0, name
    # Star imports come in the order in which LiteX has them.
    if root == "migen" or root.startswith("lite"):
        return 2, 0, ""
    return 1, isinstance(node, ast.ImportFrom), name


def _constructors(tree: ast.Module) -> Iterator[tuple[ast.ClassDef, ast.FunctionDef]]:
    for core in ast.walk(tree):
        if isinstance(core, ast.ClassDef):
            for node in core.body:
                if isinstance(node, ast.FunctionDef) and node.name == "__init__":
                    yield core, node


def _of_self(target: ast.AST) -> bool:
    return isinstance(target, ast.Attribute) and isinstance(target.value, ast.Name) and target.value.id == "self"


def _attributes_set(core: ast.ClassDef) -> set[str]:
    targets = [target for node in ast.walk(core) for target in
               getattr(node, "targets", [getattr(node, "target", None)]) if target is not None]
    return {part.attr for target in targets for part in ast.walk(target) if _of_self(part)}


def _calls(node: ast.AST) -> set[str]:
    functions = [part.func for part in ast.walk(node) if isinstance(part, ast.Call)]
    return {function.id if isinstance(function, ast.Name) else getattr(function, "attr", "") for function in functions}


def _comments(source: str) -> Iterator[tuple[int, str]]:
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            yield token.start[0], token.string


def _texts(source: str) -> Iterator[tuple[int, str]]:
    """Yield comments, one for each block of them; strings; names, with spaces between their words."""
    block: list[str] = []
    start = 0
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            if block and token.start[0] != start + len(block):
                yield start, "\n".join(block)
                block = []
            start = start if block else token.start[0]
            block.append(token.string.lstrip("# "))
        elif token.type == tokenize.STRING or token.type in _PARTS:
            yield token.start[0], token.string
        elif token.type == tokenize.NAME:
            yield token.start[0], re.sub(r"(?<=[a-z0-9])(?=[A-Z])", " ", token.string).replace("_", " ")
    if block:
        yield start, "\n".join(block)


def _banned(texts: Iterable[tuple[int, str]]) -> Problems:
    result = []
    for number, text in texts:
        if not _ANY_BANNED.search(text):
            continue
        for pattern, instead in BANNED.items():
            for found in _whole_words(pattern).finditer(text):
                line = number + text[:found.start()].count("\n")
                result.append((line, f"`{found.group(0)}`: {instead}"))
    return result


def _whole_words(pattern: str) -> re.Pattern[str]:
    return re.compile(rf"\b(?:{pattern})\b".replace(" ", r"\s+"), re.IGNORECASE)


_ANY_BANNED = _whole_words("|".join(BANNED))


def _c_texts(source: str) -> Iterator[tuple[int, str]]:
    """Yield comments, one for each block of them; strings; names, with spaces between their words."""
    for found in re.finditer(_C_TOKEN, source):
        text = found.group(0)
        if text.startswith("/"):
            text = re.sub(r"(?m)^[ \t]*(?:\*|//)", "", text)
        elif not text.startswith('"'):
            text = text.replace("_", " ")
        yield source.count("\n", 0, found.start()) + 1, text


def _without_code(page: str) -> str:
    """Return a page without fences and code marks, its lines in their places."""
    def blank(found: re.Match[str]) -> str:
        return "`" + "\n"*found.group(0).count("\n")

    page = re.sub(r"(?ms)^[ \t]*```.*?^[ \t]*```", blank, page)
    return re.sub(r"(?s)(`+)(?!`)(?:(?!\n\n).)+?(?<!`)\1(?!`)", blank, page)


#: Comments, strings, characters, and names.
_C_TOKEN = re.compile(r"""
    /\*.*?\*/ | //[^\n]*(?:\n[ \t]*//[^\n]*)*
    | "(?:\\.|[^"\\\n])*" | '(?:\\.|[^'\\\n])+'
    | \b[A-Za-z_]\w*
""", re.DOTALL | re.VERBOSE)

#: From Python 3.12 on, the text of an f-string is a token.
_PARTS = {getattr(tokenize, "FSTRING_MIDDLE", -1)}
