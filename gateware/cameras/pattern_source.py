#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *
from migen.genlib.cdc import MultiReg

from litex.gen import *

from .dvp_signals  import DVPFormat, DVPSignals
from .test_pattern import BLANKING_BITS, TestPattern

# Pattern Source -----------------------------------------------------------------------------------

class PatternSource(LiteXModule):
    """The signals of a sensor or of a test pattern, as registers of the system choose, for the capture of that sensor.

    The settings are in the domain of the system, and cross bit by bit: they hold while the domain of the pixel clock is
    out of reset. They arrive there before a reset that is released as late or later, and crosses as they do, ends.

    It is reset with its clock domains.

    Parameters
    ----------
    parameters : CameraParameters
        What is built.
    cd_pixel : str
        Domain of the pixel clock.
    """
    def __init__(self, parameters, cd_pixel):
        self.sensor         = DVPSignals()          # In `cd_pixel`: signals of the sensor.
        self.source         = DVPSignals()          # In `cd_pixel`: those of the sensor or of the pattern.
        self.source_format  = DVPFormat()           # In `cd_pixel`: how they are used.
        self.format         = DVPFormat()           # How the sensor uses its signals, and the pattern too.
        self.pattern        = Signal()              # Show the pattern.
        self.width          = Signal(max=parameters.max_width + 1)  # Size of the pattern: columns,
        self.height         = Signal(max=parameters.max_height + 1) # and rows.
        self.shift          = Signal(8)             # Pixels by which it is moved to the left.
        self.row_blanking   = Signal(BLANKING_BITS) # Its clocks between rows,
        self.frame_blanking = Signal(BLANKING_BITS) # and frames.

        # # #

        self.noise = noise = ClockDomainsRenamer(cd_pixel)(TestPattern(parameters))
        names    = ("width", "height", "shift", "row_blanking", "frame_blanking")
        settings = Cat(self.pattern, self.format.raw_bits(), *[getattr(self, name) for name in names])
        chosen   = Signal()
        arrived  = Cat(chosen, self.source_format.raw_bits(), *[getattr(noise, name) for name in names])
        self.specials += MultiReg(settings, arrived, cd_pixel)
        self.comb += [
            noise.format.eq(self.source_format),
            noise.run.eq(chosen),
            self.source.eq(self.sensor),
            If(chosen,
                self.source.eq(noise.sensor)
            ),
        ]
