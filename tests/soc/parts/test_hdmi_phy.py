#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The bits that the HDMI PHY sends, decoded as the standard says (DVI 1.0, section 3)."""

from litex.gen import LiteXModule
from migen import ClockDomain, ClockSignal, Record, ResetSignal

from litestereo.sim.cores.pin_core import PinCore
from litestereo.sim.socs.video_model import VideoPHYModel
from litestereo.soc.parts.hdmi_phy import HDMIChannel
from support.pairs import generator
from support.screen import PADS

#: Coded controls, by their number; the bit sent first is the lowest.
TOKENS = [0b1101010100, 0b0010101011, 0b0101010100, 0b1010101011]


class Bench(LiteXModule):
    """A channel whose bits have the system's clock; the pixel clock comes from a model of a PHY."""
    def __init__(self):
        self.pads      = Record(PADS)
        self.clocking  = VideoPHYModel(self.pads, "hdmi", 5)
        self.cd_hdmi5x = ClockDomain()
        self.channel   = HDMIChannel("hdmi")
        self.comb += [
            self.cd_hdmi5x.clk.eq(ClockSignal("sys")),
            self.cd_hdmi5x.rst.eq(ResetSignal("sys")),
        ]


def sent(symbols):
    """Return the bits sent while controls ("c", 0 to 3) and pixels ("d", 0 to 255) are shown."""
    bench   = Bench()
    encoder = bench.channel.encoder
    core    = PinCore(bench, {"de": encoder.de, "c": encoder.c, "d": encoder.d},
                      {"bits": bench.channel.serializer.bits})
    bits = []
    for kind, value in symbols:
        core.set(de=kind == "d", **{kind: value})
        for _ in range(5):
            core.clock()
            bits += [core.get("bits") & 1, core.get("bits") >> 1]
    return bits


def decoded(word):
    """Return the meaning of ten bits."""
    if word in TOKENS:
        return "c", TOKENS.index(word)
    bits = word & 0xff ^ (0xff if word & 0x200 else 0)
    return "d", (bits ^ bits << 1 ^ (0 if word & 0x100 else 0xfe)) & 0xff


def words_of(bits):
    """Return the words that start at the first bit, as a list of ints."""
    begins = range(0, len(bits) - 9, 10)
    return [sum(bit << place for place, bit in enumerate(bits[begin:begin + 10])) for begin in begins]


def test_each_symbol_arrives():
    """Every pixel value and every control arrives, in order, without end; ones and zeros are balanced."""
    rng     = generator(95)
    symbols = [("c", 0)]*40
    for row in [range(256), rng.integers(0, 256, 300).tolist(), [0]*50, [255]*50, [16, 239]*50]:
        symbols += [("d", value) for value in row] + [("c", int(control)) for control in rng.integers(0, 4, 30)]
    bits   = sent(symbols + [("c", 3)]*10)
    starts = [start for start in range(10) if set(words_of(bits[start:])[-3:]) == {TOKENS[3]}]
    assert len(starts) == 1
    words   = words_of(bits[starts[0]:])
    came    = [decoded(word) for word in words]
    # The first words mean nothing yet.
    latency = came.index(("d", 0), 20) - 40
    assert 0 < latency < 10
    assert came[40 + latency:len(symbols) + latency] == symbols[40:]
    surplus = 0
    for word, (kind, _) in zip(words[20:], came[20:], strict=True):
        surplus = surplus + 2*word.bit_count() - 10 if kind == "d" else 0
        assert abs(surplus) <= 10
