#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from migen import *
from migen.genlib.cdc import MultiReg

from litex.soc.interconnect.csr              import *
from litex.soc.interconnect.csr_eventmanager import *
from litex.soc.integration.doc               import ModuleDoc

from ..cameras.event_totals     import TOTAL_BITS
from ..cameras.frame_guard      import DAMAGES
from ..cameras.frame_statistics import BINS, LEAST_USABLE, MOST_USABLE
from ..cameras.layouts          import SIDES

CAMERAS_VERSION = (0, 1) # Of the register interface: major, minor.

# What software does, above the registers in their document.
INTRO = """Cameras

Turns the signals of two image sensors into pairs of frames for the stereo matcher. What a pair is, and what becomes of
damaged frames, is in cameras.md.

To begin: set up the sensors with ``pins`` and ``i2c``; write ``left_format`` and ``right_format``, ``size``,
``silence``, ``clock_limit``, ``pair_window``, ``flag_limit`` and ``drop_limit``; then enable both cameras with one
write of ``control``. Formats, and all of the test pattern, hold while a camera is enabled. ``silence``, in clocks of
the system, is longer than the time from a start to the first row, and than a row.

To match a pair: set ``select`` in ``control``, write the settings of the matcher with ``width`` and ``height`` equal to
``size``, and start it with ``streamed`` in its ``options``. It takes the next pair that begins. When the matcher is
done, ``number``, ``exposed``, ``left_stamp``, ``right_stamp`` and ``skew`` are of that pair until the matcher is
started again, and ``flags`` from the event ``pair`` on. A pair at whose start the matcher is not waiting is refused,
and counted. To give a pair up, abort the matcher.

The statistics are of each frame of a sensor, whether it is matched or not. A read is of one frame if ``left_measured``
or ``right_measured`` is the same before and after it. To read the time, write 1 to ``latch``, then read ``now``.
"""

DAMAGE_TEXTS = {
    "short_row":   "a row had too few pixels, and was filled",
    "long_row":    "a row had too many pixels, and was cut off",
    "missing_row": "rows were missing, and were filled",
    "extra_row":   "there were too many rows, and they were cut off",
    "stuck":       "the sensor fell silent, and the frame was filled",
    "overrun":     "pixels were lost, as they came faster than they were taken",
}

# Camera CSR ---------------------------------------------------------------------------------------

class CameraCSR:
    """Registers and interrupts of the cameras."""

    def add_irq(self):
        """Add the events."""
        self.ev                = EventManager()
        self.ev.pair           = EventSourcePulse(description="A pair has ended: see ``flags``.")
        self.ev.damaged        = EventSourcePulse(description="It was damaged, or its skew above ``flag_limit``.")
        self.ev.missed         = EventSourcePulse(description="A frame was alone, or a pair was not given out whole: "
            "see ``pair_counts``, ``pair_losses`` and ``alone_counts``.")
        self.ev.left_measured  = EventSourcePulse(description="A left frame has been measured.")
        self.ev.right_measured = EventSourcePulse(description="A right frame has been measured.")
        self.ev.finalize()
        self.comb += [
            self.ev.pair.trigger.eq(self.join.finished),
            self.ev.damaged.trigger.eq(self.damaged),
            self.ev.missed.trigger.eq(self.missed),
            self.ev.left_measured.trigger.eq(self.cameras[0].statistics.measured),
            self.ev.right_measured.trigger.eq(self.cameras[1].statistics.measured),
        ]

    def add_csr(self):
        """Add the registers, in the order of their addresses."""
        self.intro = ModuleDoc(INTRO)
        self.add_capabilities()
        self.add_control()
        self.add_pins()
        self.add_formats()
        self.add_settings()
        self.add_pair()
        self.add_counts()
        self.add_statistics()

    def add_fields(self, name, description=None, status=False, **fields):
        """Add a register of fields, each (Signal, bit, description), or with options of CSRField after that."""
        register = (CSRStatus if status else CSRStorage)(name=name, description=description, fields=[
            CSRField(field, size=len(signal), offset=bit, description=text, **(options[0] if options else {}))
            for field, (signal, bit, text, *options) in fields.items()])
        setattr(self, f"_{name}", register)
        for field, (signal, *_) in fields.items():
            port = getattr(register.fields, field)
            self.comb += port.eq(signal) if status else signal.eq(port)

    def add_storage(self, name, signal, description):
        """Add a register that drives a Signal."""
        storage = CSRStorage(len(signal), name=name, description=description)
        setattr(self, f"_{name}", storage)
        self.comb += signal.eq(storage.storage)

    def add_status(self, name, signal, description):
        """Add a register that shows a Signal."""
        status = CSRStatus(len(signal), name=name, description=description)
        setattr(self, f"_{name}", status)
        self.comb += status.status.eq(signal)

    def add_constant(self, name, size, value, description):
        """Add a register of fixed value."""
        setattr(self, f"_{name}", CSRStatus(size, reset=value, name=name, description=description))

    def add_capabilities(self):
        """Add what is built."""
        built = self.parameters
        major, minor = CAMERAS_VERSION
        self.add_constant("version",     16, major << 8 | minor, "Register interface: major x 256 + minor.")
        self.add_constant("max_size",    32, built.max_width | built.max_height << 16,
            "Largest frame: columns in bits 0 to 15, rows in bits 16 to 31.")
        self.add_constant("skew_pixels", 17, built.skew_pixels,
            "Pixels of a sensor that are kept while it is ahead of the other one.")

    def add_control(self):
        """Add the switches, and what they lead to."""
        left, right = self.cameras
        triggers    = self.triggers
        self.add_fields("control",
            left_enable   = (left.enable,             0, "Capture the left sensor."),
            right_enable  = (right.enable,            1, "Capture the right sensor."),
            left_pattern  = (left.pattern.pattern,    2, "Show the test pattern instead of the left sensor. It needs "
                "the clock of the sensor."),
            right_pattern = (right.pattern.pattern,   3, "The same of the right one."),
            select        = (self.select,             4, "The matcher gets the pairs of the cameras; otherwise those "
                "of the frame link. Change it only while the matcher is idle."),
            triggers      = (triggers.enable,         5, "Give triggers."),
            free_running  = (self.pairs.free_running, 6, "There are no triggers: ``number`` counts starts."),
        )
        self.add_fields("latch", time=(self.latch, 0, "Write 1 to keep the time in ``now``.", {"pulse": True}))
        self.add_fields("status", status=True,
            left_runs  = (left.capture.watch.runs,  0, "The clock of the left sensor runs."),
            right_runs = (right.capture.watch.runs, 1, "The clock of the right sensor runs."),
            left_busy  = (left.capture.guard.busy,  2, "A frame of the left sensor is under way."),
            right_busy = (right.capture.guard.busy, 3, "A frame of the right sensor is under way."),
            pair_busy  = (self.join.busy,           4, "A pair is under way."),
        )

    def add_pins(self):
        """Add the pins of the sensors, I2C too: software drives them."""
        up = {"reset": 1}
        self.add_fields("pins",
            left_reset  = (self.restart[0], 0, "Reset of the left sensor, 1: active.",  up),
            right_reset = (self.restart[1], 1, "Reset of the right sensor, 1: active.", up),
            left_sleep  = (self.sleep[0],   2, "Power-down of the left sensor, 1: active."),
            right_sleep = (self.sleep[1],   3, "Power-down of the right sensor, 1: active."),
        )
        scl, left_sda, right_sda          = Signal(), Signal(), Signal()
        scl_oe, left_sda_oe, right_sda_oe = Signal(), Signal(), Signal()
        self.add_fields("i2c", "I2C of both sensors, with one clock. A line is pulled down if it is driven with a 0; "
            "otherwise it is released, and a resistor pulls it up.",
            scl          = (scl,          0, "Level of the clock.", up),
            left_sda     = (left_sda,     1, "Level of the left sensor's data.", up),
            right_sda    = (right_sda,    2, "Level of the right sensor's data.", up),
            scl_oe       = (scl_oe,       4, "Drive the clock."),
            left_sda_oe  = (left_sda_oe,  5, "Drive the left sensor's data."),
            right_sda_oe = (right_sda_oe, 6, "Drive the right sensor's data."),
        )
        self.comb += [
            self.scl_low.eq(scl_oe & ~scl),
            self.sda_low[0].eq(left_sda_oe & ~left_sda),
            self.sda_low[1].eq(right_sda_oe & ~right_sda),
        ]
        seen = [Signal(name=f"{name}_seen") for name in ("scl", "left_sda", "right_sda")]
        self.specials += [MultiReg(pin, signal) for pin, signal in zip((self.scl_i, *self.sda_i), seen)]
        self.add_fields("i2c_in", status=True,
            scl       = (seen[0], 0, "Level of the clock's line."),
            left_sda  = (seen[1], 1, "Level of the line of the left sensor's data."),
            right_sda = (seen[2], 2, "Level of the line of the right sensor's data."),
        )

    def add_formats(self):
        """Add how the sensors use their signals."""
        for side, camera in zip(SIDES, self.cameras):
            self.add_fields(f"{side}_format", f"How the {side} sensor uses its signals. Write it while that camera is "
                "not enabled.",
                two_bytes   = (camera.format.two_bytes,   0, "A pixel is two bytes, as YUYV; otherwise one."),
                grey_second = (camera.format.grey_second, 1, "The second of them is the grey value."),
                href_low    = (camera.format.href_low,    2, "HREF is 0 during the bytes of a row; otherwise 1."),
                vsync_low   = (camera.format.vsync_low,   3, "VSYNC is 0 during a frame; otherwise 1."),
            )

    def add_settings(self):
        """Add size, times, limits of pairs, triggers, and the test pattern."""
        pairs, triggers = self.pairs, self.triggers
        self.add_fields("size", "Size of a frame. It is taken over while no frame is under way.",
            width  = (self.width,  0,  "Columns, up to those of ``max_size``."),
            height = (self.height, 16, "Rows, up to those of ``max_size``."),
        )
        self.add_storage("silence",        self.silence,
            "Longest time of a frame without the end of a row, in clocks. Then the frame is filled.")
        self.add_storage("clock_limit",    self.clock_limit,
            "Longest time of eight pixel clocks, in clocks. Then ``left_runs`` or ``right_runs`` becomes 0.")
        self.add_storage("pair_window",    pairs.window,
            "Most clocks between the starts of a pair. Half of the period makes the nearest starts a pair.")
        self.add_storage("flag_limit",     pairs.flag_limit,   "Most clocks between them without the event "
            "``damaged``.")
        self.add_storage("drop_limit",     pairs.drop_limit,   "Most clocks between them of a pair that is given out: "
            "as long as the sensor that is ahead takes for ``skew_pixels``, less a row.")
        self.add_storage("trigger_period", triggers.period,    "Clocks from trigger to trigger.")
        self.add_storage("trigger_width",  triggers.width,     "Clocks of a trigger, which is the exposure of sensors "
            "in snapshot mode.")
        self.add_fields("pattern", "Test pattern: noise of one disparity. Write it while no camera is enabled.",
            disparity      = (self.disparity,      0,  "Its disparity, pixels."),
            row_blanking   = (self.row_blanking,   16, "Pixel clocks between rows, from ``disparity`` + 1 up."),
        )
        self.add_storage("pattern_blanking", self.frame_blanking,
            "Pixel clocks between frames of the test pattern, from 2 up.")

    def add_pair(self):
        """Add what is known of a pair."""
        join, info = self.join, self.join.info
        self.add_status("number",      info.number,      "Number of the newest pair that has begun: that of its "
            "trigger, or with ``free_running`` of its start, counted from 1 on.")
        self.add_status("exposed",     info.exposed,     "Time of its trigger, in clocks; 0 with ``free_running``.")
        self.add_status("left_stamp",  info.left_stamp,  "Time of the start of its left frame, in clocks,")
        self.add_status("right_stamp", info.right_stamp, "and of its right one.")
        self.add_status("skew",        info.skew,        "Clocks from the left start to the right one, two's "
            "complement.")
        flags = {f"{side}_{name}": (join.flags[number*len(DAMAGES) + bit], 8*number + bit,
            f"The {side} frame: {DAMAGE_TEXTS[name]}.")
            for number, side in enumerate(SIDES) for bit, name in enumerate(DAMAGES)}
        flags["apart"] = (join.apart, 16, "Its skew is above ``flag_limit``.")
        self.add_fields("flags", "Damages of the newest pair that has ended.", status=True, **flags)
        self.add_status("now",         self.latched,     "Time at the newest ``latch``, in clocks since power-on.")

    def add_counts(self):
        """Add counters of pairs, and of each camera."""
        def pair_of(name, first, second, description):
            """Add a register of two counters."""
            self.add_fields(name, f"{description}, modulo {2**TOTAL_BITS}.", status=True, **{
                field: (signal, 16*number, text) for number, (field, signal, text) in enumerate((first, second))})

        totals = self.totals
        pair_of("pair_counts",
            ("ended",    totals["finished"],    "Pairs given out."),
            ("refused",  totals["refused"],     "Pairs not begun: the matcher did not take them, or a frame was not "
                "there."), "Counts of pairs")
        pair_of("pair_losses",
            ("given_up", totals["given_up"],    "Pairs given up: the matcher was aborted."),
            ("apart",    totals["apart"],       "Pairs whose skew was above ``drop_limit``."), "Counts of pairs")
        pair_of("alone_counts",
            ("left",     totals["left_alone"],  "Left frames without a right one."),
            ("right",    totals["right_alone"], "Right frames without a left one."), "Counts of frames")
        for side, camera in zip(SIDES, self.cameras):
            totals = camera.capture.totals
            for name, names in (("rows", ("short_row", "long_row")), ("gaps", ("missing_row", "extra_row")),
                ("breaks", ("stuck", "overrun"))):
                pair_of(f"{side}_{name}", *[(damage, totals[damage], f"Events: {DAMAGE_TEXTS[damage]}.")
                    for damage in names], f"Counts of damages of {side} frames")
            pair_of(f"{side}_frames",
                ("ended",   totals["frames"],  "Frames that began, and have ended."),
                ("dropped", totals["dropped"], "Frames that did not begin."), f"Counts of {side} frames")
            self.add_status(f"{side}_lost", camera.capture.crossing.lost,
                f"Items of the {side} sensor that were lost, pixels and marks, modulo {2**TOTAL_BITS}.")

    def add_statistics(self):
        """Add the statistics of both cameras."""
        window = {name: Signal.like(getattr(self.cameras[0].statistics, name), name=name)
            for name in ("column_begin", "column_end", "row_begin", "row_end")}
        index  = Signal.like(self.cameras[0].statistics.bin_index)
        for axis in ("column", "row"):
            self.add_fields(f"window_{axis}s", "Window of the statistics. It is taken over at the start of a frame.",
                begin = (window[f"{axis}_begin"], 0,  f"First {axis}."),
                end   = (window[f"{axis}_end"],   16, f"The {axis} after the last one."),
            )
        self.add_storage("bin_index", index,
            f"Bin to read, of {BINS}. Pixels of bin n are from {256//BINS} x n to {256//BINS} x n + {256//BINS - 1}.")
        for side, camera in zip(SIDES, self.cameras):
            statistics = camera.statistics
            self.comb += statistics.bin_index.eq(index)
            self.comb += [getattr(statistics, name).eq(signal) for name, signal in window.items()]
            self.add_status(f"{side}_measured", statistics.frames,
                f"{side.capitalize()} frames that were measured, modulo {2**TOTAL_BITS}.")
            self.add_status(f"{side}_sum",    statistics.sum,    f"Sum of the window's pixels of the newest {side} "
                "frame.")
            self.add_status(f"{side}_dark",   statistics.dark,   f"Its pixels below {LEAST_USABLE}.")
            self.add_status(f"{side}_bright", statistics.bright, f"Its pixels above {MOST_USABLE}.")
            self.add_status(f"{side}_bin",    statistics.bin,    "Its pixels of the bin that ``bin_index`` names.")
