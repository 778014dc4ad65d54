#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Drawn tests draw the limits of every setting, and of every range that they name."""

from __future__ import annotations

import ast
import random
from pathlib import Path

import pytest

from litestereo.gateware.common.settings import SETTINGS
from litestereo.host_tools.core.errors import SettingsError
from litestereo.host_tools.core.settings import RULES, MatcherSettings, from_number
from support.limits import BLOCK, Draws, Range, setting_ranges
from support.pairs import byte_generator, generator
from support.settings import LARGEST_CAP_WITH_CHECK, OpenCVDraws, SettingDraws

TESTS = Path(__file__).parent

#: Functions of generators that draw a number.
DRAWING = {"choice", "integers", "randint", "randrange", "random", "sample"}


@pytest.mark.parametrize("one, ends, limits, beyond", [
    (Range(0, 0),        [0],               [0],                              [-1, 1]),
    (Range(0, 1),        [0, 1],            [0, 1],                           [-1, 2]),
    (Range(-1, 12),      [-1, 0, 11, 12],   [-1, 0, 1, 2, 3, 4, 5, 7, 8, 9, 11, 12], [-2, 13]),
    (Range(5, 21, 2),    [5, 7, 19, 21],    [5, 7, 9, 15, 17, 19, 21],        [3, 4, 6, 8, 18, 20, 22, 23]),
    (Range(16, 64, 16),  [16, 32, 48, 64],  [16, 32, 48, 64],
     [0, 15, 17, 31, 33, 47, 49, 63, 65, 80]),
    (Range(16, 70, 16),  [16, 32, 48, 64],  [16, 32, 48, 64],
     [0, 15, 17, 31, 33, 47, 49, 63, 65, 80]),
    (Range(100, 140),    [100, 101, 139, 140], [100, 101, 127, 128, 129, 139, 140], [99, 141]),
], ids=str)
def test_limits_of_a_range(one, ends, limits, beyond):
    assert (one.ends, one.limits) == (ends, limits)
    assert one.beyond() == beyond
    assert all(value in one for value in limits) and not any(value in one for value in beyond)
    assert [value for value in one.beyond(0, 255) if value not in beyond] in ([0, 255], [0], [255])
    assert all(0 <= value <= 255 for value in one.beyond(0, 255))


def test_ranges_of_settings():
    """The ranges are those of the gateware's table."""
    assert setting_ranges() == {one.name: Range(one.least, one.most, one.step) for one in SETTINGS}


def test_the_ceiling_of_the_left_right_check_is_a_limit():
    """A matcher of 16, 32, 64 or 128 disparities holds no larger difference than the largest of its map."""
    assert {16, 32, 64, 128} <= set(setting_ranges()["disp12_max_diff"].limits)


@pytest.mark.parametrize("rng", [generator, byte_generator])
def test_every_limit_of_every_setting_is_drawn(rng):
    """All ends within a block of draws, also the second time, and all powers of two within so many that hold them."""
    for one in SETTINGS:
        draws  = Draws(rng(1), setting_ranges())
        limits = draws.ranges[one.name]
        for block in range(1, 5):
            values = [draws(one.name) for _ in range(BLOCK)]
            assert set(limits.ends) <= set(values) and all(value in limits for value in values), one.name
            assert all(draws.drawn[one.name][value] >= block for value in limits.ends)
        while sum(draws.drawn[one.name].values()) < BLOCK*(len(limits.powers)//3 + 1):
            draws(one.name)
        assert one.name not in draws.missed(powers=True)
        # Values from the middle come as well.
        assert any(value not in limits.limits for value in draws.drawn[one.name]) or limits.most - limits.least < 300


@pytest.mark.parametrize("most", [{}, {"block_size": 15, "disparities": 48}, {"block_size": 255, "disparities": 256}])
def test_settings_are_drawn_at_every_limit(most):
    """As the tests draw them: twelve times whole settings, for the comparison with OpenCV 59 times."""
    draws = SettingDraws(generator(2), **most)
    found = [draws.settings() for _ in range(BLOCK)]
    draws.check()
    for name, limits in setting_ranges(**{"block_size": 21, "disparities": 64} | most).items():
        assert {from_number(name, value) for value in limits.ends} <= {getattr(one, name) for one in found}, name
    opencv = OpenCVDraws(generator(3), **most)
    found  = [opencv.settings() for _ in range(59)]
    opencv.check()
    assert set(opencv.ranges) == set(RULES) - {"prefilter", "subpixel", "median"}
    assert all(one.disp12_max_diff == -1 for one in found if one.prefilter_cap > LARGEST_CAP_WITH_CHECK)
    assert {one.disp12_max_diff for one in found} >= {-1, 0, 253, 254}


def test_what_was_not_drawn_is_named():
    draws = Draws(random.Random(4), {"a": Range(0, 9), "b": Range(3, 3)})
    for _ in range(BLOCK):
        draws("a")
    assert draws.missed() == {"b": [3]}
    with pytest.raises(AssertionError, match="not drawn: {'b': "):
        draws.check()
    assert draws.missed(powers=True) == {"a": [value for value in range(10) if value in (0, 1, 2, 3, 4, 5, 7, 8, 9)
                                               and not draws.drawn["a"][value]], "b": [3]}


@pytest.mark.parametrize("name", RULES)
def test_host_settings_at_and_beyond_every_limit(name):
    """Values at each limit are accepted, the first ones beyond it are refused by one line; devices narrow some."""
    rule, one = RULES[name], setting_ranges()[name]
    for value in one.limits:
        assert MatcherSettings(**{name: from_number(name, value)}).number(name) == value
    for value in one.beyond():
        if rule.values or value > one.most and rule.most is None and (value - one.least) % one.step == 0:
            continue
        with pytest.raises(SettingsError, match=name.replace("_", " ")) as caught:
            MatcherSettings(**{name: value})
        assert "\n" not in str(caught.value)


def draws_by_hand(call: ast.Call) -> bool:
    """Whether settings are made of numbers that a generator draws directly."""
    return any(isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in DRAWING
               for node in ast.walk(call))


def test_no_test_draws_settings_by_hand():
    """They come from `support/settings.py`, so that no limit is left out."""
    found = [f"{path.relative_to(TESTS)}:{node.lineno}" for path in sorted(TESTS.rglob("*.py"))
             if "MatcherSettings" in (text := path.read_text()) for node in ast.walk(ast.parse(text))
             if isinstance(node, ast.Call) and "MatcherSettings" in ast.unparse(node.func) and draws_by_hand(node)]
    assert found == []
    assert draws_by_hand(ast.parse("MatcherSettings(block_size=int(rng.choice([5, 7])))").body[0].value)
