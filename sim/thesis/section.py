#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""A section of the page: its measurement and its text. Results of measurements are kept in the build folder."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from ...soc.build.paths import LITEX_PACKAGES, PACKAGE_DIR, build_directory, built_once, code_key, content_key
from .middlebury import data_key
from .presets import Scale

PACKAGE = Path(__file__).resolve().parent

#: Rooms that every measurement depends on.
MEASURED = ("firmware", "gateware", "soc/build", "soc/parts", "soc/boards", "soc/flow", "sim/bench", "sim/cores",
            "sim/models", "sim/socs", "sim/system")

#: Files of this package that every measurement depends on, in addition to its own module.
SHARED = ("elaborated.py", "middlebury.py", "pictures.py", "presets.py")


@dataclass(frozen=True)
class Section:
    """The counterpart of one table or figure of the thesis.

    Parameters
    ----------
    label
        Its name in the thesis: "Table 5.1".
    title
        Its subject.
    text
        Markdown with a field in braces for every number.
    measure
        Function that measures at a scale, writes pictures to a folder, and returns a result for JSON.
    fields
        Function that returns the text's fields from the result of `measure`.
    needs_pairs
        Whether it uses the Middlebury pairs.
    uses
        Further files of this package that it depends on.
    """
    label:       str
    title:       str
    text:        str
    measure:     Callable[[Scale, Path], Any]
    fields:      Callable[[Any], dict[str, object]]
    needs_pairs: bool            = False
    uses:        tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """The label as a part of file names: "table-5-1". A dot would begin a suffix."""
        return self.label.lower().replace(" ", "-").replace(".", "-")

    def key(self, scale: Scale) -> str:
        """Return the content key of the measurement, apart from the pairs that it is made on."""
        module  = Path(self.measure.__code__.co_filename)
        sources = [module, *(PACKAGE / name for name in (*SHARED, *self.uses)),
                   *(PACKAGE_DIR / folder for folder in MEASURED)]
        return content_key([repr(scale), code_key(*sources), *(version(name) for name in LITEX_PACKAGES)])

    def measured(self, scale: Scale) -> Path:
        """Return the folder with `result.json` and pictures; measure once for each content."""
        key = content_key([self.key(scale), data_key() if self.needs_pairs else ""])

        def build(folder: Path) -> None:
            (folder / "result.json").write_text(json.dumps(self.measure(scale, folder), indent=1) + "\n")

        return built_once(build_directory() / "thesis" / f"{self.name}-{key}", build)

    def markdown(self, folder: Path) -> str:
        """Return the section's Markdown, from the folder that `measured` has returned."""
        fields = self.fields(json.loads((folder / "result.json").read_text()))
        return f"## {self.label}: {self.title}\n\n{self.text.format(**fields).strip()}\n"
