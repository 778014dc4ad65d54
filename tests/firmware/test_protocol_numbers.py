#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The numbers in the firmware's headers against the tables of docs/protocol.md."""

import re

import pytest

from litestereo.host_tools.core.features import Feature
from support.paths import CHECKOUT

DOCUMENT = (CHECKOUT / "docs" / "protocol.md").read_text()
LINK     = CHECKOUT / "firmware" / "link"
TABLES   = CHECKOUT / "firmware" / "include" / "litestereo" / "stereo_tables.h"
PROTOCOL = "".join(path.read_text() for path in (LINK / "protocol" / "protocol.h", LINK / "protocol" / "parameters.h",
                                                 TABLES))


def section(title):
    """Return the rows of the first table under a heading, as lists of cells."""
    text = re.search(rf"^#+ {title}\n(.*?)(?=^#|\Z)", DOCUMENT, re.MULTILINE | re.DOTALL)[1]
    rows = [line.strip("|").split("|") for line in text.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in row] for row in rows[2:]]


def enumeration(name, prefix):
    body = re.search(rf"enum {name} {{(.*?)}};", PROTOCOL, re.DOTALL)[1]
    return {match[1].lower(): int(match[2], 0) for match in re.finditer(rf"{prefix}(\w+)\s*=\s*(\w+),", body)}


def constant(name):
    return int(re.search(rf"#define {name}\s+(\w+?)u?\n", PROTOCOL)[1], 0)


def test_types():
    documented = {row[1].removeprefix("(only as reply) ").lower(): int(row[0].strip("`"), 16)
                  for row in section("Types")}
    assert enumeration("protocol_type", "TYPE_") == documented


def test_errors():
    documented = {row[1].strip("`").lower(): int(row[0]) for row in section("Errors")}
    assert enumeration("protocol_error", "ERROR_") == {"none": 0} | documented


def test_size_details():
    detail = next(row[2] for row in section("Errors") if row[1] == "`SIZE`")
    assert [int(number) for number in re.findall(r"(\d) too", detail)] \
        == sorted(enumeration("protocol_size", "SIZE_").values())


def test_parameters():
    documented = {row[1].strip("`"): int(row[0]) for row in section("Parameters")}
    assert enumeration("protocol_parameter", "PARAMETER_") == documented


def test_header():
    documented = {row[2].strip("`"): int(row[0]) for row in section("Message") if row[0].isdigit()}
    assert constant("PROTOCOL_HEADER_SIZE") == documented.pop("payload")
    assert enumeration("protocol_header", "HEADER_") == documented


def test_counters():
    documented = [row[1].strip("`") for row in section("Counters")]
    assert [int(row[0]) for row in section("Counters")] == list(range(len(documented)))
    body = re.search(r"enum counter {(.*?)}", (LINK / "counters.h").read_text(), re.DOTALL)[1]
    assert [name.lower() for name in re.findall(r"COUNTER_(\w+)", body)] == documented
    source = (LINK / "counters.c").read_text()
    assert re.findall(r'"(\w+)"', source.split("names[", 1)[1]) == documented


def test_states():
    header     = (LINK / "frame_pool.h").read_text()
    body       = re.search(r"typedef enum {([^}]*FRAME_EMPTY.*?)} frame_state_t", header, re.DOTALL)[1]
    states     = {name.lower(): int(value) for name, value in re.findall(r"FRAME_(\w+)\s*=\s*(\d)", body)}
    documented = next(row[2] for row in section("Frame status") if "`state`" in row[2])
    assert states == {name: int(value) for value, name in re.findall(r"(\d) (\w+)", documented)}


@pytest.mark.parametrize(("field", "prefix", "none"), [("state", "UPDATE_", {}),
                                                       ("failure", "UPDATE_", {"no_failure": 0})])
def test_updates(field, prefix, none):
    header     = (LINK / "update" / "update.h").read_text()
    body       = re.search(rf"typedef enum {{([^}}]*?)}} update_{field}_t", header, re.DOTALL)[1]
    numbers    = {name.lower(): int(value) for name, value in re.findall(rf"{prefix}(\w+)\s*=\s*(\d)", body)}
    documented = next(row[2] for row in section("Progress") if f"`{field}`" in row[2])
    assert numbers == none | {name: int(value) for value, name in re.findall(r"(\d) (\w+)", documented)}


def test_features():
    documented = {row[1].strip("`"): int(row[0]) for row in section("Features")}
    bits       = re.findall(r"LITESTEREO_FEATURE_(\w+)\s*= 1u << +(\d+),", PROTOCOL)
    assert {name.lower(): int(bit) for name, bit in bits} == documented
    assert {feature.name.lower(): feature.value.bit_length() - 1 for feature in Feature} == documented


def test_further_capabilities():
    documented = {row[1].strip("`"): int(row[0]) for row in section("Further capabilities")}
    assert enumeration("litestereo_capability", "LITESTEREO_CAPABILITY_") == documented


@pytest.mark.parametrize(("name", "pattern"), [
    ("PROTOCOL_VERSION",           r"Link protocol, version (\d+)"),
    ("PROTOCOL_MAGIC",             r"\(`(0x\w+)`\)"),
    ("PROTOCOL_CHUNK_SIZE",        r"bytes of payload, 0 to (\d+)"),
    ("PROTOCOL_CAPABILITIES_SIZE", r"name` of the device.*?^(\d+) bytes\."),
    ("PROTOCOL_CAPABILITY_SIZE",   r"any number of values, (\d+) bytes each"),
    ("PROTOCOL_STATUS_SIZE",       r"first missing upload offset while.*?^(\d+) bytes\."),
    ("PROTOCOL_PROGRESS_SIZE",     r"bytes of the longest firmware.*?^(\d+) bytes\. Until"),
    ("PROTOCOL_NO_OFFSET",         r"`(0xf+)` if none is missing"),
])
def test_constants(name, pattern):
    assert constant(name) == int(re.search(pattern, DOCUMENT, re.MULTILINE | re.DOTALL)[1], 0)


def test_lengths_of_a_message():
    shortest, longest = re.search(r"A message is (\d+) to (\d+) bytes long", DOCUMENT).groups()
    assert constant("PROTOCOL_HEADER_SIZE") + constant("PROTOCOL_CRC_SIZE") == int(shortest)
    assert int(shortest) + constant("PROTOCOL_CHUNK_SIZE") == int(longest)
