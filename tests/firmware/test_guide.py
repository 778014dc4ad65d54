#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The guide for users' programs against the headers that it describes."""

import re
import subprocess

import pytest

from support.paths import CHECKOUT

GUIDE    = (CHECKOUT / "docs" / "firmware.md").read_text()
HEADERS  = CHECKOUT / "firmware" / "include"
PROGRAMS = re.findall(r"```c\n(.*?)```", GUIDE, re.DOTALL)


@pytest.mark.parametrize("program", PROGRAMS)
def test_programs_of_the_guide_compile(tmp_path, program):
    source = tmp_path / "program.c"
    source.write_text(program)
    done = subprocess.run(["gcc", "-std=c11", "-Wall", "-Wextra", "-Werror", "-c", f"-I{HEADERS}", source, "-o",
                           tmp_path / "program.o"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_every_function_is_in_the_guide():
    """The guide has every function of stereo.h."""
    header    = (HEADERS / "litestereo" / "stereo.h").read_text()
    functions = set(re.findall(r"^\w[\w ]*?\W(stereo_\w+)\(", header, re.MULTILINE))
    assert len(functions) == 12
    assert len(PROGRAMS) == 4
    assert not [name for name in functions if name not in GUIDE]


def test_headers_of_the_guide_exist():
    named = re.findall(r"`(\w+\.h)`", GUIDE)
    assert len(set(named)) > 12
    assert not [name for name in named if not (HEADERS / "litestereo" / name).is_file()]


def test_every_header_is_in_the_guide():
    headers = {path.name for path in HEADERS.rglob("*.h")}
    assert len(headers) > 12
    assert headers <= set(re.findall(r"`(\w+\.h)`", GUIDE))
