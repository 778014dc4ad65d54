#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Imports run one way: each room knows only those below it.

Imports are the statements, and names of modules in strings (`importlib`, `python -m`).
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from support.paths import CHECKOUT

#: Rooms from the bottom up, with what each may import apart from itself. A name without a room, as `soc`, is all of
#: its rooms. The deepest listed folder counts.
ROOMS: dict[str, tuple[str, ...]] = {
    "firmware":               (),
    # Pure cores: no bus, no SoC.
    "gateware":               (),
    "gateware/common":        (),
    "gateware/engines":       ("gateware/common",),
    "gateware/memory":        ("gateware/common",),
    "gateware/post":          ("gateware/common", "gateware/engines"),
    "gateware/matcher":       ("gateware/common", "gateware/engines", "gateware/post"),
    "gateware/rectification": ("gateware/common",),
    "gateware/cameras":       ("gateware/common",),
    "gateware/link":          ("gateware/common", "gateware/memory"),
    "gateware/peripherals":   ("gateware",),
    # The tools that build things, and the models, are at the bottom too.
    "soc/build":              (),
    "sim/models":             (),
    # The host tools know only the names of the simulations, in one registry.
    "host_tools/core":        (),
    "host_tools/protocol":    ("host_tools/core",),
    "host_tools/link":        ("host_tools/core", "host_tools/protocol"),
    "host_tools/devices":     ("host_tools/core", "host_tools/protocol", "host_tools/link"),
    "host_tools/cameras":     ("host_tools/core",),
    "host_tools/data":        ("host_tools/core", "host_tools/cameras", "host_tools/devices"),
    "host_tools/live":        ("host_tools/core", "host_tools/cameras", "host_tools/data", "host_tools/devices"),
    "host_tools/evaluation":  ("host_tools/core", "host_tools/cameras", "host_tools/data", "host_tools/devices"),
    "host_tools/export":      ("host_tools/core", "host_tools/cameras", "host_tools/data"),
    "host_tools/viewing":     ("host_tools/core", "host_tools/cameras", "host_tools/live"),
    "host_tools/cli":         ("host_tools",),
    "host_tools":             ("host_tools",),
    # A SoC, its boards, and the way to a bitstream.
    "soc/parts":              ("gateware", "soc/build"),
    "soc/boards":             ("gateware", "soc/build", "soc/parts"),
    "soc/flow":               ("firmware", "gateware", "soc/build", "soc/parts", "soc/boards"),
    "soc/reports":            ("gateware", "soc/build", "soc/parts", "soc/boards", "soc/flow"),
    "soc/release":            ("firmware", "soc/build", "soc/boards", "soc/flow"),
    "soc":                    (),
    # Simulation: one core, a SoC, the full system, and measurements of them.
    "sim/cores":              ("gateware", "soc/build", "soc/flow", "sim/models"),
    "sim/socs":               ("gateware", "soc/build", "soc/parts", "soc/boards", "sim/cores"),
    "sim/system":             ("firmware", "soc/build", "soc/boards", "sim/cores", "sim/socs", "host_tools"),
    "sim/bench":              ("sim/models", "sim/system", "soc/build", "soc/boards", "host_tools"),
    "sim/thesis":             ("firmware", "gateware", "soc", "sim", "host_tools"),
    "sim":                    ("sim", "soc", "host_tools"),
}

PACKAGES = ("firmware", "gateware", "host_tools", "sim", "soc")

#: The one file that names modules above its room, and these modules: a device of that kind loads them on demand.
REGISTRY = {"host_tools/devices/registry.py": ("sim/models", "sim/cores", "sim/system")}

#: The name of a module.
DOTTED = re.compile(r"\blitestereo\.((?:firmware|gateware|host_tools|sim|soc)(?:\.\w+)*)")


def room_of(path: str) -> str:
    """Return the deepest listed room that a file or a folder of the checkout is in."""
    parts = path.removesuffix(".py").split("/")
    while parts and "/".join(parts) not in ROOMS:
        parts.pop()
    assert parts, f"{path} is in no room: add its folder to ROOMS"
    return "/".join(parts)


def imported(path: str, source: str) -> Iterator[tuple[int, str]]:
    """Yield line and imported thing, as a path of the checkout without suffix, of each import of a file."""
    package = Path(path).parent.parts
    tree    = ast.parse(source)
    scopes  = [node for node in ast.walk(tree) if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef)]
    texts   = {id(node.value) for scope in scopes for node in scope.body[:1] if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        match node:
            case ast.ImportFrom(level=0, module=str(module)) if module.startswith("litestereo"):
                base = module.split(".")[1:]
                yield from ((node.lineno, "/".join([*base, name.name])) for name in node.names)
            case ast.ImportFrom(level=level, module=module) if level:
                base = [*package[:len(package) - level + 1], *(module.split(".") if module else [])]
                yield from ((node.lineno, "/".join([*base, name.name])) for name in node.names)
            case ast.Import(names=names):
                yield from ((node.lineno, name.name.replace(".", "/").removeprefix("litestereo/")) for name in names
                            if name.name.startswith("litestereo."))
            # Docstrings may name commands; other strings may be run.
            case ast.Constant(value=str(text)) if id(node) not in texts:
                yield from ((node.lineno, found[1].replace(".", "/")) for found in DOTTED.finditer(text))


def arrows(path: str, source: str) -> list[str]:
    """Return the imports of a file that no arrow allows, one line each."""
    room  = room_of(path)
    wrong = []
    for line, thing in imported(path, source):
        other   = room_of(thing)
        allowed = (room, *ROOMS[room], *REGISTRY.get(path, ()))
        if not any(other == one or other.startswith(f"{one}/") for one in allowed):
            wrong.append(f"{path}:{line}: {room} must not import {other} ({thing})")
    return wrong


def sources() -> list[str]:
    """Return the Python files of the packages, relative to the checkout."""
    paths = (path for package in PACKAGES for path in (CHECKOUT / package).rglob("*.py"))
    return sorted(str(path.relative_to(CHECKOUT)) for path in paths)


@pytest.mark.parametrize("package", PACKAGES)
def test_imports_run_one_way(package: str) -> None:
    """No file imports from a room above or beside its own."""
    files = [path for path in sources() if path.startswith(f"{package}/")]
    assert files
    assert not [line for path in files for line in arrows(path, (CHECKOUT / path).read_text())]


@pytest.mark.parametrize("path, line", [
    ("gateware/matcher/new.py",    "from ...soc.build.paths import build_directory"),
    ("gateware/common/new.py",     "from ..memory.ports import word_bytes"),
    ("gateware/engines/sad/new.py", "from ...matcher import raster"),
    ("gateware/rectification/new.py", "from ..matcher.raster import Raster"),
    ("gateware/cameras/new.py",    "from ..rectification.rectifier import Rectifier"),
    ("soc/parts/new.py",           "from ..boards import BOARDS"),
    ("soc/boards/new.py",          "from litestereo.soc.flow.target import main"),
    ("soc/flow/new.py",            "import litestereo.sim.system.build"),
    ("soc/reports/new.py",         "import importlib\nimportlib.import_module('litestereo.sim.cores.cosim')"),
    ("soc/release/new.py",         "COMMAND = ['python', '-m', 'litestereo.sim.socs.simulated_soc']"),
    ("sim/models/new.py",          "from ..cores import cosim"),
    ("host_tools/core/new.py",     "from ..protocol import messages"),
    ("host_tools/cameras/new.py",  "def late():\n    from ..export import files"),
    ("host_tools/devices/new.py",  "MODULE = 'litestereo.sim.models.stereo_bm'"),
])
def test_a_wrong_arrow_is_found(path: str, line: str) -> None:
    """An import against the arrows is found in any form."""
    assert len(arrows(path, line)) == 1


@pytest.mark.parametrize("path, line", [
    ("soc/flow/new.py",            '"""Run it as `python -m litestereo.sim.demo`."""'),
    ("sim/system/new.py",          "from ...host_tools.devices.connect import connect"),
    ("gateware/engines/sad/new.py", "from ...common import *"),
])
def test_an_arrow_that_may_be(path: str, line: str) -> None:
    """A docstring is no import, and rooms below may be imported."""
    assert not arrows(path, line)


def test_rooms_have_files() -> None:
    """Each listed room is a folder of the checkout."""
    assert not [room for room in ROOMS if not (CHECKOUT / room).is_dir()]
