#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The folders of the firmware: includes and calls go one way, and no calls between files form a circle."""

import re
import subprocess
from graphlib import CycleError, TopologicalSorter

import pytest

from support.paths import CHECKOUT

FIRMWARE = CHECKOUT / "firmware"

#: Folders that a file may include and call, apart from its own. A file belongs to the deepest folder named.
ROOMS = {
    "include":       set(),
    "lib":           {"include"},
    "reference":     {"include", "lib"},
    "link/protocol": {"include", "lib"},
    "drivers":       {"include", "lib", "link/protocol"},
    "link/update":   {"include", "lib", "link/protocol", "drivers"},
    "link":          {"include", "lib", "link/protocol", "link/update"},
    "link/udp":      {"include", "lib", "link/protocol", "link", "drivers"},
    "app":           {"include", "lib", "reference", "link/protocol", "drivers", "link/update", "link", "link/udp"},
    "boot":          {"include", "lib", "drivers"},
    "examples":      {"include", "lib"},
    "tests":         {"include", "lib", "reference", "link/protocol", "drivers", "link/update", "link", "link/udp",
                      "app", "boot"},
    "fuzz":          {"include", "lib", "link/protocol", "drivers", "link/update", "link", "link/udp", "tests"},
}

#: Folders that may include headers that are neither the firmware's nor of standard C: LiteX's, or the host's.
FOREIGN  = {"drivers", "boot", "tests", "fuzz"}
STANDARD = {f"{name}.h" for name in ("assert", "inttypes", "limits", "setjmp", "stdarg", "stdbool", "stddef", "stdint",
                                     "stdio", "stdlib", "string", "wchar")}

#: Folders whose headers are included without the folder's name.
PATHS = (FIRMWARE / "include", FIRMWARE, FIRMWARE / "tests" / "stubs", FIRMWARE / "tests" / "support")

#: Sources that need LiteX's generated headers that the stubs of the tests lack.
NOT_COMPILED = {"boot/boot.c", "drivers/platform.c"}

#: Folders whose files are linked into one program.
COMPILED = ("lib", "reference", "link", "drivers", "app", "boot")


def room(name):
    """Return the folder of `ROOMS` that a file, relative to `firmware/`, belongs to."""
    return max((folder for folder in ROOMS if name.startswith(f"{folder}/")), key=len)


def resolve(path, quote, name):
    """Return the path of an included file, None if it is not the firmware's."""
    folders = [path.parent, *PATHS] if quote == '"' else PATHS[:1]
    return next((folder / name for folder in folders if (folder / name).is_file()), None)


def includes():
    """Yield every include of the firmware: the file, its kind of quotes, the argument, and the path that it means."""
    for path in sorted(FIRMWARE.rglob("*.[ch]")):
        for quote, name in re.findall(r'^\s*#\s*include\s*(["<])(.*)[">]', path.read_text(), re.MULTILINE):
            yield path, quote, name, resolve(path, quote, name)


def test_every_file_has_a_room():
    names = [path.relative_to(FIRMWARE).as_posix() for path in FIRMWARE.rglob("*.[ch]")]
    assert len(names) > 150
    assert {room(name) for name in names} == set(ROOMS)


def test_the_order_has_no_circle():
    TopologicalSorter(ROOMS).prepare()
    assert not {folder for allowed in ROOMS.values() for folder in allowed} - set(ROOMS)


def test_includes_follow_the_order():
    wrong = []
    for path, _, name, target in includes():
        if target is not None:
            here  = path.relative_to(FIRMWARE).as_posix()
            there = target.resolve().relative_to(FIRMWARE).as_posix()
            if room(there) not in {room(here), *ROOMS[room(here)]}:
                wrong.append(f"{here} includes {name}")
    assert not wrong


def test_headers_of_others():
    """LiteX's headers are included where hardware is; a quoted header is always the firmware's."""
    wrong = []
    for path, quote, name, target in includes():
        here = path.relative_to(FIRMWARE).as_posix()
        if quote == '"' and target is None:
            wrong.append(f"{here} includes {name}, which is not there")
        ours = quote == '"' or (target is not None and FIRMWARE / "include" in target.parents)
        if not ours and name not in STANDARD and room(here) not in FOREIGN:
            wrong.append(f"{here} includes {name}, which is LiteX's")
    assert not wrong


@pytest.fixture(scope="module")
def calls(tmp_path_factory):
    """Return the files from which each file needs a function or a variable, relative to `firmware/`."""
    folder  = tmp_path_factory.mktemp("objects")
    defined = {}
    needed  = {}
    for path in (path for name in COMPILED for path in sorted((FIRMWARE / name).rglob("*.c"))):
        name = path.relative_to(FIRMWARE).as_posix()
        if name in NOT_COMPILED:
            continue
        subprocess.run(["gcc", "-std=c11", "-w", "-c", *(f"-I{path}" for path in PATHS), path, "-o", folder / "one.o"],
                       check=True)
        symbols = subprocess.run(["nm", folder / "one.o"], check=True, capture_output=True, text=True).stdout
        kinds   = [line.split()[-2:] for line in symbols.splitlines()]
        defined |= {symbol: name for kind, symbol in kinds if kind in "TDBRC"}
        needed[name] = {symbol for kind, symbol in kinds if kind == "U"}
    return {name: {defined[symbol] for symbol in symbols if symbol in defined} for name, symbols in needed.items()}


def test_calls_follow_the_order(calls):
    assert len(calls) > 40
    assert sum(map(len, calls.values())) > 80
    wrong = [f"{caller} needs {called}" for caller, others in calls.items() for called in sorted(others)
             if room(called) not in {room(caller), *ROOMS[room(caller)]}]
    assert not wrong


def test_no_files_call_each_other(calls):
    try:
        TopologicalSorter(calls).prepare()
    except CycleError as error:
        pytest.fail(f"these files call each other: {' <- '.join(error.args[1])}")
