#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Wheels without contents, for tests of pip's behaviour."""

from __future__ import annotations

import hashlib
import zipfile
from pathlib import Path


def stub_wheel(folder: Path, name: str, version: str = "1.0") -> str:
    """Write a wheel of a package without contents; return its sha256."""
    stem = f"{name.replace('-', '_')}-{version}"
    path = folder / f"{stem}-py3-none-any.whl"
    with zipfile.ZipFile(path, "w") as file:
        for part, text in (("METADATA", f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n"),
                           ("WHEEL", "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n"),
                           ("RECORD", "")):
            file.writestr(f"{stem}.dist-info/{part}", text)
    return hashlib.sha256(path.read_bytes()).hexdigest()
