#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The components as CycloneDX, for programs, and as a table, for people."""

from __future__ import annotations

from collections.abc import Iterable

from .components import BITSTREAM, FIRMWARE, HOST_TOOLS, LOCK, Component
from .licences   import spdx

PRODUCTS = {
    BITSTREAM:  "What the Verilog is made of. Yosys and nextpnr make a bitstream of it.",
    FIRMWARE:   "What is linked into firmware and boot program; libgcc is not. `LicenseRef-Cygnus` is the notice at\n"
                "the head of `memchr.c`.",
    HOST_TOOLS: "What the command `litestereo` imports, and what that needs in turn, by Python 3.11. The README says\n"
                "what the extras are. The simulators behind `sim:` and `cosim:` are not in the list.",
}

HEAD = """# Licences

What the products of LiteStereo are made of; written by `make sbom`, as is [sbom.cdx.json](sbom.cdx.json), which says
the same in CycloneDX, with hashes. Versions are those of `{lock}`. LiteStereo itself is in all three, version
{version}, under {licence}.
"""


def licence_choice(expression: str) -> dict:
    """Return an SPDX expression in CycloneDX's form: an identifier, or an expression of several."""
    simple = len(spdx().license_keys(expression)) == 1 and not expression.startswith("LicenseRef-")
    return {"license": {"id": expression}} if simple else {"expression": expression}


def cyclonedx(version: str, own_licence: str, python: str, components: Iterable[Component]) -> dict:
    """Return the components as a bill of materials, without date and serial number, so that it is reproducible."""
    root = f"pkg:generic/litestereo@{version}"
    bill = []
    for one in components:
        properties = [{"name": "litestereo:product", "value": product} for product in one.products]
        properties += [{"name": f"litestereo:{product}".replace(" ", "-"), "value": what}
                       for product, what in one.products.items()]
        properties += [{"name": "litestereo:licence-read-in", "value": one.read_in}]
        if one.upstream:
            properties += [{"name": "litestereo:upstream", "value": one.upstream}]
        bill.append({
            "type":       "library",
            "bom-ref":    one.purl,
            "name":       one.name,
            "version":    one.version,
            "scope":      "optional" if one.optional else "required",
            **({"hashes": [{"alg": "SHA-256", "content": value} for value in one.hashes]} if one.hashes else {}),
            "licenses":   [licence_choice(one.licence)],
            "purl":       one.purl,
            "properties": properties,
        })
    return {
        "bomFormat":   "CycloneDX",
        "specVersion": "1.6",
        "version":     1,
        "metadata": {
            "component":  {"type": "application", "bom-ref": root, "name": "litestereo", "version": version,
                           "licenses": [licence_choice(own_licence)], "purl": root},
            "properties": [{"name": "litestereo:python", "value": python},
                           {"name": "litestereo:hashes", "value": LOCK}],
        },
        "components":   bill,
        "dependencies": [{"ref": root, "dependsOn": [one["bom-ref"] for one in bill]}],
    }


def table(version: str, own_licence: str, components: list[Component]) -> str:
    """Return the components of each product as Markdown."""
    parts = [HEAD.format(lock=LOCK, version=version, licence=own_licence)]
    for product, about in PRODUCTS.items():
        parts += [f"\n## {product.capitalize()}\n\n{about}\n\n",
                  "| component | version | licence | read in | goes in as |\n|---|---|---|---|---|\n"]
        for one in components:
            if product in one.products:
                release = f"{one.version} ({one.upstream})" if one.upstream else one.version
                parts.append(f"| {one.name} | {release} | {one.licence} | {one.read_in} | {one.products[product]} |\n")
    return "".join(parts)
