#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What a device can have: the bits of its word `features`, and numbered values that come on top.

The source for gateware, firmware, host tools and documents.

`python -m litestereo.soc.reports.tables` writes what is generated from it.
"""

from __future__ import annotations

from dataclasses import dataclass

# Features -----------------------------------------------------------------------------------------

@dataclass(frozen=True)
class Feature:
    """A bit of the word `features`.

    Parameters
    ----------
    bit : int
        Number of the bit; it never changes its meaning.
    name : str
        Name in all programs and documents.
    text : str
        What a device with the bit has, as the object of a sentence.
    kind : str
        "stage": an optional stage of the matcher, in the register `features`; "peripheral": cores around the matcher,
        in that register if they are built; "device": the firmware adds the bit; "reserved": no device sets the bit yet.
    note : str
        What docs/protocol.md adds to the text.
    """
    bit:  int
    name: str
    text: str
    kind: str
    note: str = ""

FEATURE_TABLE = (
    Feature( 0, "xsobel",        "the XSOBEL prefilter",                    "stage"),
    Feature( 1, "raw",           "matching without prefilter",              "stage"),
    Feature( 2, "texture",       "the texture test",                        "stage"),
    Feature( 3, "uniqueness",    "the uniqueness test",                     "stage"),
    Feature( 4, "subpixel",      "fractions of a pixel",                    "stage"),
    Feature( 5, "left_right",    "the left-right check",                    "stage"),
    Feature( 6, "min_disparity", "a smallest disparity above 0",            "stage"),
    Feature( 7, "median",        "the median",                              "stage"),
    Feature( 8, "streaming",     "streamed frames",                         "device",
        "over UDP only: [how](#streamed-frames)"),
    Feature( 9, "update",        "a flash whose firmware can be replaced",  "device", "[how](#updates)"),
    Feature(10, "rectification", "rectification of the pair",               "peripheral", "[how](#rectification)"),
    Feature(11, "cameras",       "cameras on the device",                   "peripheral", "[what](cameras.md)"),
    Feature(12, "semi_global",   "semi-global matching",                    "reserved"),
    Feature(13, "census",        "the census transform",                    "reserved"),
    Feature(14, "confidence",    "a confidence for each disparity",         "reserved"),
)

# Optional stages of the matcher by name, in the order of their bits.
FEATURES = tuple(one.name for one in FEATURE_TABLE if one.kind == "stage")

# What a peripheral has around its matcher.
PERIPHERAL_FEATURES = tuple(one.name for one in FEATURE_TABLE if one.kind == "peripheral")

# Capabilities -------------------------------------------------------------------------------------

@dataclass(frozen=True)
class Capability:
    """A value that a device tells after the fixed fields of its capabilities.

    The list grows without a new version of the protocol: a host skips the numbers that it does not know, and an absent
    one is 0. So 0 must mean what all devices were before the number came.

    Parameters
    ----------
    number : int
        Number in the protocol, from 1 on and without gaps; it never changes its meaning.
    name : str
        Name in all programs and documents.
    text : str
        What it is, without capital letter and full stop.
    unit : str
        Unit, if it has one.
    """
    number: int
    name:   str
    text:   str
    unit:   str = ""

CAPABILITY_TABLE = (
    Capability(1, "dma_alignment", "alignment of images and maps in the device's memory",       "bytes"),
    Capability(2, "update_bytes",  "largest firmware that an update can write, 0 without flash", "bytes"),
    Capability(3, "max_prefilter_cap", "largest `prefilter_cap`, 0: all of its range"),
    Capability(4, "rectification_rows",   "rows of the raw images that the rectification keeps", "rows"),
    Capability(5, "rectification_height", "highest frame that can be rectified",                 "pixels"),
)
