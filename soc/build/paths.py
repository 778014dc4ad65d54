#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Where builds go: one folder per content, so that nothing is built twice."""

from __future__ import annotations

import ast
import contextlib
import fcntl
import hashlib
import os
import re
import shutil
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

#: Folder of `gateware`, `soc`, `firmware`, `host_tools` and `sim`: the checkout, or the installed package.
PACKAGE_DIR = Path(__file__).resolve().parents[2]

#: Distributions whose releases determine what LiteX generates.
LITEX_PACKAGES = ("litex", "litedram", "liteeth", "migen", "pythondata-cpu-vexriscv")

#: A comment of C, or a literal, which may contain the marks of one.
C_COMMENT = re.compile(r"""//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])*'""", re.DOTALL)


def build_directory() -> Path:
    """Return the folder for everything that is generated.

    `LITESTEREO_BUILD` if set, `build/` of the checkout that this package was installed from, or the user's cache.
    """
    if named := os.environ.get("LITESTEREO_BUILD"):
        return Path(named).resolve()
    if (PACKAGE_DIR / "pyproject.toml").is_file():
        return PACKAGE_DIR / "build"
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "litestereo"


def content_key(parts: Iterable[str | bytes]) -> str:
    """Return a short hash of everything that a build depends on."""
    digest = hashlib.sha256()
    for part in parts:
        data = part.encode() if isinstance(part, str) else part
        digest.update(len(data).to_bytes(8, "little"))
        digest.update(data)
    return digest.hexdigest()[:16]


def source_key(*folders: Path) -> str:
    """Return the hash of names and contents of all source files below `folders`."""
    parts: list[str | bytes] = []
    for folder in folders:
        for path in sorted(folder.rglob("*")):
            if path.is_file() and "__pycache__" not in path.parts:
                parts += [str(path.relative_to(folder)), path.read_bytes()]
    return content_key(parts)


def code_key(*folders: Path) -> str:
    """Return a hash of the code below `folders`, or in files: comments and docstrings do not count.

    So measurements and long builds are not repeated for a better word.
    """
    parts: list[str | bytes] = []
    for folder in folders:
        for path in sorted(folder.rglob("*")) if folder.is_dir() else [folder]:
            if path.is_file() and "__pycache__" not in path.parts:
                parts += [str(path.relative_to(folder)), _code(path)]
    return content_key(parts)


def _code(path: Path) -> str | bytes:
    """Return what a file does: its syntax tree, or its text without comments."""
    if path.suffix == ".py":
        tree = ast.parse(path.read_bytes())
        for node in ast.walk(tree):
            if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef)) and ast.get_docstring(node) is not None:
                node.body[0] = ast.Pass()
        return ast.dump(tree)
    if path.suffix in (".c", ".h", ".cpp"):
        return "\n".join(line for line in map(str.rstrip, C_COMMENT.sub(_blank, path.read_text()).splitlines()) if line)
    return path.read_bytes()


def _blank(found: re.Match[str]) -> str:
    return " " if found[0].startswith("/") else found[0]


@contextlib.contextmanager
def locked(path: Path) -> Iterator[None]:
    """Hold an exclusive lock on `path` (created if needed): two processes never build the same thing at once."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with open(path, "w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


def built_once(folder: Path, build: Callable[[Path], None]) -> Path:
    """Return `folder`, after calling `build(folder)` unless an earlier call succeeded."""
    with locked(folder.with_suffix(".lock")):
        done = folder / "done"
        if not done.is_file():
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir(parents=True)
            build(folder)
            done.touch()
    return folder
