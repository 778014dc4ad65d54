#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""YAML files of people and drivers, read as plain text values, in bounded time."""

from __future__ import annotations

import re
from typing import Any

import yaml

from ..core.errors import GeometryError
from .numbers import decode_text

#: Most characters of the first document: PyYAML parses some 50 000 per second, and a camera has about 1000.
_LONGEST = 1 << 16

#: A line that separates two documents.
_SEPARATOR = re.compile(r"^---(?:\s|$)", re.MULTILINE)


def parse_first(data: bytes) -> dict[str, Any]:
    """Return the first document of a YAML file, which must be a mapping.

    All scalars are text: dates, numbers without end and merge keys of YAML 1.1 are not interpreted.

    Raises
    ------
    GeometryError
        It is no YAML, is not a mapping, or is too long. The message does not name the file.
    """
    try:
        text = _first(decode_text(data))
        if len(text) > _LONGEST:
            raise GeometryError(f"is no file of a camera: it has more than {_LONGEST} characters")
        content = yaml.load(text, Loader=yaml.BaseLoader)  # It makes text, lists and dicts only.
    # Also what PyYAML lets through: ValueError of escapes and directives, RecursionError of nesting.
    except (yaml.YAMLError, ValueError, OverflowError, RecursionError):
        raise GeometryError("is not a YAML file, a camera_info of ROS is needed") from None
    if not isinstance(content, dict):
        raise GeometryError("is not a camera_info of ROS: it has no image_width")
    return content


def _first(text: str) -> str:
    """Return the first document that is not empty."""
    for document in _SEPARATOR.split(text):
        if any(line.strip() and not line.lstrip().startswith(("#", "%")) for line in document.splitlines()):
            return document
    return ""
