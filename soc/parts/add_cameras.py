#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from collections.abc import Sequence

from migen import *
from migen.fhdl.specials import Tristate

from ...gateware.cameras.layouts     import SIDES
from ...gateware.cameras.parameters  import CameraParameters
from ...gateware.common.parameters   import check
from ...gateware.peripherals.cameras import CameraPeripheral
from .dma_checks                     import DMAChecks

# Clocks of `sys` in a pixel clock of the test pattern, where it replaces sensors.
PATTERN_DIVIDER = 4

# Pads that every sensor has.
SENSOR_PADS = ("data", "href", "vsync", "pclk")

# Cameras Mixin ------------------------------------------------------------------------------------

class CamerasMixin(DMAChecks):
    """Gives a LiteX SoC with a matcher the method `add_cameras`: `class MySoC(CamerasMixin, StereoMixin, SoCCore)`."""

    def add_cameras(self, parameters=None, sensors=None, i2c=None, pixel_clk_freq=None, name="cameras",
        stereo="stereo"):
        """Add two cameras, whose pairs go to the matcher, with registers and an interrupt.

        Parameters
        ----------
        parameters : CameraParameters, optional
            What is built; by default frames as wide as the matcher's.
        sensors : sequence of two Records of pads, optional
            Left and right sensor: `data` (8 bits), `href`, `vsync`, `pclk`, and of `reset_n`, `sleep`, `trigger` those
            that it has. Without sensors their test patterns take their places, on a quarter of the clock of `sys`.
        i2c : Record of pads, optional
            `scl`, `left_sda`, `right_sda`. Without these pads the lines are high unless they are pulled down.
        pixel_clk_freq : float, optional
            Highest frequency of the pixel clocks in Hz, for the constraint of their period; needed with sensors.
        name : str
            Prefix of the registers, and name of the interrupt; a C identifier.
        stereo : str
            Name of the matcher, which was added before, with the feature "cameras".

        Raises
        ------
        ValueError
            A parameter is not as above, or a frame link that streams was added before.
        """
        self.check_dma_name(name)
        self.check_if_exists(name)
        matcher    = self.check_cameras_matcher(stereo)
        parameters = parameters or CameraParameters(max_width=matcher.parameters.max_width)
        check(parameters.max_width <= matcher.parameters.max_width,
            f"max_width of the cameras must be at most that of the matcher, {matcher.parameters.max_width}, not "
            f"{parameters.max_width}.")
        self.check_sensors(sensors, i2c, pixel_clk_freq)
        cameras = CameraPeripheral(parameters)
        self.comb += [
            cameras.source.connect(matcher.pairs),
            cameras.open.eq(matcher.takes_pairs()),
        ]
        # The frame link's place.
        matcher.entry = cameras.others
        if sensors is None:
            self.connect_patterns(cameras)
        else:
            self.connect_sensors(cameras, sensors, pixel_clk_freq)
        self.connect_i2c(cameras, i2c)
        self.add_module(name=name, module=cameras)
        if self.irq.enabled:
            self.irq.add(name, use_loc_if_exists=True)

    # Checks -----------------------------------------------------------------------------------------

    def check_cameras_matcher(self, stereo):
        """Return the matcher of that name; raise ValueError if there is none, or cameras cannot be added to it."""
        matcher = getattr(self, stereo, None)
        check(matcher is not None, f"cameras need a matcher: there is no {stereo}; call add_stereo before.")
        check("cameras" in matcher.parameters.features,
            f"cameras need a matcher with the feature cameras: add it to the features of {stereo}.")
        check(not hasattr(matcher, "entry"), f"{stereo} has cameras already.")
        check(not hasattr(matcher, "streams"),
            f"the frame link streams to {stereo} already: add the cameras before the frame link.")
        return matcher

    def check_sensors(self, sensors, i2c, pixel_clk_freq):
        """Raise ValueError unless there are all pads and the frequency that sensors need."""
        if i2c is not None:
            missing = [pad for pad in ("scl", "left_sda", "right_sda") if not hasattr(i2c, pad)]
            check(not missing, f"i2c needs the pads scl, left_sda and right_sda: {', '.join(missing)} is missing.")
        if sensors is None:
            return
        check(isinstance(sensors, Sequence) and len(sensors) == len(SIDES),
            "sensors must be the pads of two sensors, the left one first.")
        for side, pads in zip(SIDES, sensors):
            missing = [pad for pad in SENSOR_PADS if not hasattr(pads, pad)]
            check(not missing, f"the {side} sensor needs the pads {', '.join(SENSOR_PADS)}: {', '.join(missing)} is "
                "missing.")
            check(len(pads.data) == 8, f"the {side} sensor needs 8 pads of data, not {len(pads.data)}.")
        check(pixel_clk_freq is not None and 0 < pixel_clk_freq < self.clk_freq,
            f"pixel_clk_freq must be the frequency of the pixel clocks in Hz, below that of sys, {self.clk_freq}, not "
            f"{pixel_clk_freq}.")

    # Connections ------------------------------------------------------------------------------------

    def connect_patterns(self, cameras):
        """Give both cameras one clock, for their test patterns."""
        count = Signal(max=PATTERN_DIVIDER)
        self.sync += count.eq(count + 1)
        self.comb += [camera.pixel_clk.eq(count[-1]) for camera in cameras.cameras]

    def connect_sensors(self, cameras, sensors, pixel_clk_freq):
        """Connect the pads of both sensors, and constrain their clocks."""
        for number, (camera, pads) in enumerate(zip(cameras.cameras, sensors)):
            self.comb += [
                camera.pixel_clk.eq(pads.pclk),
                camera.sensor.data.eq(pads.data),
                camera.sensor.href.eq(pads.href),
                camera.sensor.vsync.eq(pads.vsync),
            ]
            for pad, value in (("reset_n", ~cameras.restart[number]), ("sleep", cameras.sleep[number]),
                ("trigger", cameras.trigger)):
                if hasattr(pads, pad):
                    self.comb += getattr(pads, pad).eq(value)
            # A simulation has no constraints.
            if hasattr(self.platform.toolchain, "add_period_constraint"):
                self.platform.add_period_constraint(pads.pclk, 1e9/pixel_clk_freq)

    def connect_i2c(self, cameras, i2c):
        """Connect the lines of I2C, which are never driven high."""
        lines = {
            "scl":       (cameras.scl_low,    cameras.scl_i),
            "left_sda":  (cameras.sda_low[0], cameras.sda_i[0]),
            "right_sda": (cameras.sda_low[1], cameras.sda_i[1]),
        }
        for name, (low, line) in lines.items():
            if i2c is None:
                self.comb += line.eq(~low)
            else:
                self.specials += Tristate(getattr(i2c, name), Constant(0), low, line)
