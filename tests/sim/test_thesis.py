#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The page about the thesis: its sources, at a small scale; no number on it is typed by hand."""

from __future__ import annotations

import ast
import re
import string
from pathlib import Path

import numpy as np
import pytest

from litestereo.firmware import FIRMWARE_DIR
from litestereo.gateware.common.parameters import MatcherParameters
from litestereo.gateware.engines.sad.block_sum import BlockSum
from litestereo.gateware.post.selection.winner import Winner
from litestereo.host_tools.core.errors import DatasetError
from litestereo.host_tools.data.datasets import StereoPair
from litestereo.sim.models.stereo_bm import stereo_bm
from litestereo.sim.thesis import __main__ as command
from litestereo.sim.thesis import clocks, measured, middlebury, overflow, page, serial, structure
from litestereo.sim.thesis.elaborated import contents
from litestereo.sim.thesis.presets import PUBLISHED, THESIS, Preset, Scale
from litestereo.sim.thesis.section import PACKAGE
from litestereo.soc.build.paths import PACKAGE_DIR, content_key
from support.pairs import generator, textured_pair

#: The smallest possible scale.
SMALL = Scale(presets=(Preset(16, 5, published_pixels=4, published_fps=15.73), Preset(16, 5)), width=64, height=20,
              sizes=((40, 12), (64, 20)), block_sizes=(3, 5), disparities=(16, 32), strip_rows=16)

#: A separate number: not the end of a name (cv2, Spartan-6), nor a part of another number.
NUMBER = r"(?<![\w.])(?<![A-Za-z]-)\d+"


def section(sections, label):
    """Return the section with that label."""
    (found,) = (one for one in sections if one.label == label)
    return found


@pytest.fixture
def build(tmp_path, monkeypatch):
    """Use a new build folder, so that everything is measured."""
    monkeypatch.setattr("litestereo.sim.thesis.section.build_directory", lambda: tmp_path / "build")
    return tmp_path


def rows_of(markdown):
    """Return the cells of the tables in a text, without their heads."""
    lines = [line for line in markdown.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if "---" not in line][1:]


def test_every_table_and_figure():
    """Each result of the thesis has one counterpart."""
    labels   = [one.label for one in page.SECTIONS]
    expected = [f"Table 5.{number}" for number in range(1, 8)] + [f"Figure 5.{number}" for number in (1, 3, 4, 5, 6)]
    assert sorted(labels) == sorted(expected)
    assert "Figure 5.2" in section(page.SECTIONS, "Table 5.6").text


@pytest.mark.parametrize("one", page.SECTIONS, ids=lambda one: one.label)
def test_no_numbers_in_the_templates(one):
    """Numbers come only from fields; references to tables, figures or sections do not count as numbers."""
    text = re.sub(r"(Table|Figure|section) \d\.\d(\.\d)?", "", f"{one.title} {one.text}")
    bare = "".join(literal for literal, *_ in string.Formatter().parse(text))
    assert not re.findall(NUMBER, bare)
    assert any(field for _, field, *_ in string.Formatter().parse(one.text))


def test_no_numbers_in_the_header():
    """The header has no numbers either."""
    bare = "".join(literal for literal, *_ in string.Formatter().parse(page.HEADER))
    assert not re.findall(NUMBER, bare)


def test_no_numbers_in_other_texts():
    """Heads of tables and cells are composed of values: no string of the package contains a separate number."""
    citation = re.compile("(.*)(Citron|Szeliski)(.*)")
    for path in PACKAGE.glob("*.py"):
        tree  = ast.parse(path.read_text())
        prose = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
        prose |= {id(part) for node in ast.walk(tree) if isinstance(node, ast.FormattedValue) and node.format_spec
                  for part in ast.walk(node.format_spec)}
        for node in ast.walk(tree):
            if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in prose:
                text = re.sub(r"(Table|Figure|section) \d\.\d(\.\d)?", "", node.value)
                assert citation.fullmatch(node.value) or not re.findall(NUMBER, text), (path.name, node.value)


def test_page(build):
    """A page of three sections is measured once, marked where published, has its pictures, and is reproducible."""
    chosen   = [section(structure.SECTIONS, f"Table 5.{number}") for number in (1, 2, 3)]
    measured = [(one, one.measured(SMALL)) for one in chosen]
    for index, name in enumerate(("first.md", "second.md")):
        page.write(measured, SMALL, build / name)
        measured = [(one, one.measured(SMALL)) for one in chosen]
        assert len(list((build / "build" / "thesis").glob("*.lock"))) == 3, index
    text = (build / "first.md").read_text()
    assert text == (build / "second.md").read_text()
    assert [line for line in text.splitlines() if line.startswith("## ")] == [
        *(f"## {one.label}: {one.title}" for one in chosen), "## Images"]
    for preset in THESIS:
        assert f"{preset.published_fps} {PUBLISHED}" in text
    assert all(after.startswith(f" {PUBLISHED}") for after in re.split(r"15\.73|29\.32", text)[1:])


#: Rooms whose code is in no key.
OTHERS = ("gateware", "soc/", "sim/socs", "sim/system", "sim/bench", "firmware/link", "firmware/drivers")


@pytest.fixture
def emitted(monkeypatch):
    """Return texts that replace the Verilog of matchers, by their parameters; that of all others is the parameters."""
    texts = {}

    def emit(parameters):
        return texts.get((parameters.disparities, parameters.max_block_size, len(parameters.features)), repr(
            (parameters.max_width, parameters.disparities, parameters.max_block_size, sorted(parameters.features))))

    monkeypatch.setattr(measured, "emit", emit)
    monkeypatch.setattr("litestereo.sim.thesis.section.code_key", lambda *paths: content_key(map(str, paths)))
    monkeypatch.setattr(measured, "computed_key", lambda name, sources, parts: content_key(parts()))
    for function in (measured.matcher_key, measured.system_key):
        function.cache_clear()
    yield texts
    for function in (measured.matcher_key, measured.system_key):
        function.cache_clear()


def keys():
    """Return the keys of all sections at the scale of the page, by their labels."""
    measured.matcher_key.cache_clear()
    return {one.label: one.key(Scale()) for one in page.SECTIONS}


def test_keys_follow_the_verilog(emitted):
    """A change of the Verilog of one build makes the sections stale that measure it, and no others."""
    before = keys()
    assert keys() == before
    for build, stale in [
            ((16, 7, 1),   {"Table 5.1", "Table 5.3", "Table 5.4", "Table 5.5", "Table 5.6", "Table 5.7", "Figure 5.3",
                            "Figure 5.4", "Figure 5.5", "Figure 5.6"}),
            ((32, 9, 1),   {"Table 5.2"}),
            ((16, 31, 1),  {"Figure 5.3"}),
            ((64, 21, 1),  {"Figure 5.1"})]:
        emitted[build] = "another"
        assert {label for label, key in keys().items() if key != before[label]} == stale
        emitted.clear()


def test_keys_are_of_what_is_measured():
    """The code of gateware, link, boards and simulated SoCs counts by its Verilog only; a memory is in the system."""
    for one in page.SECTIONS:
        names = {str(path.relative_to(PACKAGE_DIR)) for path in one.files}
        assert all((PACKAGE_DIR / name).exists() for name in names)
        assert not {name for name in names if name.startswith(OTHERS)} - {"soc/parts/wide_ram.py"}
        assert f"sim/thesis/{Path(one.measure.__code__.co_filename).name}" in names
    assert {one.label for one in page.SECTIONS if one.system} == {"Table 5.5", "Table 5.7"}
    assert FIRMWARE_DIR / "reference" in section(page.SECTIONS, "Table 5.7").files


def test_the_system_is_matcher_and_dma(emitted, monkeypatch):
    """Its Verilog has both ports of the memory, and no Ethernet; another matcher in the SoC is another system."""
    texts = []
    monkeypatch.setattr(measured, "computed_key", lambda *arguments: texts.extend(arguments[2]()) or content_key(texts))
    first = measured.system_key()
    assert "stereo" in texts[0] and "ram" in texts[0] and "ethmac" not in texts[0]
    measured.system_key.cache_clear()
    monkeypatch.setattr(measured, "MATCHER", MatcherParameters(640, disparities=32, max_block_size=9))
    assert measured.system_key() != first
    assert len(texts) == 2 and texts[0] != texts[1]


def test_structure_follows_the_design(build):
    """The numbers in the tables grow with lanes and block as they do in the cores."""
    folder   = section(structure.SECTIONS, "Table 5.2").measured(SMALL)
    (few, many) = rows_of(section(structure.SECTIONS, "Table 5.2").markdown(folder))
    assert few  == ["16", "16", "15", "32", "64", str(16*5*5)]
    assert many == ["32", "32", "31", "64", "128", str(32*5*5)]
    (row,) = rows_of(section(structure.SECTIONS, "Table 5.1").markdown(
        section(structure.SECTIONS, "Table 5.1").measured(SMALL)))
    assert row[0] == "5x5" and row[4] == str(2*5*64)
    assert structure.held_at_once(5, 2, 16) == 5*6 + 5*(6 + 15)


def test_contents():
    """Operators without constants, register bits and memories of an elaborated core are counted."""
    parameters = MatcherParameters(64, 100, 48, 9, ["raw"])
    assert contents(Winner(parameters)).count("<") == 47
    found = contents(BlockSum(parameters))
    assert found.count("+") == found.count("-") == 48
    assert found.memories == {"block_columns": (48*12, 9)} and found.memory_bits("block_columns") == 48*12*9
    assert found.register_bits > 48*15


def test_clocks(build, monkeypatch):
    """The Verilog's clocks are measured, its maps compared, frame rates computed, and the plot drawn."""
    monkeypatch.setattr(clocks, "fits_system", lambda scale, preset: False)
    monkeypatch.setattr(clocks, "placed_mhz",  lambda scale, preset: 50.0)
    one  = section(clocks.SECTIONS, "Table 5.5")
    rows = rows_of(one.markdown(one.measured(SMALL)))
    assert all(64*20 < int(row[1]) < 1.5*64*20 for row in rows)
    one    = section(clocks.SECTIONS, "Table 5.6")
    folder = one.measured(SMALL)
    text   = one.markdown(folder)
    assert f"15.73 {PUBLISHED}" in text and (folder / "frame_rate.png").stat().st_size > 1000
    first = rows_of(text)[0]
    assert float(first[2]) == pytest.approx(1e8/int(rows[0][1]), abs=0.01)
    assert float(first[4]) == pytest.approx(float(first[2])/2, abs=0.01)
    monkeypatch.setattr(clocks, "stereo_bm", lambda left, right, settings: np.ones(left.shape, np.int16))
    with pytest.raises(clocks.WrongMap, match="64x20"):
        clocks.cosim_clocks(SMALL, SMALL.presets[0], [(64, 20)])


def test_serial_program(tmp_path):
    """The C program measures its time and returns the model's map."""
    left, right = textured_pair(50, 15, generator(90))
    pair        = StereoPair(left, right, np.zeros(left.shape, np.float32))
    seconds, disparity = serial.serial(serial.compiled(tmp_path), pair, Preset(16, 7))
    assert np.array_equal(disparity, stereo_bm(left, right, Preset(16, 7).settings()))
    assert 0 < seconds < 1


def test_cpu_clocks(monkeypatch):
    """Rows outside the strips take as long as the rows between them."""
    asked = []

    def bench(device, case, command):
        asked.append((command, *case))
        return type("Measurement", (), {"clocks": 1000 + 70*case[1]})

    monkeypatch.setattr(serial, "measure_frame", bench)
    pair = StereoPair(*(np.zeros((100, 40), np.uint8) for _ in range(2)), np.zeros((100, 40), np.float32))
    assert serial.cpu_clocks(None, SMALL, Preset(16, 7), pair) == 1000 + 70*100
    assert asked == [("cpu_bench", 40, rows, 16, 7, "sad") for rows in (8, 16)]


def test_overflow_of_sums():
    """Sums of enough bits give the model's map, fewer bits another one; widths are those of the largest sum."""
    left, right = textured_pair(60, 20, generator(91))
    pair, bare  = StereoPair(left, right, np.zeros(left.shape, np.float32)), Preset(16, 9)
    expected    = stereo_bm(left, right, bare.settings())
    bits        = overflow.widths(16, 9)["cost_bits"]
    assert bits == (255*81).bit_length()
    assert np.array_equal(overflow.wrapped_map(pair, bare, bits), expected)
    noise       = generator(92).integers(0, 256, (2, 20, 60), np.uint8)
    pair        = StereoPair(noise[0], noise[1], pair.truth)
    assert not np.array_equal(overflow.wrapped_map(pair, bare, bits - 3), stereo_bm(*noise, bare.settings()))


def test_pairs_are_asked_for(monkeypatch, tmp_path, capsys):
    """Without the data, or with a file missing, the command says at once, in one line, what it needs."""
    monkeypatch.delenv("LITESTEREO_DATA", raising=False)
    assert command.main() == 1
    message = capsys.readouterr().err
    assert message.startswith("thesis: error: LITESTEREO_DATA is not set: set it to the folder of")
    assert "tsukuba, venus, cones" in message and message.count("\n") == 1
    monkeypatch.setenv("LITESTEREO_DATA", str(tmp_path))
    with pytest.raises(DatasetError, match=re.escape(str(Path("tsukuba") / "left.png"))):
        middlebury.stereo_pair("tsukuba")
