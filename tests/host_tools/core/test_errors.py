#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The tree of errors, as the module draws it."""

import re

from litestereo.host_tools.core import errors

#: Bars and dashes of the picture, four characters per level; then the name, and what the error is about.
_LINE = re.compile(r"(?P<branch>(?:[│ ] {3})*[├└]── )?(?P<name>\w+)(?: {2,}\S.*)?")


def drawn():
    """(name, depth) of each class of the picture, from top to bottom."""
    picture = errors.__doc__.split("::\n\n")[1]
    lines   = [_LINE.fullmatch(line.removeprefix("    ")) for line in picture.splitlines() if line.strip()]
    assert all(lines)
    return [(line["name"], len(line["branch"] or "")//4) for line in lines]


def defined(base=errors.LiteStereoError, depth=0):
    """(name, depth) of each class of the module, from the root on, in the order of their definitions."""
    return [(base.__name__, depth), *(item for one in base.__subclasses__() if one.__module__ == errors.__name__
                                      for item in defined(one, depth + 1))]


def test_the_picture_is_the_tree():
    assert drawn() == defined()


def test_the_picture_has_every_class():
    classes = [name for name, value in vars(errors).items() if isinstance(value, type)]
    assert sorted(classes) == sorted(name for name, _ in drawn())
