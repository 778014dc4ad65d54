#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Names in emitted Verilog do not depend on what was made before."""

from __future__ import annotations

import re

import pytest
from litex.gen import LiteXModule
from litex.gen.fhdl import verilog
from migen import Signal

from litestereo.soc.build.names import names_in_order

#: So many signals more move a signal to any slot of a set of a few signals.
OTHERS = range(33)


class Twins(LiteXModule):
    """Two outputs, from inside signals of one name; the ports have claimed names too."""

    def __init__(self) -> None:
        self.outputs = [Signal(name_override="first"), Signal(name_override="second")]
        self.twins   = [Signal(name_override="twin"), Signal(name_override="twin"), Signal(name_override="first")]
        self.comb += [
            self.twins[0].eq(1),
            self.twins[1].eq(0),
            self.twins[2].eq(self.twins[0]),
            self.outputs[0].eq(self.twins[2]),
            self.outputs[1].eq(self.twins[1]),
        ]


def emit(others: int) -> str:
    """Return Verilog of the twins, made after so many other signals."""
    for _ in range(others):
        Signal()
    module = Twins()
    text = str(verilog.convert(module, ios=set(module.outputs), name="twins"))
    return re.sub(r"^//.*$", "", text, flags=re.MULTILINE)


@pytest.mark.parametrize("others", OTHERS)
def test_the_first_one_made_gets_the_name(others):
    """Of signals that claim one name the next one gets the next number; ports keep theirs."""
    with names_in_order():
        text = emit(others)
    assert re.findall(r"assign (\w+) = ([\w']+)", text) == [
        ("twin", "1'd1"), ("twin_1", "1'd0"), ("first_1", "twin"), ("first", "first_1"), ("second", "twin_1")]


def test_otherwise_it_depends_on_what_was_made_before():
    """LiteX's own order is that of a set; if a release of LiteX passes here, `names_in_order` is not needed."""
    assert len({emit(others) for others in OTHERS}) > 1
