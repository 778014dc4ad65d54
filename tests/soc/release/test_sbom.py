#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The bill of materials is current, valid, and complete."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from importlib.metadata import distribution, version

import pytest
from cyclonedx.schema import SchemaVersion
from cyclonedx.validation.json import JsonStrictValidator
from packaging.requirements import Requirement

from litestereo.soc.release.sbom import __main__ as command
from litestereo.soc.release.sbom import components, licences
from litestereo.soc.release.sbom.components import EMBEDDED, NOWHERE
from support.paths import CHECKOUT

DOCS = CHECKOUT / "docs"

#: Prints the packages of LiteX's family that two SoCs load: one with SDRAM, one with DDR3.
LOADED = """
import sys
from litestereo.soc.boards import soc_class
for board in ("colorlight_i5", "ecpix5"):
    soc_class(board)(soc_class(board).preset, ident_version=False)
print(*{name.split(".")[0] for name in sys.modules if name.startswith(("lite", "migen"))} - {"litestereo"})
"""


def bill():
    """Return the bill in docs/."""
    return json.loads((DOCS / "sbom.cdx.json").read_text())


@pytest.mark.skipif(sys.version_info[:2] != (3, 11), reason="docs/ has what Python 3.11 needs")
def test_current():
    """`make sbom` writes exactly the files in docs/."""
    for name, text in command.documents().items():
        assert (DOCS / name).read_text() == text, f"docs/{name} is stale: run make sbom"


def test_valid():
    """The bill is valid by the schema of CycloneDX; without a name, or with an unknown licence, it is not."""
    validator = JsonStrictValidator(SchemaVersion.V1_6)
    assert validator.validate_str(json.dumps(bill())) is None
    nameless = bill()
    del nameless["components"][0]["name"]
    assert validator.validate_str(json.dumps(nameless)) is not None
    unknown = bill()
    unknown["components"][0]["licenses"] = [{"license": {"id": "BSD"}}]
    assert validator.validate_str(json.dumps(unknown)) is not None


def test_components():
    """Each component has a licence, an installed version, a purl, and a product."""
    for one in bill()["components"]:
        (choice,) = one["licenses"]
        assert licences.is_spdx(choice.get("expression") or choice["license"]["id"]), one["name"]
        assert one["purl"] == f"pkg:pypi/{one['name']}@{one['version']}"
        assert {"bitstream", "firmware", "host tools"} & {entry["value"] for entry in one["properties"]}
    assert not licences.is_spdx("BSD") and not licences.is_spdx("MIT AND Nothing")


def test_every_dependency():
    """Each of the project's dependencies is in the bill, or listed as part of no product."""
    listed = {one["name"] for one in bill()["components"]}
    names  = {Requirement(line).name for line in distribution("litestereo").requires
              if "extra ==" not in line or re.search("extra == .(gateware|view|ros|cluster|plots)", line)}
    assert {name.lower() for name in names if not name.startswith("litestereo")} <= listed | set(NOWHERE)
    assert not listed & set(NOWHERE)


def test_read_licences():
    """Licences that were read in files: the files exist, and the package is in the bill."""
    listed = {one["name"] for one in bill()["components"]}
    for name, (expression, *read) in licences.READ.items():
        assert name in listed and licences.is_spdx(expression)
        files = [str(path) for path in distribution(name).files]
        assert all(any(file.endswith(f"/{path}") or file == path for file in files) for path in read), name


def test_no_licence():
    """A package whose metadata have no licence is refused, with a remedy."""
    with pytest.raises(ValueError, match="READ in soc/release/sbom/licences.py"):
        licences.licence(distribution("litespi"), "litespi")


def test_other_version(monkeypatch):
    """A package that is not of the locked release is refused."""
    other = components.locked() | {"litex": ("1.0", [])}
    monkeypatch.setattr(components, "locked", lambda: other)
    with pytest.raises(ValueError, match=rf"litex {version('litex')} is installed, and 1.0 locked: run make install"):
        components.components()


@pytest.mark.long
def test_bitstream():
    """The generators that a board's SoC loads are those of the bill, and no others."""
    done = subprocess.run([sys.executable, "-c", LOADED], capture_output=True, text=True, check=True)
    assert set(done.stdout.replace("_", "-").split()) == {name for name, products in EMBEDDED.items()
                                                          if "bitstream" in products} - {"pythondata-cpu-vexriscv"}
