#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.soc.interconnect.csr              import *
from litex.soc.interconnect.csr_eventmanager import *
from litex.soc.integration.doc               import ModuleDoc

from ..common                 import *
from ..matcher.frame_settings import OPTIONS, frame_settings

VERSION = (0, 3) # Of the register interface: major, minor.

# What the registers of the settings are described as.
SETTING_DESCRIPTIONS = {
    "left_base":         "Byte address of the left image, a multiple of ``dma_alignment``.",
    "right_base":        "Byte address of the right image, a multiple of ``dma_alignment``.",
    "disparity_base":    "Byte address of the map, a multiple of ``dma_alignment``.",
    "width":             "Columns of the images, from ``min_disparity`` + ``disparities`` + ``block_size`` - 1 to "
                         "``max_width``.",
    "height":            "Rows of the images, from ``block_size`` to 4095.",
    "disparities":       "Disparities to search: a multiple of 16 up to ``max_disparities``.",
    "block_size":        "Side of the block in pixels, odd, within ``block_sizes``.",
    "min_disparity":     "Smallest disparity, pixels.",
    "prefilter_cap":     "Largest slope that the prefilter keeps, 1 to 63. Unused without ``xsobel``.",
    "texture_threshold": "Least sum over the block of what the filtered left image differs from flat. Unused without "
                         "``xsobel``.",
    "uniqueness_ratio":  "Percent, 0 to 100, by which all other disparities must cost more than the winner. "
                         "0: no test.",
    "disp12_max_diff":   "Largest difference in the left-right check, pixels. 255: no check.",
}

OPTION_DESCRIPTIONS = {
    "xsobel":   "Filter the images (PREFILTER_XSOBEL); otherwise match grey values as they are.",
    "subpixel": "Sixteenths of a pixel; otherwise whole pixels.",
    "median":   "Median of 3x3 pixels as the last step.",
    "streamed": "Pixels come from a stream past memory; ``left_base`` and ``right_base`` are not read.",
}

FEATURE_DESCRIPTIONS = {
    "xsobel":        "Prefilter XSOBEL.",
    "raw":           "Matching without prefilter.",
    "texture":       "Test of the texture.",
    "uniqueness":    "Test of the uniqueness.",
    "subpixel":      "Sixteenths of a pixel.",
    "left_right":    "Left-right check.",
    "min_disparity": "A smallest disparity above 0.",
    "median":        "Median of the map.",
}

# Peripheral CSR -----------------------------------------------------------------------------------

class PeripheralCSR:
    """Registers and interrupts of the peripheral."""

    def add_irq(self):
        self.ev        = EventManager()
        self.ev.done   = EventSourcePulse(description="The disparity map of the frame is in memory.")
        self.ev.error  = EventSourcePulse(description="The frame was refused or given up: see ``status``.")
        self.ev.finalize()
        self.comb += [
            self.ev.done.trigger.eq(self.done),
            self.ev.error.trigger.eq(self.failed),
        ]

    def add_csr(self):
        self.intro = ModuleDoc("""Stereo matcher

        Computes the disparity map of a rectified pair of 8-bit grey images, from memory to memory.

        To match a pair: write the bases, the size and the settings; write 1 to ``start`` in ``control``; wait for the
        ``done`` or ``error`` event; read ``status``. All settings are taken over at ``start``, so those of the next
        frame may be written meanwhile. Images and map are in raster order without padding between rows; one byte is
        a pixel of an image, an int16 in sixteenths of a pixel one of the map, (``min_disparity`` - 1) x 16 where there
        is no disparity. Whole words are written: up to ``dma_alignment`` - 2 bytes behind the map are overwritten \
with undefined values.

        A CPU that caches has to invalidate its lines of the map before it reads them.
        """)
        built = self.parameters

        # Settings.
        # ---------
        for name, bits in frame_settings():
            if name in OPTIONS:
                continue
            storage = CSRStorage(bits, name=name, description=SETTING_DESCRIPTIONS[name])
            setattr(self, f"_{name}", storage)
            self.comb += getattr(self, name).eq(storage.storage)
        self._options = CSRStorage(name="options", fields=[
            CSRField(name, size=1, description=OPTION_DESCRIPTIONS[name]) for name in OPTIONS])
        self.comb += [getattr(self, name).eq(getattr(self._options.fields, name)) for name in OPTIONS]

        # Control and status.
        # -------------------
        self._control = CSRStorage(name="control", fields=[
            CSRField("start", size=1, pulse=True, description="Write 1 to begin a frame. Ignored while busy."),
            CSRField("abort", size=1, pulse=True, description="Write 1 to give the frame up. Ignored while idle."),
        ])
        self._status = CSRStatus(name="status", fields=[
            CSRField("busy",  size=1, offset=0, description="A frame is under way."),
            CSRField("error", size=4, offset=8, description="How the last frame ended.", values=[
                ("``0``", "Well, or it has not ended yet."),
                ("``1``", "Refused: a setting is out of range or a base is not aligned."),
                ("``2``", "Given up: the bus answered with an error."),
                ("``3``", "Given up: aborted."),
            ]),
        ])
        self.comb += [
            self.start.eq(self._control.fields.start),
            self.abort.eq(self._control.fields.abort),
            self._status.fields.busy.eq(self.busy),
            self._status.fields.error.eq(self.error_code),
        ]

        # Measurements.
        # -------------
        def measurement(name, description):
            status = CSRStatus(32, name=name, description=description)
            setattr(self, f"_{name}", status)
            self.comb += status.status.eq(getattr(self, name))

        measurement("clocks",           "Clocks of the last frame, from start until its map is in memory.")
        measurement("first_row_clocks", "Clocks from start to the end of the first row that has disparities.")
        measurement("frames",           "Frames done since reset.")

        # Capabilities.
        # -------------
        def capability(name, size, value, description):
            setattr(self, f"_{name}", CSRStatus(size, reset=value, name=name, description=description))

        capability("version",         16, VERSION[0]*256 + VERSION[1], "Register interface: major x 256 + minor.")
        capability("max_width",       16, built.max_width,             "Widest frame, pixels.")
        capability("max_disparities",  9, built.disparities,           "Largest number of disparities.")
        capability("block_sizes",     16, MIN_BLOCK_SIZE | built.max_block_size << 8,
            "Smallest block size in bits 0 to 7, largest in bits 8 to 15.")
        self._features = CSRStatus(name="features", fields=[
            CSRField(name, size=1, reset=int(name in built.features), description=FEATURE_DESCRIPTIONS[name])
            for name in FEATURES])
        capability("dma_alignment",    8, self.alignment,              "Alignment of the bases, bytes.")
