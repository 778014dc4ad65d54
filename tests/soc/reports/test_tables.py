#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The tables of settings and features, and the files generated from them."""

import ast
import sys

import pytest

from litestereo.gateware.common import features, settings
from litestereo.gateware.common.features import CAPABILITY_TABLE, FEATURE_TABLE
from litestereo.gateware.common.settings import FRAME_OPTIONS, SETTINGS, setting
from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.soc.reports import tables

NAMES = {one.name for one in FEATURE_TABLE}


def test_nothing_is_stale(monkeypatch, capsys):
    """The committed files match the tables."""
    monkeypatch.setattr(sys, "argv", ["tables", "--check"])
    assert tables.main() == 0, capsys.readouterr().err


def test_a_stale_file_is_named(monkeypatch, capsys):
    """A stale file is named with the command that generates it."""
    changed = {path: text + " " for path, text in tables.generated().items()}
    monkeypatch.setattr(tables, "generated", lambda: changed)
    monkeypatch.setattr(sys, "argv", ["tables", "--check"])
    assert tables.main() == 1
    errors = capsys.readouterr().err.splitlines()
    assert len(errors) == len(changed)
    assert "docs/protocol.md is stale: run python -m litestereo.soc.reports.tables" in errors[-1]


def test_files_are_written(monkeypatch, tmp_path):
    """Without an option the files are written."""
    monkeypatch.setattr(tables, "generated", lambda: {tmp_path / "one.py": "text\n"})
    monkeypatch.setattr(sys, "argv", ["tables"])
    assert tables.main() == 0
    assert (tmp_path / "one.py").read_text() == "text\n"


def test_a_document_without_markers_is_refused():
    """A document without markers is refused: there is no other place to write to."""
    with pytest.raises(ValueError, match="no lines <!-- generated parameters: begin -->"):
        tables.protocol("# Protocol\n")


def test_numbers_have_no_gaps():
    """Parameters, bits and capabilities have no gaps, and their names are unique."""
    assert [one.number for one in SETTINGS] == list(range(1, len(SETTINGS) + 1))
    assert [one.bit for one in FEATURE_TABLE] == list(range(len(FEATURE_TABLE)))
    assert [one.number for one in CAPABILITY_TABLE] == list(range(1, len(CAPABILITY_TABLE) + 1))
    for table in (SETTINGS, FEATURE_TABLE, CAPABILITY_TABLE):
        assert len({one.name for one in table}) == len(table)
    assert {one.kind for one in FEATURE_TABLE} == {"stage", "peripheral", "device", "reserved"}


@pytest.mark.parametrize("one", SETTINGS, ids=lambda one: one.name)
def test_a_row_is_sound(one):
    """Default and off value are legal and fit the register, and the features exist."""
    assert one.least <= one.default <= one.most
    assert (one.default - one.least) % one.step == 0
    assert one.off is None or one.least <= one.off <= one.most
    assert one.step & (one.step - 1) == 0
    largest = max(one.most, one.off_in_register or 0)
    assert largest < 2**one.bits or one.built
    assert {one.feature, one.off_feature} - {""} <= NAMES
    assert bool(one.feature) <= (one.off is not None)
    assert not one.values or len(one.values) == one.most + 1
    if one.unused_without:
        assert setting(one.unused_without).off is not None
    assert one.text[0] == one.text[0].lower() or one.text[:2].isupper()
    assert not one.text.endswith(".")


def test_bits_of_options_are_told_apart():
    """Each option has a different bit, also those that are no settings."""
    bits = [one.option_bit for one in SETTINGS if one.option] + [one.bit for one in FRAME_OPTIONS]
    assert sorted(bits) == list(range(len(bits)))


def test_host_tools_have_the_defaults():
    """The host tools have the defaults of the table, by its names."""
    assert {name: getattr(MatcherSettings(), name) for name in ("disparities", "block_size", "prefilter", "median")} \
        == {"disparities": 64, "block_size": 9, "prefilter": "xsobel", "median": False}
    assert list(MatcherSettings().parameters.values()) == [one.default for one in SETTINGS]


@pytest.mark.parametrize("module", [features, settings])
def test_the_tables_are_plain_python(module):
    """The tables do not import migen: other tools may read them."""
    with open(module.__file__, encoding="utf-8") as source:
        tree = ast.parse(source.read())
    imported = {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    assert imported <= {"__future__", "dataclasses"}
    assert not [node for node in ast.walk(tree) if isinstance(node, ast.Import)]
