#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What the documents name exists: files, headings, make targets and variables, modules, `litestereo` commands."""

from __future__ import annotations

import argparse
import importlib.util
import re
import shlex
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import pytest
from test_rooms import ROOMS

from litestereo.host_tools import cli
from litestereo.soc.boards import BOARDS
from support.paths import CHECKOUT

#: Folders that are not part of the repository.
GENERATED = {".git", ".venv", "build", "dist", "node_modules"}

#: Folders at the top: a name in code marks that begins with one of them is a file.
FOLDERS = {".ci", "docs", "firmware", "gateware", "host_tools", "sim", "soc", "tests"}

#: Endings of names that are files, if a folder precedes them.
SUFFIXES = (".py", ".c", ".h", ".cpp", ".md", ".toml", ".txt", ".ld")

#: Folders that a path may be relative to: pages of the firmware name `app/main.c`.
ROOTS = ("", "docs", "firmware", "firmware/include", "tests/gateware")

#: Words that name no file: `FILE`, `<key>`, `*.py`, `...`.
PLACEHOLDER = re.compile(r"[<>*{}]|\.\.\.|\bBOARD\b")

#: Folders whose rooms are below them, or in C.
NO_ROOMS = {"firmware", "gateware", "soc"}

#: Pages about the state of an earlier commit, whose names may be gone: only their links are checked.
HISTORY = {"CHANGELOG.md", "docs/coverage.md"}


def pages() -> list[str]:
    """Return the documents of the checkout, relative to it."""
    found = (path.relative_to(CHECKOUT) for path in CHECKOUT.rglob("*.md"))
    return sorted(str(path) for path in found if not GENERATED & set(path.parts) and path.parts[0][0] != ".")


def text_of(page: str) -> str:
    """Return a page."""
    return (CHECKOUT / page).read_text(encoding="utf-8")


# Markdown -----------------------------------------------------------------------------------------

def without_code(text: str) -> str:
    """Return prose: without fences, indented blocks and code marks."""
    text = re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL)
    text = re.sub(r"(?m)^ {4}.*$", "", text)
    return re.sub(r"(`+).+?\1", "", text)


def code_of(text: str) -> Iterator[str]:
    """Yield everything in code marks, and each line of fences and indented blocks."""
    for block in re.findall(r"^```\w*\n(.*?)^```", text, flags=re.MULTILINE | re.DOTALL):
        yield from block.splitlines()
    text = re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL)
    yield from re.findall(r"(?m)^ {4}(.*)$", text)
    yield from (" ".join(mark.split()) for _, mark in re.findall(r"(`+)(.+?)\1", text, flags=re.DOTALL))


def anchors(text: str) -> set[str]:
    """Return the anchors of a page's headings, as GitHub makes them."""
    found: dict[str, int] = {}
    result = set()
    for heading in re.findall(r"(?m)^#+ +(.+?)\s*$", re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL)):
        plain  = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "")
        anchor = re.sub(r"[^\w\- ]", "", plain.lower()).replace(" ", "-")
        count  = found.get(anchor, 0)
        found[anchor] = count + 1
        result.add(f"{anchor}-{count}" if count else anchor)
    return result


# Complaints ---------------------------------------------------------------------------------------

def bad_links(page: str, text: str) -> Iterator[str]:
    """Yield links whose file or anchor does not exist."""
    for target in re.findall(r"\]\(([^)\s]+)\)", re.sub(r"`[^`]*`", "", text)):
        if re.match(r"[a-z]+:", target):
            continue
        name, _, anchor = target.partition("#")
        path = (CHECKOUT / page).parent / name if name else CHECKOUT / page
        if not path.exists():
            yield f"{target}: no such file"
        elif anchor and anchor not in anchors(text if not name else path.read_text(encoding="utf-8")):
            yield f"{target}: no such heading"


def bad_paths(page: str, text: str) -> Iterator[str]:
    """Yield names in code marks and blocks that look like files of the repository, and are none."""
    for code in code_of(text):
        for word in re.findall(r"(?<![\w./:\-{$])[.\w][\w./-]*/[\w./-]*", code):
            name = word.rstrip(".")
            if PLACEHOLDER.search(code) or not is_ours(name):
                continue
            if not any((CHECKOUT / root / name).exists() for root in ROOTS):
                yield f"{name}: no such file or folder"


def is_ours(name: str) -> bool:
    """Return whether a name is meant as a file or folder of the repository."""
    first = name.split("/")[0]
    return first in FOLDERS or (name.endswith(SUFFIXES) and first not in GENERATED | {"..", "", "out", "found"}
                                and "." not in first and "generated" not in name)


@dataclass(frozen=True)
class Target:
    """A target of the Makefile, and the variables that its help names."""
    name:      str
    variables: frozenset[str]


def make_targets() -> dict[str, Target]:
    """Return the targets of the Makefile by their names."""
    found = {}
    for name, rest in re.findall(r"(?m)^([a-z-]+):.*?## (.*)$", (CHECKOUT / "Makefile").read_text()):
        taken = re.search(r"\[([A-Z_ ]+)\]$", rest)
        found[name] = Target(name, frozenset(taken[1].split() if taken else ()))
    return found


def bad_make(page: str, text: str) -> Iterator[str]:
    """Yield `make` commands with a target or a variable that the Makefile does not have."""
    targets = make_targets()
    for code in code_of(text):
        for command in re.findall(r"(?:^|[\s(])make((?: +[\w./=\"-]+)+)", re.sub(r"\s#.*", "", code)):
            words = [word for word in command.split() if not PLACEHOLDER.search(word.partition("=")[2])]
            if not words or words[0].startswith("-"):
                continue
            name = words[0].rstrip(",.:")
            if name not in targets:
                yield f"make {name}: no such target"
                continue
            for word in words[1:]:
                variable, equals, value = word.partition("=")
                if equals and variable not in targets[name].variables:
                    yield f"make {name} {word}: no such variable"
                if variable in ("BOARD", "BOARDS") and value and value not in BOARDS:
                    yield f"make {name} {word}: no such board"


def bad_modules(page: str, text: str) -> Iterator[str]:
    """Yield `python -m` with a module of this project that does not exist."""
    for code in code_of(text):
        for name in re.findall(r"-m ((?:litestereo|campaigns|formal)[\w.]*)", code):
            if find_module(name) is None:
                yield f"python -m {name}: no such module"
        for name in re.findall(r"(?:from|import) (litestereo\.[\w.]+)", code):
            if find_module(name) is None:
                yield f"import {name}: no such module"


def find_module(name: str) -> object | None:
    """Return the specification of a module, or None."""
    try:
        return importlib.util.find_spec(name)
    except ModuleNotFoundError:
        return None


def subcommands(parser: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    """Return the parsers of the commands below a parser."""
    (action,) = (action for action in parser._actions if isinstance(action, argparse._SubParsersAction))
    return dict(action.choices)


def bad_commands(page: str, text: str) -> Iterator[str]:
    """Yield `litestereo` command lines with a command or an option that the parser does not know."""
    commands = subcommands(cli._parser())
    for code in code_of(text):
        found = re.match(r"(?:\.venv/bin/)?litestereo +(.*)", code.strip())
        if not found:
            continue
        words = shlex.split(re.sub(r"\s#.*", "", found[1]).replace("...", "").split(" >")[0])
        if not words or words[0] in ("-h", "--help", "--version"):
            continue
        if words[0] not in commands:
            yield f"litestereo {words[0]}: no such command"
            continue
        known = {option for action in commands[words[0]]._actions for option in action.option_strings}
        yield from (f"litestereo {words[0]} {word}: no such option" for word in words[1:]
                    if re.match(r"--?[a-z]", word) and word.partition("=")[0] not in known)


def bad_options(page: str, text: str) -> Iterator[str]:
    """Yield options alone in code marks that no program of ours has."""
    known = program_options()
    for mark in re.findall(r"`(--[a-z][\w-]*)[^`]*`", text):
        if mark not in known:
            yield f"{mark}: no program has this option"


def program_options() -> set[str]:
    """Return the options of the command, and those that other programs of the repository add to their parsers."""
    known = {"--help", "--version"}
    for command in subcommands(cli._parser()).values():
        known |= {option for action in command._actions for option in action.option_strings}
    for folder in ("sim", "soc", "tests/campaigns", "tests/formal"):
        for path in (CHECKOUT / folder).rglob("*.py"):
            known |= set(re.findall(r"\"(--[a-z][\w-]*)\"", path.read_text(encoding="utf-8")))
    # Fields of a preset are options of a board's target, and nextpnr's are quoted.
    preset = (CHECKOUT / "soc" / "boards" / "preset.py").read_text(encoding="utf-8")
    for name in re.findall(r"(?m)^    (\w+)\s*:", preset):
        known |= {f"--{name.replace('_', '-')}", f"--no-{name.replace('_', '-')}"}
    return known


Check = Callable[[str, str], Iterator[str]]
CHECKS: dict[str, Check] = {"links": bad_links, "paths": bad_paths, "make": bad_make, "modules": bad_modules,
                            "commands": bad_commands, "options": bad_options}


@pytest.mark.parametrize("page", pages())
@pytest.mark.parametrize("kind", CHECKS)
def test_what_a_page_names_exists(kind: str, page: str) -> None:
    """Every file, heading, target, variable, module, command and option that a page names exists."""
    if page not in HISTORY or kind == "links":
        assert list(CHECKS[kind](page, text_of(page))) == []


def test_pages_are_found() -> None:
    """The walk finds all pages."""
    assert {"README.md", "CONTRIBUTING.md", "docs/architecture.md", "docs/boards/ulx3s.md"} <= set(pages())


@pytest.mark.parametrize(("kind", "text", "complaint"), [
    ("links",    "[a](docs/nowhere.md)",                            "docs/nowhere.md: no such file"),
    ("links",    "[a](docs/theory.md#nothing)",                     "docs/theory.md#nothing: no such heading"),
    ("links",    "# A\n[a](#b)",                                    "#b: no such heading"),
    ("paths",    "in `gateware/nothing.py`",                        "gateware/nothing.py: no such file or folder"),
    ("paths",    "in `app/nothing.c`",                              "app/nothing.c: no such file or folder"),
    ("paths",    "    .ci/nothing fpga",                            ".ci/nothing: no such file or folder"),
    ("paths",    "see `python tests/nothing.py --now`",             "tests/nothing.py: no such file or folder"),
    ("make",     "run `make nothing`",                              "make nothing: no such target"),
    ("make",     "    make soak N=3",                               "make soak N=3: no such variable"),
    ("make",     "    make flash BOARD=none",                       "make flash BOARD=none: no such board"),
    ("modules",  "`.venv/bin/python -m litestereo.soc.target a`",   "python -m litestereo.soc.target: no such module"),
    ("modules",  "```python\nfrom litestereo.soc.add import A\n```", "import litestereo.soc.add: no such module"),
    ("modules",  "`python -m campaigns.nothing`",                   "python -m campaigns.nothing: no such module"),
    ("commands", "    litestereo guess a.png",                      "litestereo guess: no such command"),
    ("commands", "`litestereo match a b --faster 3`",               "litestereo match --faster: no such option"),
    ("options",  "use `--faster`",                                  "--faster: no program has this option"),
])
def test_what_does_not_exist_is_found(kind: str, text: str, complaint: str) -> None:
    """Each kind of mistake is found, in a page with no other."""
    assert list(CHECKS[kind]("README.md", text)) == [complaint]


@pytest.mark.parametrize("text", [
    "[a](https://example.org/nothing.md)", "# A `b`: c\n[a](#a-b-c)", "`build/nothing.py`", "`*.py` of `tests/*.py`",
    "`soc/<memory>-<key>`", "`make`", "    make test TESTS=tests/gateware JOBS=1", "`make flash BOARD=...`",
    "`litestereo --help`", "    litestereo match a b -o out --device model:  # --comment", "`drivers/`", "`and/or`",
])
def test_what_is_no_mistake_passes(text: str) -> None:
    """Pages of other projects, placeholders, generated files and comments are no mistakes."""
    assert not [line for check in CHECKS.values() for line in check("README.md", text)]


def test_help_names_every_target_and_variable() -> None:
    """Each target has a group and a text, and CONTRIBUTING lists it; each variable has a default and a text."""
    makefile = (CHECKOUT / "Makefile").read_text()
    targets  = make_targets()
    phony    = set(makefile.split(".PHONY:")[1].replace("\\", " ").split())
    assert phony == set(targets)
    described = set(re.findall(r"(?m)^#: .+\n([A-Z_]+) +\?=", makefile))
    assert described == set().union(*(target.variables for target in targets.values()))
    listed = text_of("CONTRIBUTING.md").split("## Make targets")[1].split("\n## ")[0]
    groups = re.findall(r"(?m)^##@ (.+)$", makefile)
    assert re.findall(r"(?m)^\*\*(.+)\*\*$", listed) == groups
    rows   = {name: row for row in re.findall(r"(?m)^\| `.*$", listed)
              for name in re.findall(r"`([a-z-]+)`", row.split("|")[1])}
    assert set(rows) == set(targets)
    for name, row in rows.items():
        assert targets[name].variables == set(re.findall(r"`([A-Z_]+)`", row.split("|")[3])), name


def test_the_rooms_are_those_that_imports_are_checked_by() -> None:
    """CONTRIBUTING lists each room and what it may import, as `test_rooms` does."""
    section = text_of("CONTRIBUTING.md").split("\n## Rooms\n")[1].split("\n## ")[0]
    listed  = {row[1]: tuple(re.findall(r"`([^`]+)`", row[2]))
               for row in re.finditer(r"(?m)^\| `([^`]+)` \| (.*) \|$", section)}
    assert listed == {room: allowed for room, allowed in ROOMS.items() if room not in NO_ROOMS}
