#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""A section of the page: its measurement and its text. Results of measurements are kept in the build folder."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...gateware.common.parameters import MatcherParameters
from ...soc.build.paths import build_directory, built_once, code_key, content_key
from .measured import matchers_key, system_key, versions_key
from .middlebury import data_key
from .presets import Scale

PACKAGE = Path(__file__).resolve().parent

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
    builds
        Function that returns the matchers that are measured at a scale: their emitted Verilog is part of the key.
    system
        Whether the path from memory to memory in the simulated SoC is measured too.
    sources
        Files whose code is part of the key, in addition to its own module and `SHARED`.
    more
        Function that returns further parts of the key.
    needs_pairs
        Whether it uses the Middlebury pairs.
    """
    label:       str
    title:       str
    text:        str
    measure:     Callable[[Scale, Path], Any]
    fields:      Callable[[Any], dict[str, object]]
    builds:      Callable[[Scale], Iterable[MatcherParameters]]
    system:      bool                    = False
    sources:     tuple[Path, ...]        = ()
    more:        Callable[[], list[str]] = list
    needs_pairs: bool                    = False

    @property
    def name(self) -> str:
        """The label as a part of file names: "table-5-1". A dot would begin a suffix."""
        return self.label.lower().replace(" ", "-").replace(".", "-")

    @property
    def files(self) -> list[Path]:
        """Return the files and folders whose code is part of the key: no gateware, whose Verilog is."""
        return [Path(self.measure.__code__.co_filename), *(PACKAGE / name for name in SHARED), *self.sources]

    def key(self, scale: Scale) -> str:
        """Return the content key of the measurement, apart from the pairs that it is made on."""
        system = [system_key(), versions_key()] if self.system else []
        return content_key([repr(scale), code_key(*self.files), matchers_key(self.builds(scale)), *system,
                            *self.more()])

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
