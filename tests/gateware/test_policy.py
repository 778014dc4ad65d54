#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Policy of all cores and of the SoC around them: what a reader can rely on in each file, and that each rule works."""

from __future__ import annotations

import pytest
from litex.gen import LiteXModule
from litex.soc.interconnect import stream

from litestereo.gateware.cameras.dvp_receiver import DVPReceiver
from litestereo.gateware.cameras.frame_guard import FrameGuard
from litestereo.gateware.cameras.frame_queue import FrameQueue
from litestereo.gateware.cameras.frame_statistics import FrameStatistics
from litestereo.gateware.cameras.pair_join import PairJoin
from litestereo.gateware.cameras.pair_matcher import PairMatcher
from litestereo.gateware.cameras.parameters import CameraParameters
from litestereo.gateware.cameras.sensor_capture import SensorCapture
from litestereo.gateware.cameras.sensor_crossing import SensorCrossing
from litestereo.gateware.cameras.trigger_generator import TriggerGenerator
from litestereo.gateware.common.parameters import MatcherParameters
from litestereo.gateware.engines.sad.absolute_difference import AbsoluteDifference
from litestereo.gateware.engines.sad.block_sum import BlockSum
from litestereo.gateware.engines.sad.column_sum import ColumnSum
from litestereo.gateware.engines.sad.sad_engine import SADEngine
from litestereo.gateware.matcher.alignment import Alignment
from litestereo.gateware.matcher.line_buffer import LineBuffer
from litestereo.gateware.matcher.prefilter import Prefilter
from litestereo.gateware.matcher.raster import Raster
from litestereo.gateware.post.border import Border
from litestereo.gateware.post.left_right.left_right import LeftRight
from litestereo.gateware.post.median import Median
from litestereo.gateware.post.selection.selection import Selection
from litestereo.gateware.post.selection.subpixel import Neighbours, Subpixel
from litestereo.gateware.post.selection.uniqueness import CostLimit, Uniqueness
from litestereo.gateware.post.selection.winner import Winner
from litestereo.gateware.rectification.bilinear import Bilinear
from litestereo.gateware.rectification.map_grid import MapGrid
from litestereo.gateware.rectification.parameters import RectifierParameters
from litestereo.gateware.rectification.rectifier import Rectifier
from litestereo.gateware.rectification.remap import Remap
from litestereo.gateware.rectification.row_ring import RowRing
from litestereo.gateware.rectification.row_window import RowWindow
from support.paths import CHECKOUT
from support.policy import BANNED, LONGEST_CONSTRUCTOR, RULES

#: Folders under the policy.
FOLDERS = ("gateware", "soc")

FILES = sorted(str(path.relative_to(CHECKOUT)) for folder in FOLDERS for path in (CHECKOUT / folder).rglob("*.py")
               if path.stat().st_size)


@pytest.mark.parametrize("file", FILES)
def test_policy(file):
    """The file breaks no rule."""
    source   = (CHECKOUT / file).read_text()
    problems = [f"{file}:{line}: {what}" for rule in RULES.values() for line, what in rule(source)]
    assert not problems, "\n".join(problems)


# Cores ------------------------------------------------------------------------------------------------

CORES = [Raster, Prefilter, LineBuffer, Alignment, SADEngine, AbsoluteDifference, ColumnSum, BlockSum, Selection,
         Winner, CostLimit, Uniqueness, Neighbours, Subpixel, LeftRight, Border, Median]


@pytest.mark.parametrize("features", [None, ["raw"], ["xsobel", "texture"]], ids=str)
@pytest.mark.parametrize("core", CORES)
def test_latency_and_reset(core, features):
    """With all features and with few, a core declares its latency, or None, and has a reset."""
    options = {} if features is None else {"features": features}
    check_core(core(MatcherParameters(100, 100, 32, 9, **options)))


@pytest.mark.parametrize("core", [MapGrid, RowWindow, RowRing, Remap, Rectifier])
def test_latency_and_reset_of_rectification(core):
    """A core of the rectifier declares its latency, or None, and has a reset."""
    check_core(core(RectifierParameters(100, 100, 16)))
    check_core(Bilinear())


@pytest.mark.parametrize("core", [DVPReceiver, FrameGuard, SensorCrossing, SensorCapture, TriggerGenerator,
                                  PairMatcher, FrameQueue, PairJoin, FrameStatistics])
def test_latency_and_reset_of_cameras(core):
    """A core of the cameras declares its latency, or None, and has a reset if it is in one clock domain."""
    plain = core in (DVPReceiver, SensorCrossing, TriggerGenerator, PairMatcher)
    built = core() if plain else core(CameraParameters())
    assert built.latency is None or built.latency > 0
    assert core in (SensorCrossing, SensorCapture) or len(built.reset) == 1


def check_core(built):
    """Assert what holds for every core."""
    assert isinstance(built, LiteXModule) and len(built.reset) == 1
    assert isinstance(built.sink, stream.Endpoint) and isinstance(built.source, stream.Endpoint)
    assert built.latency is None or isinstance(built.latency, int) and built.latency >= 0


# The rules --------------------------------------------------------------------------------------------

CORE = '''\
from migen import *

from litex.gen import *

from litex.soc.interconnect import stream

from ..common import *
from .border  import Border

@ResetInserter()
class Core(LiteXModule):
    """Pass items on, a clock later."""
    def __init__(self, layout):
        self.sink   = stream.Endpoint(layout) # Items.
        self.source = stream.Endpoint([
            ("item", 8),
        ])                                    # Pipeline.
        # Settings.
        self.enable  = Signal()
        self.latency = 1

        # # #

        self.last = Signal()
        self.sync += self.source.item.eq(self.sink.item)
'''

BROKEN = {
    "line_length":        ("Pass items on, a clock later.", "Pass items on" + ", a clock later"*8),
    "docstrings":         ('    """Pass items on, a clock later."""\n', ""),
    "port_comments":      (" # Items.", ""),
    "latency":            ("        self.latency = 1\n", ""),
    "reset":              ("@ResetInserter()\n", ""),
    "constructor_length": ("        # # #\n", "        # # #\n" + "        pass\n"*LONGEST_CONSTRUCTOR),
    "words":              ("a clock later", "one of its\n    own clocks"),
    "import_order":       ("from ..common import *\nfrom .border  import Border\n",
                           "from .border  import Border\nfrom ..common import *\n"),
}


def broken_rules(source):
    """Return the names of the rules that a source breaks."""
    return [name for name, rule in RULES.items() if rule(source)]


def test_a_core_that_keeps_to_the_policy():
    """Comments at either end of a port or above it, a ResetInserter, inner Signals without comments are accepted."""
    assert broken_rules(CORE) == []


@pytest.mark.parametrize("name", RULES)
def test_each_rule_bites(name):
    """Each rule refuses a core that breaks it, and no other rule does."""
    old, new = BROKEN[name]
    assert CORE.count(old) == 1
    assert broken_rules(CORE.replace(old, new)) == [name]


@pytest.mark.parametrize("phrase", [
    "nobody", "somebody", "whatever", "besides", "likewise", "of its own", "of their own", "stands for", "stand in",
    "takes in", "take in", "in line", "is through", "befalls",
])
@pytest.mark.parametrize("place", ["# It is {}.", '"""It is {}."""', "text = f'{}'", "pass # It is {}."])
def test_banned_words(phrase, place):
    """Banned words are found in comments, docstrings and other strings."""
    assert RULES["words"](place.format(phrase))


def test_banned_words_in_two_lines():
    """They are found across lines of a comment or docstring."""
    assert RULES["words"]("# A clock of its\n# own.")
    assert RULES["words"]('"""A clock of its\n    own."""')


@pytest.mark.parametrize("name", ["nobody", "NobodyWaits", "run_whatever", "stands_for"])
def test_banned_names(name):
    """They are found in names, whose words are separated by underscores or capitals."""
    assert RULES["words"](f"{name} = 1")


@pytest.mark.parametrize("text", ["# A standby.", "# Inline code.", "# In lines of 64.", "# It understands in time."])
def test_words_that_only_look_like_banned_ones(text):
    """Only whole words count."""
    assert RULES["words"](text) == []


def test_each_banned_word_has_a_better_one():
    """The list has a replacement for each."""
    assert all(BANNED.values())
