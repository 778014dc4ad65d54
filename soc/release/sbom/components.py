#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The components of the products: packages of the lock, with their installed metadata."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import PackageNotFoundError, distribution

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from ...build.paths import PACKAGE_DIR
from .licences      import licence

CHECKOUT = PACKAGE_DIR
LOCK     = ".ci/lock/test.txt"

BITSTREAM, FIRMWARE, HOST_TOOLS = "bitstream", "firmware", "host tools"

#: Packages of bitstream and firmware, and their parts in these. All other requirements are looked up.
EMBEDDED = {
    "litex":                           {BITSTREAM: "SoC, bus, UART, timer",
                                        FIRMWARE: "libbase, liblitedram, start-up code"},
    "litedram":                        {BITSTREAM: "SDRAM controller", FIRMWARE: "sequence that starts the SDRAM"},
    "liteeth":                         {BITSTREAM: "Ethernet PHY, MAC, UDP"},
    "migen":                           {BITSTREAM: "generates the Verilog"},
    "litex-boards":                    {BITSTREAM: "pins of the boards"},
    "pythondata-cpu-vexriscv":         {BITSTREAM: "the CPU"},
    "pythondata-software-picolibc":    {FIRMWARE: "libc"},
    "pythondata-software-compiler-rt": {FIRMWARE: "arithmetic that the CPU has no instructions for"},
}

#: Packages of no product: they compile libraries, are only in simulators, or in no board's gateware.
NOWHERE = ("meson", "ninja", "pythondata-misc-tapcfg", "litespi")

#: Libraries that a firmware's link map names, and their packages.
LIBRARIES = {"libbase": "litex", "liblitedram": "litex", "libc": "pythondata-software-picolibc",
             "libcompiler_rt": "pythondata-software-compiler-rt"}

#: Extras of the host tools.
HOST_EXTRAS = ("view", "ros", "cluster", "plots")


@dataclass(frozen=True)
class Component:
    """A package that is part of a product."""
    name:     str
    version:  str
    licence:  str            # SPDX expression.
    read_in:  str            # Where the licence was read.
    products: dict[str, str] # Its part in each product.
    hashes:   list[str]      # sha256 of the wheel, and of the source; none if there is a wheel for each platform.
    upstream: str            # Version of the wrapped software, if it wraps any.
    optional: bool           # Whether only an extra installs it.

    @property
    def purl(self) -> str:
        return f"pkg:pypi/{self.name}@{self.version}"


def locked() -> dict[str, tuple[str, list[str]]]:
    """Return version and hashes of each package of the lock."""
    packages = {}
    for block in re.split(r"\n(?=\w)", (CHECKOUT / LOCK).read_text()):
        if found := re.match(r"([\w.-]+)==([^ ]+)", block):
            packages[canonicalize_name(found[1])] = (found[2], re.findall(r"sha256:([0-9a-f]{64})", block))
    return packages


def closure(requirements: Iterable[str]) -> set[str]:
    """Return the names of the packages that requirements install with this Python."""
    seen:  set[tuple[str, frozenset[str]]] = set()
    queue = [Requirement(one) for one in requirements]
    while queue:
        one = queue.pop()
        key = (canonicalize_name(one.name), frozenset(one.extras))
        if key in seen:
            continue
        seen.add(key)
        for inner in map(Requirement, distribution(one.name).requires or []):
            if inner.marker is None or any(inner.marker.evaluate({"extra": extra}) for extra in ("", *one.extras)):
                queue.append(inner)
    return {name for name, _ in seen}


def _upstream(name: str) -> str:
    """Return what git says of the sources in a package of LiteX's `pythondata`."""
    return import_module(name.replace("-", "_")).data_git_describe if name.startswith("pythondata-") else ""


def _component(name: str, products: dict[str, str], lock: dict[str, tuple[str, list[str]]],
               optional: bool = False) -> Component:
    try:
        package = distribution(name)
    except PackageNotFoundError:
        raise ValueError(f"the package {name} is not installed: run make install") from None
    version, hashes = lock[name]
    if package.version != version:
        raise ValueError(f"{name} {package.version} is installed, and {version} locked: run make install")
    # A hash identifies the file only if there is one file for all platforms.
    one_for_all = "Root-Is-Purelib: true" in (package.read_text("WHEEL") or "")
    text, where = licence(package, name)
    return Component(name, version, text, where, products, hashes if one_for_all else [], _upstream(name), optional)


def components() -> list[Component]:
    """Return all components, those of bitstream and firmware first.

    Raises
    ------
    ValueError
        A package is not installed as locked, or its licence is not known; the message says what to do.
    """
    project = tomllib.loads((CHECKOUT / "pyproject.toml").read_text())["project"]
    lock    = locked()
    always  = closure(project["dependencies"])
    extras  = closure(one for extra in HOST_EXTRAS for one in project["optional-dependencies"][extra]) - always
    return [_component(name, products, lock) for name, products in EMBEDDED.items()] + [
        _component(name, {HOST_TOOLS: "with an extra" if name in extras else "always"}, lock, name in extras)
        for name in sorted(always | extras)]
