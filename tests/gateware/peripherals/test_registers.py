#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Registers of matcher and frame link, without the cores: what each register drives, what it shows, and the events."""

from __future__ import annotations

import random
from dataclasses import dataclass, field
from types import SimpleNamespace

import pytest
from litex.gen import LiteXModule
from litex.soc.interconnect import csr_bus
from migen import Signal

from litestereo.gateware.cameras.frame_guard import DAMAGES
from litestereo.gateware.cameras.layouts import SIDES, pair_layout
from litestereo.gateware.cameras.parameters import CameraParameters
from litestereo.gateware.common.parameters import MatcherParameters
from litestereo.gateware.link.message import job_layout
from litestereo.gateware.matcher.frame_settings import OPTIONS, REGISTERS, frame_settings
from litestereo.gateware.peripherals.cameras_csr import CameraCSR
from litestereo.gateware.peripherals.frame_link_csr import FrameLinkCSR
from litestereo.gateware.peripherals.stereo_csr import PeripheralCSR
from litestereo.sim.cores.pin_core import PinCore
from support.pairs import byte_generator

Fields = dict[str, int]
"""Signals, by their names, with the lowest bit of each in its register."""


@dataclass(frozen=True)
class Map:
    """What the registers of a core are, from its description."""
    drives:    dict[str, Fields]                                 #: by register: Signals that it holds
    pulses:    dict[str, Fields]                                 #: by register: Signals that are set for one clock
    shows:     dict[str, Fields]                                 #: by register: Signals that it reads
    constants: dict[str, int]                                    #: by register
    written:   dict[str, str] = field(default_factory=dict)      #: by register: a Signal set a clock after any write
    others:    frozenset[str] = field(default_factory=frozenset) #: registers with tests elsewhere

    @property
    def names(self) -> set[str]:
        """Return the names of all registers."""
        return {*self.drives, *self.pulses, *self.shows, *self.constants, *self.others}


def signals(**bits: int) -> SimpleNamespace:
    """Return Signals of these widths, instead of a core that has them."""
    return SimpleNamespace(**{name: Signal(width, name=name) for name, width in bits.items()})


def prefixed(prefix: str, **bits: int) -> SimpleNamespace:
    """Return Signals of these widths, whose names in Verilog have a prefix: other cores have Signals of these names."""
    return SimpleNamespace(**{name: Signal(width, name=f"{prefix}_{name}") for name, width in bits.items()})


def one_each(*names: str, prefix: str = "") -> dict[str, Fields]:
    """Return registers that are a Signal of the same name each."""
    return {f"{prefix}{name}": {name: 0} for name in names}


class LinkRegisters(FrameLinkCSR, LiteXModule):
    """Registers of a frame link."""
    SLOTS, MAX_CHUNKS, ENTRIES, ALIGNMENT, PORT = 3, 64, 5, 16, 19539

    def __init__(self) -> None:
        self.slots, self.max_chunks, self.mailbox_entries = self.SLOTS, self.MAX_CHUNKS, self.ENTRIES
        self.alignment, self.port, self.streaming         = self.ALIGNMENT, self.PORT, True
        for name, bits in {"mac_high": 16, "mac_low": 32, "netmask": 32, "gateway": 32, "address": 32,
                           "sequence": 32}.items():
            setattr(self, name, Signal(bits, name=name))
        self.sorter   = signals(enable=1, token=32, peer_address=32, peer_port=16, mailbox_base=32, consumed=8,
                                writing=1, produced=8)
        self.table    = signals(slot=4, frame_id=32, base=32, pixels=32, open=1, close=1, arrived_index=16,
                                clearing=1, found=4, arrived=32, missing=16)
        self.queue    = signals(reply=1, burst=1, abort=1, reply_busy=1, burst_busy=1)
        self.gate     = signals(frame_id=32, pixels=32, open=1, close=1, opened=1, offset=32)
        self.parts    = signals(sending=1)
        self.counters = signals(index=4, read=1, value=32)
        self.queue.job = signals(**dict(job_layout()))
        self.add_csr()


LINK = Map(
    drives={
        **one_each("mac_high", "mac_low", "netmask", "gateway", "address"),
        "control":      {"sorter.enable": 0},
        "token":        {"sorter.token": 0},
        "peer_address": {"sorter.peer_address": 0},
        "peer_port":    {"sorter.peer_port": 0},
        "slot_frame_id": {"table.frame_id": 0},
        "slot_base":     {"table.base": 0},
        "slot_pixels":   {"table.pixels": 0},
        "arrived_index": {"table.arrived_index": 0},
        "mailbox_base":     {"sorter.mailbox_base": 0},
        "mailbox_consumed": {"sorter.consumed": 0},
        **{f"send_{name}": {f"queue.job.{name}": 0} for name in (
            "address", "port", "type", "session", "sequence", "frame_id", "offset", "base", "length")},
        "stream_frame_id": {"gate.frame_id": 0},
        "stream_pixels":   {"gate.pixels": 0},
        "stream_sequence": {"sequence": 0},
        "counter_index":   {"counters.index": 0},
    },
    pulses={
        "slot_control":   {"table.slot": 0, "table.open": 8, "table.close": 9},
        "send_control":   {"queue.reply": 0, "queue.burst": 1, "queue.abort": 2},
        "stream_control": {"gate.open": 0, "gate.close": 1},
    },
    shows={
        "slot_status":      {"table.clearing": 0, "sorter.writing": 1, "table.found": 4},
        "arrived":          {"table.arrived": 0},
        "missing":          {"table.missing": 0},
        "mailbox_produced": {"sorter.produced": 0},
        "send_status":      {"queue.reply_busy": 0, "queue.burst_busy": 1},
        "stream_status":    {"gate.opened": 0, "parts.sending": 1},
        "stream_offset":    {"gate.offset": 0},
        "counter":          {"counters.value": 0},
    },
    constants={"version": 0x0004, "slots": LinkRegisters.SLOTS, "max_chunks": LinkRegisters.MAX_CHUNKS,
               "mailbox_entries": LinkRegisters.ENTRIES, "alignment": LinkRegisters.ALIGNMENT,
               "port": LinkRegisters.PORT, "streaming": 1},
    written={"counter_index": "counters.read"})


class StereoRegisters(PeripheralCSR, LiteXModule):
    """Registers of a matcher."""
    ALIGNMENT = 16

    def __init__(self) -> None:
        self.parameters = MatcherParameters(max_width=640, disparities=64, max_block_size=21, max_prefilter_cap=36,
                                            features=("xsobel", "raw", "median"))
        self.alignment  = self.ALIGNMENT
        for name, bits in [*frame_settings(), ("start", 1), ("abort", 1), ("busy", 1), ("done", 1), ("failed", 1),
                           ("error_code", 4), ("clocks", 32), ("first_row_clocks", 32), ("frames", 32)]:
            setattr(self, name, Signal(bits, name=name))
        self.add_csr()
        self.add_irq()


STEREO = Map(
    drives=one_each(*(name for name, *_ in REGISTERS)) | {"options": {name: bit for name, bit, _ in OPTIONS}},
    pulses={"control": {"start": 0, "abort": 1}},
    shows={"status": {"busy": 0, "error_code": 8}} | one_each("clocks", "first_row_clocks", "frames"),
    constants={"version": 0x0004, "max_width": 640, "max_disparities": 64, "block_sizes": 5 | 21 << 8,
               "max_prefilter_cap": 36, "dma_alignment": StereoRegisters.ALIGNMENT},
    # All of the stages are in tests/soc/reports/test_tables.py; the events have a test below.
    others=frozenset({"features", "ev_status", "ev_pending", "ev_enable"}))


class CameraRegisters(CameraCSR, LiteXModule):
    """Registers of two cameras."""

    def __init__(self) -> None:
        self.parameters = CameraParameters(max_width=640, max_height=480, silence_bits=20, skew_pixels=1024)
        for name, bits in {"select": 1, "latch": 1, "latched": 64, "width": 10, "height": 9, "silence": 20,
                           "clock_limit": 20, "disparity": 8, "row_blanking": 16, "frame_blanking": 16,
                           "scl_i": 1, "scl_low": 1}.items():
            setattr(self, name, Signal(bits, name=name))
        self.sleep, self.restart, self.sda_i, self.sda_low = (
            [Signal(name=f"{side}_{name}") for side in SIDES] for name in ("sleep", "restart", "sda_i", "sda_low"))
        self.triggers  = prefixed("triggers", enable=1, period=32, width=32)
        self.pairs     = prefixed("pairs", free_running=1, window=31, flag_limit=31, drop_limit=31)
        self.join      = prefixed("join", busy=1, flags=12, apart=1)
        self.join.info = prefixed("info", **dict(pair_layout()))
        counts         = ("finished", "refused", "given_up", "apart", "left_alone", "right_alone")
        self.counted   = prefixed("counted", **dict.fromkeys(counts, 16))
        self.totals    = vars(self.counted)
        self.cameras   = [self.camera(side) for side in SIDES]
        self.left, self.right = self.cameras
        self.add_csr()

    @staticmethod
    def camera(side: str) -> SimpleNamespace:
        """Return the Signals of a camera."""
        camera            = prefixed(side, enable=1)
        camera.format     = prefixed(f"{side}_format", two_bytes=1, grey_second=1, href_low=1, vsync_low=1)
        camera.pattern    = prefixed(side, pattern=1)
        camera.statistics = prefixed(f"{side}_statistics", column_begin=10, column_end=10, row_begin=9, row_end=9,
                                     bin_index=4, frames=16, sum=27, dark=19, bright=19, bin=19)
        camera.counted    = prefixed(f"{side}_counted", **dict.fromkeys((*DAMAGES, "frames", "dropped"), 16))
        camera.capture    = SimpleNamespace(watch=prefixed(side, runs=1), guard=prefixed(side, busy=1),
                                            crossing=prefixed(side, lost=16), totals=vars(camera.counted))
        return camera


def of_cameras(registers: dict[str, Fields]) -> dict[str, Fields]:
    """Return registers that each camera has."""
    return {f"{side}_{register}": {f"{side}.{name}": bit for name, bit in fields.items()}
            for side in SIDES for register, fields in registers.items()}


CAMERAS = Map(
    drives={
        "control": {"left.enable": 0, "right.enable": 1, "left.pattern.pattern": 2, "right.pattern.pattern": 3,
                    "select": 4, "triggers.enable": 5, "pairs.free_running": 6},
        "size":    {"width": 0, "height": 16},
        "pattern": {"disparity": 0, "row_blanking": 16},
        "pattern_blanking": {"frame_blanking": 0},
        "pair_window":      {"pairs.window": 0},
        "trigger_period":   {"triggers.period": 0},
        "trigger_width":    {"triggers.width": 0},
        "flag_limit":       {"pairs.flag_limit": 0},
        "drop_limit":       {"pairs.drop_limit": 0},
        **one_each("silence", "clock_limit"),
        **of_cameras({"format": {f"format.{name}": bit for bit, name in enumerate(
            ("two_bytes", "grey_second", "href_low", "vsync_low"))}}),
    },
    pulses={"latch": {"latch": 0}},
    shows={
        "status":  {"left.capture.watch.runs": 0, "right.capture.watch.runs": 1, "left.capture.guard.busy": 2,
                    "right.capture.guard.busy": 3, "join.busy": 4},
        "number":  {"join.info.number": 0},
        "skew":    {"join.info.skew": 0},
        "pair_counts":  {"counted.finished": 0, "counted.refused": 16},
        "pair_losses":  {"counted.given_up": 0, "counted.apart": 16},
        "alone_counts": {"counted.left_alone": 0, "counted.right_alone": 16},
        **of_cameras({
            "rows":     {"counted.short_row": 0, "counted.long_row": 16},
            "gaps":     {"counted.missing_row": 0, "counted.extra_row": 16},
            "breaks":   {"counted.stuck": 0, "counted.overrun": 16},
            "frames":   {"counted.frames": 0, "counted.dropped": 16},
            "lost":     {"capture.crossing.lost": 0},
            "measured": {"statistics.frames": 0},
            **{name: {f"statistics.{name}": 0} for name in ("sum", "dark", "bright", "bin")},
        }),
    },
    constants={"version": 0x0001, "max_size": 640 | 480 << 16, "skew_pixels": 1024},
    # Parts of a Signal, of several Signals, of several words, or not 0 after a reset: in test_cameras.py.
    others=frozenset({"flags", "window_columns", "window_rows", "bin_index", "pins", "i2c", "i2c_in", "exposed",
                      "left_stamp", "right_stamp", "now"}))


class Bench:
    """Registers on a bus, and the Signals at their other side."""

    def __init__(self, make: type[LiteXModule], registers: Map) -> None:
        self.core = LiteXModule()
        self.core.registers = block = make()
        self.core.bus  = bus  = csr_bus.Interface(data_width=32, address_width=14)
        csrs           = block.get_csrs()
        self.core.bank = bank = csr_bus.CSRBank(csrs, bus=bus)
        self.map       = registers
        # Each is one word.
        words          = [csr.simple_csrs[0] if hasattr(csr, "simple_csrs") else csr for csr in csrs]
        self.places    = {csr.name: bank.simple_csrs.index(word) for csr, word in zip(csrs, words, strict=True)}

        def widths(kind: dict[str, Fields]) -> dict[str, int]:
            return {name: len(self._signal(block, name)) for fields in kind.values() for name in fields}

        self.driven, self.shown = widths(registers.drives) | widths(registers.pulses), widths(registers.shows)
        self.events = {"done": block.done, "failed": block.failed} if hasattr(block, "ev") else {}
        inputs      = {name: self._signal(block, name) for name in self.shown}
        outputs     = {name: self._signal(block, name) for name in [*self.driven, *registers.written.values()]}
        self._pins  = {name: name.replace(".", "_") for name in {*inputs, *outputs}}
        more        = {"irq": block.ev.irq} if self.events else {}
        self.pins   = PinCore(
            self.core,
            {self._pins[name]: signal for name, signal in inputs.items()} | self.events
            | {f"bus_{name}": getattr(bus, name) for name in ("adr", "we", "dat_w")},
            {self._pins[name]: signal for name, signal in outputs.items()} | more | {"bus_dat_r": bus.dat_r})

    @staticmethod
    def _signal(block: LiteXModule, name: str) -> Signal:
        found = block
        for part in name.split("."):
            found = getattr(found, part)
        return found

    def clock(self) -> None:
        self.pins.clock()

    def show(self, **values: int) -> None:
        """Drive Signals that registers read."""
        self.pins.set(**{self._pins.get(name, name): value for name, value in values.items()})

    def outputs(self) -> Fields:
        """Return the values of all Signals that registers drive."""
        return {name: self.get(name) for name in self.driven}

    def get(self, name: str) -> int:
        """Return the value of a Signal that registers drive."""
        return self.pins.get(self._pins[name])

    def write(self, register: str, value: int) -> None:
        """Write a register, in one clock."""
        self.pins.set(bus_adr=self.places[register], bus_we=1, bus_dat_w=value)
        self.clock()
        self.pins.set(bus_we=0, bus_adr=0, bus_dat_w=0)

    def read(self, register: str) -> int:
        """Return what a register reads."""
        self.pins.set(bus_adr=self.places[register])
        self.clock()
        return self.pins.get("bus_dat_r")


BLOCKS = {"frame link": (LinkRegisters, LINK), "matcher": (StereoRegisters, STEREO),
          "cameras": (CameraRegisters, CAMERAS)}


@pytest.fixture(scope="module", params=BLOCKS)
def bench(request):
    return Bench(*BLOCKS[request.param])


def value_of(fields: Fields, values: dict[str, int]) -> int:
    """Return the register that has these values in its fields."""
    return sum(values[name] << bit for name, bit in fields.items())


def drawn(rng: random.Random, bits: dict[str, int]) -> Fields:
    """Return values of Signals, of which each has bits that are set and, if it has several, bits that are not."""
    return {name: rng.randrange(1, max(2, 2**width - 1)) for name, width in bits.items()}


def test_all_registers_are_known(bench):
    assert set(bench.places) == bench.map.names


def test_a_register_drives_its_own_signals(bench):
    """All are 0 after a reset; a write changes the Signals of its register and no other, until the next one."""
    bench.pins.reset()
    expected = dict.fromkeys(bench.driven, 0)
    assert bench.outputs() == expected
    rng = byte_generator()
    for _ in range(2):
        for register, fields in bench.map.drives.items():
            values    = drawn(rng, {name: bench.driven[name] for name in fields})
            expected |= values
            bench.write(register, value_of(fields, values))
            assert bench.outputs() == expected, register
            assert bench.read(register) == value_of(fields, values)
    for _ in range(3):
        bench.clock()
    assert bench.outputs() == expected


def test_a_command_lasts_for_one_clock(bench):
    """A write of 1 sets its Signal in the next clock alone; a number that goes with it holds."""
    for register, fields in bench.map.pulses.items():
        before = bench.outputs()
        for command in (name for name in fields if bench.driven[name] == 1):
            others = {name: 5 for name in fields if bench.driven[name] > 1}
            quiet  = before | others | {name: 0 for name in fields if bench.driven[name] == 1}
            bench.write(register, value_of(fields, others | dict.fromkeys(fields.keys() - others.keys(), 0)
                                           | {command: 1}))
            assert bench.outputs() == quiet | {command: 1}
            bench.clock()
            assert bench.outputs() == quiet


def test_a_write_is_noticed(bench):
    """A write of any value sets the Signal in the next clock alone, and a write of another register does not."""
    for register in [*bench.map.drives, *bench.map.pulses]:
        for value in (0, 1, 0):
            bench.write(register, value)
            for name, signal in bench.map.written.items():
                assert bench.get(signal) == int(register == name)
            bench.clock()
            assert not any(bench.get(signal) for signal in bench.map.written.values())


def test_a_register_shows_its_signals(bench):
    rng = byte_generator()
    for values in (dict.fromkeys(bench.shown, 0), drawn(rng, bench.shown), drawn(rng, bench.shown)):
        bench.show(**values)
        for register, fields in bench.map.shows.items():
            assert bench.read(register) == value_of(fields, values), register
    # Signals of one bit alone, too.
    for name in bench.shown:
        bench.show(**dict.fromkeys(bench.shown, 0) | {name: 1})
        for register, fields in bench.map.shows.items():
            assert bench.read(register) == (1 << fields[name] if name in fields else 0), (register, name)


def test_what_was_built(bench):
    for register, value in bench.map.constants.items():
        assert bench.read(register) == value, register


def test_events():
    """An event pends when it has been, and interrupts if it is enabled, until a 1 is written."""
    bench  = Bench(*BLOCKS["matcher"])
    events = [("done", 1), ("failed", 2)]
    for event, bit in events:
        for enabled in range(4):
            bench.write("ev_enable", enabled)
            bench.show(**{event: 1})
            bench.clock()
            bench.show(**{event: 0})
            bench.clock()
            assert bench.read("ev_pending") == bit
            assert bench.pins.get("irq") == int(enabled & bit != 0)
            bench.write("ev_pending", 3 - bit)
            bench.clock()
            assert bench.read("ev_pending") == bit
            bench.write("ev_pending", bit)
            bench.clock()
            assert bench.read("ev_pending") == 0
            assert bench.pins.get("irq") == 0
