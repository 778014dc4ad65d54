#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Mutants are small, real and reproducible; `make mutation` judges them."""

import ast
from pathlib import Path

import pytest

import litestereo.gateware
from campaigns.mutation.__main__ import TESTS
from campaigns.mutation.explained import EQUIVALENT
from campaigns.mutation.gateware_faults import drawn, mutants_of, source_of
from support.paths import CHECKOUT

GATEWARE = Path(litestereo.gateware.__file__).parent
KINDS    = {"comparison", "operator", "sign", "off by one", "swapped operands", "missing register", "stuck at 0"}


@pytest.mark.parametrize("core", sorted(TESTS))
def test_a_mutant_differs_in_one_place(core: str) -> None:
    """Each mutant is Python, differs from the core, and equals it before and after the fault."""
    source = source_of(GATEWARE, core).read_text()
    found  = mutants_of(source_of(GATEWARE, core))
    assert found
    for mutant in found:
        assert ast.dump(ast.parse(mutant.source)) != ast.dump(ast.parse(source)), mutant.name
        assert mutant.source.count("\n") <= source.count("\n"), mutant.name
        above = source.splitlines()[:mutant.line - 1]
        assert mutant.source.splitlines()[:mutant.line - 1] == above, mutant.name
        below = source.partition(mutant.before)[2] if source.count(mutant.before) == 1 else ""
        assert mutant.source.endswith(below), mutant.name


def test_the_seed_draws_them() -> None:
    """A seed draws the same mutants every time, all different, of all cores and all kinds."""
    first = drawn(GATEWARE, sorted(TESTS), 200, 1)
    assert first == drawn(GATEWARE, sorted(TESTS), 200, 1)
    assert first != drawn(GATEWARE, sorted(TESTS), 200, 2)
    assert len(set(first)) == 200
    assert {mutant.core for mutant in first} == set(TESTS)
    assert {mutant.kind for mutant in first} == KINDS


def test_every_core_has_tests() -> None:
    """Every core has tests, and their files exist."""
    for arguments in TESTS.values():
        files = [part for part in arguments if part.endswith(".py")]
        assert files and all((CHECKOUT / "tests" / file).is_file() for file in files)


def test_exceptions_are_of_this_source() -> None:
    """Each equivalent mutant is still one of the core: an exception ends with its line."""
    for core, *rest in EQUIVALENT:
        found = mutants_of(source_of(GATEWARE, core))
        assert tuple(rest) in {(mutant.code, mutant.before, mutant.after) for mutant in found}
