#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The firmware is the same, bit for bit, in any folder and at any time, and its libraries are accounted for.

The two builds here share LiteX's libraries; `make reproduce` builds those twice too.
"""

import re
import shutil

import pytest

from litestereo.firmware import FIRMWARE_DIR
from litestereo.sim.system.build import build_firmware, build_soc
from litestereo.soc.release.reproduce import BUILDS, build_program, sha256
from litestereo.soc.release.sbom.components import LIBRARIES

pytestmark = pytest.mark.system


@pytest.fixture(scope="module")
def soc():
    return build_soc()


def sums(soc, folder, change=None):
    """Return checksums of firmware built from copies of its sources, in two folders; `change` alters a copy first."""
    found = []
    for place, environment in BUILDS:
        sources = folder / place / "sources"
        shutil.copytree(FIRMWARE_DIR, sources)
        if change:
            change(sources)
        build_program(sources / "Makefile", soc, folder / place / "output", environment)
        found.append(sha256(folder / place / "output" / "litestereo.bin"))
    return found


@pytest.mark.long
def test_same(soc, tmp_path):
    """Both equal the firmware of the checkout."""
    assert set(sums(soc, tmp_path)) == {sha256(build_firmware(soc))}


def replace(name, old, new):
    """Return a change of a source file."""
    def change(sources):
        text = (sources / name).read_text()
        assert old in text
        (sources / name).write_text(text.replace(old, new))
    return change


@pytest.mark.parametrize("change", [
    replace("Makefile", "-fmacro-prefix-map=$(FIRMWARE_DIR)/=", ""),
    replace("app/console.c", '"name: %s\\n"', '"name: %s " __DATE__ "\\n"'),
], ids=["path", "date"])
@pytest.mark.long
def test_different(soc, tmp_path, change):
    """A path or a date in the firmware is noticed."""
    first, second = sums(soc, tmp_path, change)
    assert first != second


@pytest.mark.long
def test_libraries(soc):
    """The linked libraries are those of the bill of materials; libgcc is not among them."""
    linked = set(re.findall(r"(lib\w+)\.a\(", (build_firmware(soc).parent / "litestereo.elf.map").read_text()))
    assert linked - {"liblitestereo"} <= set(LIBRARIES)
    assert {"libbase", "libc", "libcompiler_rt"} <= linked
