#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *

from litex.soc.interconnect.csr              import *
from litex.soc.interconnect.csr_eventmanager import *
from litex.soc.integration.doc               import ModuleDoc

from ..common                 import *
from ..common.features        import FEATURE_TABLE
from ..matcher.frame_settings import OPTIONS, REGISTERS, added_options, added_registers
from .grid_port               import GridPort
from .rectification           import rectifier_parameters

VERSION = (0, 4) # Of the register interface: major, minor.

# What software does, above the registers in their document.
INTRO = """Stereo matcher

Computes the disparity map of a rectified pair of 8-bit grey images, from memory to memory.

To match a pair: write the bases, the size and the settings; write 1 to ``start`` in ``control``; wait for the
``done`` or ``error`` event; read ``status``. All settings are taken over at ``start``, so those of the next
frame may be written meanwhile. Images and map are in raster order without padding between rows; one byte is
a pixel of an image, an int16 in sixteenths of a pixel one of the map, (``min_disparity`` - 1) x 16 where there
is no disparity. Whole words are written: up to ``dma_alignment`` - 2 bytes after the map get undefined values.

A CPU that caches has to invalidate its lines of the map before it reads them.

To load a grid of the rectification, for each camera: write ``place`` with node 0; write ``node`` for all nodes
in raster order; read ``rectification``: ``lost`` must be 0. Then write ``grid0_size`` or ``grid1_size``. A frame
has one of the grids from its begin to its end.
"""

# Peripheral CSR -----------------------------------------------------------------------------------

class PeripheralCSR:
    """Registers and interrupts of the peripheral."""

    def add_irq(self):
        """Add the events."""
        self.ev        = EventManager()
        self.ev.done   = EventSourcePulse(description="The disparity map of the frame is in memory.")
        self.ev.error  = EventSourcePulse(description="The frame was refused or given up: see ``status``.")
        self.ev.finalize()
        self.comb += [
            self.ev.done.trigger.eq(self.done),
            self.ev.error.trigger.eq(self.failed),
        ]

    def add_csr(self):
        """Add the registers, in the order of their addresses."""
        self.intro = ModuleDoc(INTRO)
        self.add_setting_registers()
        self.add_control_registers()
        self.add_measurements()
        self.add_capabilities()
        if "rectification" in self.parameters.features:
            self.add_rectification_registers()

    def add_setting_registers(self):
        """A register for each setting, and the register `options` for those of one bit."""
        for register in REGISTERS:
            self.add_setting_register(*register)
        options = OPTIONS + added_options(self.parameters.features)
        self._options = CSRStorage(name="options", fields=[
            CSRField(name, size=1, offset=bit, description=text) for name, bit, text in options])
        self.comb += [getattr(self, name).eq(getattr(self._options.fields, name)) for name, *_ in options]

    def add_setting_register(self, name, bits, text):
        """A register whose value is the setting of its name."""
        storage = CSRStorage(bits, name=name, description=text)
        setattr(self, f"_{name}", storage)
        self.comb += getattr(self, name).eq(storage.storage)

    def add_control_registers(self):
        """Begin of a frame, and how it ended."""
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

    def add_measurements(self):
        """What was measured of the last frame."""
        def measurement(name, description):
            status = CSRStatus(32, name=name, description=description)
            setattr(self, f"_{name}", status)
            self.comb += status.status.eq(getattr(self, name))

        measurement("clocks",           "Clocks of the last frame, from start until its map is in memory.")
        measurement("first_row_clocks", "Clocks from start to the end of the first row that has disparities.")
        measurement("frames",           "Frames done since reset.")

    def add_capabilities(self):
        """What was built: registers of fixed value."""
        def capability(name, size, value, description):
            setattr(self, f"_{name}", CSRStatus(size, reset=value, name=name, description=description))

        built = self.parameters
        capability("version",         16, VERSION[0]*256 + VERSION[1], "Register interface: major x 256 + minor.")
        capability("max_width",       16, built.max_width,             "Widest frame, pixels.")
        capability("max_disparities",  9, built.disparities,           "Largest number of disparities.")
        capability("block_sizes",     16, MIN_BLOCK_SIZE | built.max_block_size << 8,
            "Smallest block size in bits 0 to 7, largest in bits 8 to 15.")
        capability("max_prefilter_cap", 6, built.max_prefilter_cap,    "Largest cap of the prefilter.")
        self._features = CSRStatus(name="features", fields=[
            CSRField(one.name, size=1, offset=one.bit, reset=int(one.name in built.features),
                description=f"{one.text[0].upper()}{one.text[1:]}.")
            for one in FEATURE_TABLE if one.kind == "stage" or one.name in built.features])
        capability("dma_alignment",    8, self.alignment,              "Alignment of the bases, bytes.")

    def add_rectification_registers(self):
        """Load grids, place the images that come out, and tell how the rectification went."""
        for register in added_registers(self.parameters.features):
            self.add_setting_register(*register)
        built       = rectifier_parameters(self.parameters)
        self._place = CSRStorage(name="place", fields=[
            CSRField("node",   size=16, offset=0,  description="Number of the node, in raster order."),
            CSRField("grid",   size=1,  offset=16, description="Grid that it belongs to."),
            CSRField("camera", size=1,  offset=17, description="0: of the left image, 1: of the right one."),
        ])
        self._node = CSRStorage(32, name="node", description="Displacement of a node in 128ths of a pixel, two's "
            "complement: columns in bits 0 to 15, rows in bits 16 to 31. A write loads it to the ``place``, then the "
            "next one follows, and the size of the grid becomes 0.")
        self._grid0_size = self.make_grid_size(0)
        self._grid1_size = self.make_grid_size(1)
        self._rectification = CSRStatus(name="rectification", fields=[
            CSRField("row_gone", size=1, offset=0,
                description="The last frame's map needs more rows at once than ``rows``: pixels of it are black."),
            CSRField("folded",   size=1, offset=1, description="The last frame's map folds over."),
            CSRField("lost",     size=1, offset=2, description="Since the last write of ``place`` a node was not "
                "loaded: a frame was under way with its grid, or there is no such node."),
        ])
        self._rows = CSRStatus(32, reset=built.rows | built.max_height << 16, name="rows",
            description="Rows of each camera that are kept in bits 0 to 15, rows of the highest frame that can be "
            "rectified in bits 16 to 31.")
        self.add_grid_port(built)

    def make_grid_size(self, number):
        """Return the register with the size that a grid was loaded for."""
        return CSRStorage(32, name=f"grid{number}_size", write_from_dev=True, description="Size of the frames that "
            f"grid {number} is for: columns in bits 0 to 15, rows in bits 16 to 31. 0: none. Write it when all nodes "
            "are loaded.")

    def add_grid_port(self, built):
        """Connect the registers of the grids."""
        self.grid_port = port = GridPort(built)
        place          = self._place.fields
        sizes          = [self._grid0_size, self._grid1_size]
        self.comb += [
            port.camera.eq(place.camera),
            port.grid.eq(place.grid),
            port.node.eq(place.node),
            port.move.eq(self._place.re),
            port.value.eq(self._node.storage),
            port.write.eq(self._node.re),
            port.dropped.eq(self.dropped),
            port.source.connect(self.load),
            Cat(self.grid_width, self.grid_height).eq(Mux(self.grid, sizes[1].storage, sizes[0].storage)),
            self._rectification.fields.row_gone.eq(self.row_gone),
            self._rectification.fields.folded.eq(self.folded),
            self._rectification.fields.lost.eq(port.lost),
        ]
        for number, size in enumerate(sizes):
            self.comb += size.we.eq(port.damaged[number])
