#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""No file contains a word or turn that `support.policy` bans, whichever language the file is written in."""

from __future__ import annotations

import subprocess
from pathlib import PurePath

import pytest

from support.paths import CHECKOUT
from support.policy import banned_words

#: Kinds of files that people read: Python, C, documents, makefiles and scripts.
SUFFIXES = {".py", ".c", ".h", ".cpp", ".md"}
FOLDERS  = {".ci"}
NAMES    = {"Makefile"}

#: The list of banned words and its tests, the history, and pages that commands write.
EXCLUDED = {
    "CHANGELOG.md", "tests/gateware/test_policy.py", "tests/support/policy.py", "tests/test_words.py",
    *(f"docs/{page}.md" for page in ("boards", "coverage", "frame_link_registers", "licences", "network", "registers",
                                     "resources", "thesis")),
}


def files() -> list[str]:
    """Return the files under the rule, relative to the checkout."""
    tracked = subprocess.run(["git", "ls-files"], check=True, cwd=CHECKOUT, capture_output=True, text=True).stdout
    return [file for file in tracked.splitlines() if file not in EXCLUDED
            and (PurePath(file).suffix in SUFFIXES or PurePath(file).name in NAMES
                 or str(PurePath(file).parent) in FOLDERS) and (CHECKOUT / file).is_file()]


def test_no_banned_words():
    """No file has one."""
    problems = [f"{file}:{line}: {what}" for file in files()
                for line, what in banned_words(file, (CHECKOUT / file).read_text(encoding="utf-8"))]
    assert not problems, "\n".join(problems)


def test_files_of_each_kind_are_found():
    """Each kind of file is among them, and each excluded one exists."""
    found = files()
    for some in ("tests/conftest.py", "firmware/app/main.c", "firmware/link/session.h", "README.md", "Makefile",
                 "firmware/tests/Makefile", "tests/campaigns/soak/machine.cpp", ".ci/install"):
        assert some in found
    assert not [file for file in EXCLUDED if not (CHECKOUT / file).is_file()]


@pytest.mark.parametrize("name, text, line", [
    ("a.c",      "/* Text. */\n\n/* A clock of its\n * own. */",            3),
    ("a.h",      "int a; /**< What stands for it. */",                      1),
    ("a.cpp",    "int a;\n// It is\n// queued or in\n// line.",             3),
    ("a.c",      "int b;\nint nobody_waits(void);",                         2),
    ("a.c",      'puts("a // b");\nputs("nobody");',                        2),
    ("a.md",     "# Page\n\n```\ncode\n```\n\nThat is `code` of its\nown.", 7),
    ("Makefile", "all:\n\n# As\n# whatever.",                               4),
    ("install",  "echo besides",                                            1),
    ("a.py",     "# A clock of its\n# own.",                               1),
])
def test_a_banned_word_is_found(name, text, line):
    """It is found across lines and in names, and reported with its line."""
    assert [number for number, _ in banned_words(name, text)] == [line]


@pytest.mark.parametrize("name, text", [
    ("a.c",  "int stands = 1; /* A standby in lines. */ int in;\nint line;"),
    ("a.c",  "char quote = '\"'; int first; /* it takes */ int in;"),
    ("a.md", "Write `whatever`:\n\n```\nnobody\n```\n\nor ``in line``."),
    ("a.md", "    make test\n"),
    ("a.py", "for word in line:\n    pass\n"),
])
def test_other_text_passes(name, text):
    """Code in documents, and words in separate places, are no mistakes."""
    assert banned_words(name, text) == []
