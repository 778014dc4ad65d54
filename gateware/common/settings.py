#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The settings of a frame: the source for registers, firmware, host tools and documents. It needs no migen.

`python -m litestereo.soc.reports.tables` writes what is generated from it.
"""

from __future__ import annotations

from dataclasses import dataclass, field

MAX_WIDTH  = 4096
MAX_HEIGHT = 4095

@dataclass(frozen=True)
class Setting:
    """A setting of the matcher, which is also a parameter of the link protocol.

    Parameters
    ----------
    number : int
        Number in the link protocol. The numbers have no gaps.
    name : str
        Name in all programs and documents: that of cv2.StereoBM where it has the setting.
    text : str
        What it is, as help has it: without capital letter and full stop.
    least, most : int
        Range of the values that can be sent; where `built` is given, the device may have a narrower one.
    step : int
        Distance of the values, a power of two: 1, 2 for odd numbers, 16 for its multiples.
    default : int
        Value after a session's begin, as far as its feature is built.
    bits : int
        Width of the register field.
    unit : str
        Unit, if it has one.
    off : int, optional
        Value that switches the setting off, and so needs no `feature`.
    off_text : str
        What `off` means, if it is a number among others.
    feature : str
        Feature that all values but `off` need.
    off_feature : str
        Feature that `off` needs.
    values : tuple of str
        Names of the values 0, 1, ..., where they are a choice and no number.
    choice : bool
        Whether host tools call the values by these names; otherwise they are False and True.
    unused_without : str
        Setting without which this one has no effect.
    built : tuple of str
        Limit of the device that narrows the range: the register that tells it, and what the protocol calls it.
    limit : str
        Register that tells a smaller `most`, where the device can be built for less than the range.
    opencv_default : int, optional
        cv2.StereoBM's default, if it is another one.
    option : str
        Name of its field in the register `options`; otherwise the setting has a register called as it is.
    option_bit : int
        Place of that field; it never changes its meaning. `FRAME_OPTIONS` has places too.
    register_off : int, optional
        `off` as the register holds it, if it is another value there.
    """
    number:         int
    name:           str
    text:           str
    least:          int
    most:           int
    default:        int
    bits:           int
    step:           int             = 1
    unit:           str             = ""
    off:            int | None      = None
    off_text:       str             = ""
    feature:        str             = ""
    off_feature:    str             = ""
    values:         tuple[str, ...] = field(default=())
    choice:         bool            = False
    unused_without: str             = ""
    built:          tuple[str, ...] = field(default=())
    limit:          str             = ""
    opencv_default: int | None      = None
    option:         str             = ""
    option_bit:     int             = 0
    register_off:   int | None      = None

    @property
    def register(self) -> str:
        """Name of the register, or of the field of `options`."""
        return self.option or self.name

    @property
    def off_in_register(self) -> int | None:
        """`off` as the register holds it."""
        return self.off if self.register_off is None else self.register_off

    @property
    def range_text(self) -> str:
        """The values that are legal, in words."""
        kind  = {1: "", 2: "odd, ", 16: "a multiple of 16, "}[self.step]
        least = 0 if self.off is not None and self.off < 0 else self.least
        return f"{kind}{least} or more" if self.built else f"{kind}{least} to {self.most}"

    @property
    def register_text(self) -> str:
        """Description of the register or field."""
        if self.option:
            return f"{self.text[0].upper()}{self.text[1:]}."
        limit     = f", up to {self.built[0]}" if self.built else f", up to ``{self.limit}``" if self.limit else ""
        unit      = f" {self.unit}" if self.unit else ""
        sentences = [f"{self.text[0].upper()}{self.text[1:]}, {self.range_text}{limit}{unit}."]
        if self.off_text:
            sentences.append(f"{self.off_in_register}: {self.off_text}.")
        if self.unused_without:
            sentences.append(f"Unused without ``{setting(self.unused_without).register}``.")
        return " ".join(sentences)

# The defaults are cv2.StereoBM's but for the block size: 9 is the largest one that every board is built for.
SETTINGS = (
    Setting(1, "disparities", "number of disparities searched",
        least=16, most=256, step=16, default=64, bits=9, built=("``max_disparities``", "number")),
    Setting(2, "block_size", "side of the block in pixels",
        least=5, most=255, step=2, default=9, opencv_default=21, bits=6,
        built=("the largest of ``block_sizes``", "maximum")),
    Setting(3, "min_disparity", "smallest disparity searched",
        least=0, most=255, default=0, off=0, bits=8, unit="pixels", feature="min_disparity"),
    Setting(4, "prefilter", "XSOBEL prefilter; otherwise grey values as they are, and no texture test",
        least=0, most=1, default=1, off=0, bits=1, values=("none", "xsobel"), choice=True, feature="xsobel",
        off_feature="raw", option="xsobel", option_bit=0),
    Setting(5, "prefilter_cap", "largest slope that the prefilter keeps",
        least=1, most=63, default=31, bits=6, unused_without="prefilter", limit="max_prefilter_cap"),
    Setting(6, "texture_threshold", "least sum of the prefilter's slopes in a block",
        least=0, most=2**20 - 1, default=10, off=0, off_text="no test", bits=20, feature="texture",
        unused_without="prefilter"),
    Setting(7, "uniqueness_ratio", "percent by which the cost of any other disparity must be larger",
        least=0, most=100, default=15, off=0, off_text="no test", bits=7, feature="uniqueness"),
    Setting(8, "disp12_max_diff", "largest difference in the left-right check",
        least=-1, most=254, default=-1, off=-1, off_text="no check", bits=8, unit="pixels", feature="left_right",
        register_off=255),
    Setting(9, "subpixel", "sixteenths of a pixel; otherwise whole pixels",
        least=0, most=1, default=1, off=0, bits=1, values=("whole pixels", "sixteenths"), feature="subpixel",
        option="subpixel", option_bit=1),
    Setting(10, "median", "median of 3x3 pixels as the last step",
        least=0, most=1, default=0, off=0, bits=1, values=("off", "on"), feature="median",
        option="median", option_bit=2),
)

@dataclass(frozen=True)
class FrameRegister:
    """A register of a frame that is no setting of the matcher: where the images are, and their size.

    With `feature` there is such a register only if that feature is built.
    """
    name:    str
    bits:    int
    text:    str
    feature: str = ""

FRAME_REGISTERS = (
    FrameRegister("left_base",      32, "Byte address of the left image, a multiple of ``dma_alignment``."),
    FrameRegister("right_base",     32, "Byte address of the right image, a multiple of ``dma_alignment``."),
    FrameRegister("disparity_base", 32, "Byte address of the map, a multiple of ``dma_alignment``."),
    FrameRegister("width",          16, "Columns of the images, from ``min_disparity`` + ``disparities`` + "
                                        "``block_size`` - 1 to ``max_width``."),
    FrameRegister("height",         16, f"Rows of the images, from ``block_size`` to {MAX_HEIGHT}."),
    FrameRegister("left_out_base",  32, "Byte address for the left image as the matcher gets it, a multiple of "
                                        "``dma_alignment``.", "rectification"),
    FrameRegister("right_out_base", 32, "Byte address for the right one, a multiple of ``dma_alignment``.",
                                        "rectification"),
)

@dataclass(frozen=True)
class FrameOption:
    """A field of the register `options` that is no setting of the matcher; with `feature`, only if that is built."""
    name:    str
    bit:     int
    text:    str
    feature: str = ""

FRAME_OPTIONS = (
    FrameOption("streamed", 3, "Pixels come from a stream, and ``left_base`` and ``right_base`` are not read."),
    FrameOption("rectified", 4, "The pair is rectified by a grid, which must be loaded for ``width`` and ``height``.",
        "rectification"),
    FrameOption("grid", 5, "Grid by which it is rectified.", "rectification"),
    FrameOption("left_out", 6, "Write the left image as the matcher gets it to ``left_out_base``.", "rectification"),
    FrameOption("right_out", 7, "Write the right one to ``right_out_base``.", "rectification"),
)

def setting(name: str) -> Setting:
    """Return the setting of a name; raises KeyError if there is none."""
    return {one.name: one for one in SETTINGS}[name]
