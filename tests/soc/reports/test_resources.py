#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The report of resources, as far as it needs no synthesis."""

import json
import os
import subprocess
import sys

import pytest
from migen import Signal

from litestereo.gateware.common.parameters import FEATURES, OPENCV_FEATURES, MatcherParameters
from litestereo.soc.build.tools import ToolError
from litestereo.soc.flow import synthesis
from litestereo.soc.flow.place import Placement
from litestereo.soc.flow.synthesis import Resources, emit, resources, tool
from litestereo.soc.reports.resources import BARE, built, feature_table, placement_row, row


@pytest.mark.parametrize("family, cells, expected", [
    ("ECP5", {"LUT4": 10, "CCU2C": 3, "TRELLIS_DPR16X4": 2, "TRELLIS_FF": 7, "DP16KD": 1, "PFUMX": 5},
     Resources(24, 10, 7, 1, 0)),
    ("Spartan-6", {"LUT6": 5, "LUT2": 1, "CARRY4": 9, "FDRE": 3, "RAMB8BWER": 1, "RAMB16BWER": 2, "DSP48A1": 1},
     Resources(6, 6, 3, 2.5, 1)),
    ("Gowin", {"LUT4": 2, "ALU": 3, "DFFRE": 4, "SDPX9B": 2, "MULT18X18": 1}, Resources(5, 2, 4, 2, 1)),
])
def test_counts(tmp_path, family, cells, expected):
    """Primitives count as the sites that they occupy."""
    (tmp_path / "stat.json").write_text(json.dumps({"design": {"num_cells_by_type": cells}}))
    assert resources(tmp_path, family) == expected


def test_rows():
    """The rows have totals, values per disparity, and what does not fit."""
    assert row(built(64, 9, BARE), Resources(640, 320, 1280, 32, 0)) == [
        64, 9, "bare", 640, 320, 1280, "32", 0, 10, 5, 20, "0.50"]
    less = {"xsobel": Resources(60, 30, 40, 2, 1)}
    assert "| xsobel | 40 | 10 | 1 | 0 |" in feature_table(Resources(100, 60, 50, 3, 1), less)
    assert "does not fit" in placement_row(("25k", 60, built(64, 15, OPENCV_FEATURES)), None)
    placed = placement_row(("45k", 90, built(64, 15, OPENCV_FEATURES)),
                           Placement(95.06, {"DP16KD": 63}, {"DP16KD": 108}))
    assert placed == ["LFE5U-45F", 64, 15, "OpenCV", 90, "95.1", "63 of 108 (58 %)"]


@pytest.mark.parametrize("features", [BARE, FEATURES], ids=["bare", "all"])
def test_emitted_again_it_is_the_same(features):
    """The Verilog is the same each time, and after signals of other designs: no two of its signals claim one name."""
    parameters = MatcherParameters(64, disparities=16, max_block_size=5, features=features)
    first      = emit(parameters)
    for count in (0, 1, 37, 500):
        for _ in range(count):
            Signal()
        assert emit(parameters) == first


def test_key_of_the_page_is_the_same_in_each_process():
    """Features are a set, whose order depends on the process."""
    program = "from litestereo.soc.reports.resources import settings_text; print(settings_text())"
    texts   = {subprocess.run([sys.executable, "-c", program], env=os.environ | {"PYTHONHASHSEED": seed}, check=True,
                              capture_output=True, text=True).stdout for seed in ("1", "2", "3")}
    assert len(texts) == 1


def test_version_of_a_tool(tmp_path, monkeypatch):
    """The version is the same at the first run, when a WebAssembly build prints that it is being prepared."""
    monkeypatch.setattr(synthesis.sys, "prefix", str(tmp_path))
    (tmp_path / "bin").mkdir()
    program = tmp_path / "bin" / "a-tool"
    program.write_text("#!/bin/sh\n[ -e used ] || echo Preparing to run... >&2\ntouch used\necho Version 1 >&2\n")
    program.chmod(0o755)
    monkeypatch.chdir(tmp_path)
    assert [synthesis.tool_version("a-tool") for _ in range(2)] == ["Version 1"]*2


def test_missing_tool():
    """The error has the tool's name, and a remedy."""
    with pytest.raises(ToolError, match="no-such-tool is not installed: run"):
        tool("no-such-tool")
