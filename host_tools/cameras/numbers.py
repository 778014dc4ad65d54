#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Text of files that people edit: its encoding, and the numbers in it."""

from __future__ import annotations

import codecs
import re

#: A decimal number, or what YAML and C call a value that is none.
_NUMBER = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?|[-+]?\.?(?:inf|nan|infinity)",
                     re.IGNORECASE | re.ASCII)

#: Most characters of a number; a longer one is none, and would take long to parse.
_LONGEST = 400

#: Most characters of a file's text in an error.
_QUOTED = 40

#: Encodings that a byte order mark names. UTF-32 is first: its mark begins with that of UTF-16.
_MARKS = ((codecs.BOM_UTF32_LE, "utf-32"), (codecs.BOM_UTF32_BE, "utf-32"), (codecs.BOM_UTF8, "utf-8-sig"),
          (codecs.BOM_UTF16_LE, "utf-16"), (codecs.BOM_UTF16_BE, "utf-16"))


def decode_text(data: bytes) -> str:
    """Return the text of a file, without its byte order mark; UTF-8 if it has none. Raise UnicodeDecodeError."""
    encoding = next((name for mark, name in _MARKS if data.startswith(mark)), "utf-8")
    return data.decode(encoding)


def parse_number(text: object) -> float:
    """Return a decimal number, maybe nan or infinite; raise ValueError, also for 1_000, True, 0x10 and 1:30."""
    if not isinstance(text, str) or len(text) > _LONGEST or not _NUMBER.fullmatch(text.strip()):
        raise ValueError(f"{quote(text)} is not a number")
    return float(text.strip().lower().replace(".inf", "inf").replace(".nan", "nan"))


def quote(value: object) -> str:
    """Return a value of a file for an error: one short line, in quotes if it is text."""
    if value is None:
        return "nothing"
    if not isinstance(value, (str, int, float)):
        return "a list" if isinstance(value, (list, tuple)) else "a group of values"
    text = ascii(value) if isinstance(value, str) else f"{value:.17g}" if isinstance(value, float) else f"{value:d}"
    return text if len(text) <= _QUOTED else f"{text[:_QUOTED]}..."
