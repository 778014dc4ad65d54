#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The register map in the documentation is the gateware's."""

import re

import pytest
from litex.soc.interconnect.csr_bus import CSRBank, Interface

from litestereo.soc.reports.registers import DOCUMENT, PERIPHERALS, main


def test_documents_are_up_to_date():
    """If this fails, the gateware has changed: run `python -m litestereo.soc.reports.registers`."""
    assert main(["--check"]) == 0


@pytest.mark.parametrize("document", PERIPHERALS, ids=lambda document: document.stem)
def test_offsets_are_those_of_litex(document):
    """LiteX's bank has the same registers in the same order; of several words the first one is documented."""
    words      = CSRBank(PERIPHERALS[document]().get_csrs(sort=True), bus=Interface(data_width=32)).simple_csrs
    documented = re.findall(r"^\| `(0x\w+)` \| \W*`(\w+)`", document.read_text(), re.MULTILINE)
    names      = [re.sub(r"\d$", "", word.name) for word in words]
    assert [(int(offset, 16), name) for offset, name in documented] == [
        (4*index, name) for index, name in enumerate(names) if name not in names[:index]]


@pytest.mark.parametrize(("old", "new"), [
    ("`left_base`",                  "`left`"),
    ("<!-- generated: end -->",      ""),
    ("| `start` | w, pulse |",       "| `start` | rw |"),
])
def test_stale_document_is_told_in_one_line(tmp_path, capsys, old, new):
    """The check writes nothing; without it the file is updated, if it has its markers."""
    path  = tmp_path / "registers.md"
    stale = DOCUMENT.read_text().replace(old, new)
    path.write_text(stale)
    peripherals = {path: PERIPHERALS[DOCUMENT]}
    assert main(["--check"], peripherals) == 1
    assert capsys.readouterr().err.count("\n") == 1
    assert path.read_text() == stale
    assert main([], peripherals) == (0 if "end -->" in stale else 1)
    assert (path.read_text() == DOCUMENT.read_text()) == ("end -->" in stale)
