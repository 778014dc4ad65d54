#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""A gateware core with a fault put into its source."""

from __future__ import annotations

import types
from pathlib import Path

import litestereo.gateware


def altered(module: str, old: str, new: str):
    """Return a gateware module in which `new` replaces `old`, which must occur once."""
    (path,) = Path(litestereo.gateware.__file__).parent.rglob(f"{module}.py")
    package = ".".join(["litestereo", *path.parent.relative_to(Path(litestereo.gateware.__file__).parents[1]).parts])
    source = path.read_text()
    assert source.count(old) == 1, f"{path} has {source.count(old)} of {old!r}"
    result = types.ModuleType(f"{package}.{module}")
    result.__package__ = package
    exec(compile(source.replace(old, new), f"altered {path}", "exec"), result.__dict__)
    return result
