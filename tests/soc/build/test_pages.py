#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Pages carry the key of their sources."""

from __future__ import annotations

import pytest

from litestereo.soc.build import pages
from litestereo.soc.build.pages import Page
from litestereo.soc.build.paths import content_key

OLD, NEW = content_key(["old"]), content_key(["new"])


@pytest.fixture
def page(tmp_path, monkeypatch):
    monkeypatch.setattr(pages, "PACKAGE_DIR", tmp_path)
    return lambda key, minutes=0: Page("page.md", "things", lambda: key, minutes)


def test_a_page_that_is_current(page):
    """A page is current until its sources change."""
    page(OLD).write("# Page\n\nText.\n")
    assert page(OLD).path.read_text() == f"# Page\n\nText.\n\n<!-- made from {OLD} by make things -->\n"
    assert page(OLD).stale() is None
    assert page(NEW, 5).stale() == f"page.md is made from {OLD}, the tree has {NEW}: run make things, about 5 minutes"


def test_a_page_without_a_mark(page):
    """A missing page, or one without its mark, is stale."""
    assert page(OLD).stale() == "page.md says nothing of what it was made from: run make things"
    page(OLD).path.write_text(f"# Page\n\n<!-- made from {OLD} by make others -->\n")
    assert page(OLD).stale() == "page.md says nothing of what it was made from: run make things"


def test_a_mark_is_replaced_where_it_is(page):
    """Marks of other targets remain."""
    text = f"# Page\n\n<!-- made from {OLD} by make things -->\nFigures.\n<!-- made from {OLD} by make others -->\n"
    page(NEW).write(text)
    assert page(NEW).path.read_text() == text.replace(f"{OLD} by make things", f"{NEW} by make things")


def test_two_marks_are_refused(page):
    """Two marks of one target are refused, because either may be valid."""
    with pytest.raises(ValueError, match=r"2 marks of make things: leave one"):
        page(NEW).write(f"<!-- made from {OLD} by make things -->\n"*2)
