#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The floor of each Python folder holds for that folder."""

import sys

import coverage
import pytest

from campaigns.coverage import __main__ as page
from campaigns.coverage import python
from support.paths import CHECKOUT


@pytest.fixture
def data(tmp_path):
    """Return counts: a file of the host tools run as a whole, one of `soc` run in part, and none of `sim`."""
    path  = tmp_path / "python.coverage"
    count = coverage.CoverageData(basename=str(path))
    count.add_lines({str(CHECKOUT / "host_tools" / "protocol" / "cobs.py"): range(1, 100),
                     str(CHECKOUT / "soc" / "build" / "commit.py"): range(1, 9)})
    count.write()
    return path


def test_the_floor_of_each_folder(data, monkeypatch, capsys):
    """One folder's lines do not make up for another's; a folder without counts has run nothing."""
    folders = {folder.name: folder for folder in python.measured(data)}
    assert list(folders) == ["host_tools", "soc", "sim"]
    assert folders["host_tools"].percent == 100
    assert 0 < folders["soc"].percent < python.FLOORS["soc"]
    assert folders["sim"].percent == 0
    assert [line.partition(":")[0] for line in python.low(list(folders.values()))] == ["soc", "sim"]
    monkeypatch.setattr(python, "DATA", data)
    monkeypatch.setattr(python, "measured", lambda: list(folders.values()))
    assert python.main() == 1
    assert "sim: the tests have run 0.0 % of its lines" in capsys.readouterr().out
    monkeypatch.setattr(sys, "argv", ["python", "--quiet"])
    assert python.main() == 1
    output = capsys.readouterr()
    assert output.out == "" and "sim: 0.0 % of its lines, below the floor" in output.err
    monkeypatch.setattr(python, "FLOORS", dict.fromkeys(python.FLOORS, 0.0))
    assert python.main() == 0
    assert capsys.readouterr() == ("", "")


def test_no_counts(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(python, "DATA", tmp_path / "none")
    assert python.main() == 1
    assert "have left no counts" in capsys.readouterr().err


def test_the_page(data):
    """The page has a table for each folder."""
    text = "\n".join(page.python_part(python.measured(data)))
    assert "### `soc`" in text and "| `host_tools/protocol/cobs.py` | " in text


def test_every_folder_is_counted():
    """The Makefile counts the folders that have floors, and judges them."""
    makefile = (CHECKOUT / "Makefile").read_text()
    for folder in python.FLOORS:
        assert f"--cov={folder} " in makefile
    assert "-m campaigns.coverage.python --quiet)" in makefile
    assert f"/{python.DATA.name}\n" in makefile
