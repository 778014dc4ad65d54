#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The licence of an installed package, as an SPDX expression, and where it was read."""

from __future__ import annotations

from functools import cache
from importlib.metadata import Distribution

from license_expression import Licensing, get_spdx_licensing

#: Classifiers, and texts of the field License, that mean exactly one licence; those of BSD are ambiguous.
NAMES = {
    "Apache Software License":                   "Apache-2.0",
    "Apache 2.0":                                "Apache-2.0",
    "MIT License":                               "MIT",
    "Mozilla Public License 2.0 (MPL 2.0)":      "MPL-2.0",
    "Python Software Foundation License":        "PSF-2.0",
}

#: Packages whose metadata are indefinite, or describe only their packaging: the licence in their files, and the files.
READ = {
    "apsw":                            ("Zlib", "licenses/LICENSE"),
    "contourpy":                       ("BSD-3-Clause", "LICENSE"),
    "cycler":                          ("BSD-3-Clause", "LICENSE"),
    "jinja2":                          ("BSD-3-Clause", "licenses/LICENSE.txt"),
    "kiwisolver":                      ("BSD-3-Clause", "licenses/LICENSE"),
    "litedram":                        ("BSD-2-Clause", "licenses/LICENSE"),
    "liteeth":                         ("BSD-2-Clause", "licenses/LICENSE"),
    "litex":                           ("BSD-2-Clause", "licenses/LICENSE"),
    "litex-boards":                    ("BSD-2-Clause", "licenses/LICENSE"),
    "lz4":                             ("BSD-3-Clause", "licenses/LICENSE"),
    # The wheel contains FFmpeg.
    "opencv-python-headless":          ("Apache-2.0 AND LGPL-2.1-or-later",
                                        "cv2/LICENSE.txt", "cv2/LICENSE-3RD-PARTY.txt"),
    "partd":                           ("BSD-3-Clause", "LICENSE.txt"),
    "pyserial":                        ("BSD-3-Clause", "serial/__init__.py"),
    "pythondata-cpu-vexriscv":         ("MIT", "pythondata_cpu_vexriscv/verilog/ext/VexRiscv/LICENSE"),
    "pythondata-software-compiler-rt": ("NCSA OR MIT", "pythondata_software_compiler_rt/data/LICENSE.TXT"),
    # Of the linked files: Picolibc's and AVR Libc's, SiFive's, Newlib's, and Cygnus' string functions.
    "pythondata-software-picolibc":    ("BSD-3-Clause AND BSD-2-Clause AND LicenseRef-Cygnus",
                                        "pythondata_software_picolibc/data/COPYING.NEWLIB",
                                        "newlib/libc/string/memchr.c"),
    "zict":                            ("BSD-3-Clause", "LICENSE.txt"),
}


@cache
def spdx() -> Licensing:
    """Return the identifiers of SPDX; reading them takes a second."""
    return get_spdx_licensing()


def is_spdx(expression: str) -> bool:
    """Return whether an expression consists of SPDX's identifiers, or of `LicenseRef-` for a text without one."""
    return all(key.startswith("LicenseRef-") for key in spdx().unknown_license_keys(expression))


def licence(package: Distribution, name: str) -> tuple[str, str]:
    """Return the SPDX expression of a package's licence, and where it was read.

    Raises
    ------
    ValueError
        Neither the metadata nor `READ` say it; the message says what to do.
    """
    if name in READ:
        expression, *files = READ[name]
        return expression, ", ".join(files)
    # Once the backport of importlib.metadata has been imported, `get` raises for what is missing.
    metadata   = package.metadata
    expression = metadata.get("License-Expression")
    if expression:
        return expression, "metadata"
    classifiers = [line.split(" :: ")[-1] for line in metadata.get_all("Classifier", [])
                   if line.startswith("License ::")]
    for text in (metadata.get("License") or "", *classifiers):
        short = NAMES.get(text, text)
        if short and "\n" not in short and len(short) < 40 and is_spdx(short):
            return short, "metadata"
    raise ValueError(f"the metadata of {name} do not say its licence: read it in the package's files, and add it to "
                     "READ in soc/release/sbom/licences.py")
