#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from ..common import PIXEL_BITS

# DVP ----------------------------------------------------------------------------------------------

class DVPSignals(Record):
    """The signals of a sensor with a parallel port, in the domain of its pixel clock."""
    def __init__(self, name=None):
        Record.__init__(self, [("data", PIXEL_BITS), ("href", 1), ("vsync", 1)], name=name)

class DVPFormat(Record):
    """How a sensor uses its signals. It is set before the capture is released from reset, and then holds.

    - ``two_bytes``: a pixel is two bytes, as YUYV; otherwise one.
    - ``grey_second``: the second of the two bytes is the grey value; otherwise the first.
    - ``href_low``: HREF is 0 during the bytes of a row; otherwise 1.
    - ``vsync_low``: VSYNC is 0 during a frame, as with a pulse between frames; otherwise 1.
    """
    def __init__(self, name=None):
        Record.__init__(self, [("two_bytes", 1), ("grey_second", 1), ("href_low", 1), ("vsync_low", 1)], name=name)
