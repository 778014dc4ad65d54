#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What changes a content key, and what does not."""

from __future__ import annotations

import pytest

from litestereo.soc.build.paths import code_key, content_key, source_key

PYTHON = '''"""A module."""

class Core:
    """A core."""
    def __init__(self):
        """Declare."""
        self.count = 1  # A number.
'''

C = '''/* A file. */
static const char *name = "/* no comment */"; // A name.
int count(void) { return '"' + 1; }
'''


@pytest.mark.parametrize("name, text, old, new", [
    ("core.py", PYTHON, "A module.",      "Another word."),
    ("core.py", PYTHON, "Declare.",       "Declare all."),
    ("core.py", PYTHON, "  # A number.",  ""),
    ("core.c",  C,      "A file.",        "A file\n of C."),
    ("core.c",  C,      " // A name.",    ""),
    ("core.h",  C,      "/* A file. */\n", ""),
])
def test_words_do_not_count(tmp_path, name, text, old, new):
    """A comment or docstring changes the source, but not its key."""
    assert old in text
    (tmp_path / name).write_text(text)
    before = code_key(tmp_path), source_key(tmp_path)
    (tmp_path / name).write_text(text.replace(old, new))
    assert code_key(tmp_path) == before[0]
    assert source_key(tmp_path) != before[1]


@pytest.mark.parametrize("name, text, old, new", [
    ("core.py",  PYTHON, "= 1",           "= 2"),
    ("core.py",  PYTHON, "count",         "number"),
    ("core.c",   C,      "no comment",    "another"),
    ("core.c",   C,      "+ 1",           "+ 2"),
    ("core.c",   C,      "int count",     "long count"),
    ("data.txt", "1\n",  "1",             "2"),
])
def test_code_counts(tmp_path, name, text, old, new):
    """A number, a name, a literal, or any byte of a file of another kind changes the key."""
    (tmp_path / name).write_text(text)
    before = code_key(tmp_path)
    (tmp_path / name).write_text(text.replace(old, new))
    assert code_key(tmp_path) != before


def test_names_of_files_count(tmp_path):
    """A moved file changes the key; a single file may be the root."""
    (tmp_path / "a.py").write_text(PYTHON)
    before = code_key(tmp_path)
    assert code_key(tmp_path / "a.py") == code_key(tmp_path / "a.py")
    (tmp_path / "a.py").rename(tmp_path / "b.py")
    assert code_key(tmp_path) != before
    assert content_key(["a", "b"]) != content_key(["ab"])
