#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Mutants are small, real and reproducible, and a campaign says which of them the tests notice."""

import ast
import random
from itertools import islice

import pytest

from campaigns.mutation import __main__ as campaign
from campaigns.mutation import c_faults, gateware_faults, python_faults
from campaigns.mutation.areas import AREAS, Area
from campaigns.mutation.explained import EXPLAINED
from campaigns.mutation.judge import PROGRAM, CampaignError, Judge
from campaigns.mutation.mutant import files_below, shuffled
from formal.__main__ import TASKS
from support.paths import CHECKOUT

KINDS = {
    gateware_faults.mutants_of: {"comparison", "operator", "sign", "off by one", "swapped operands", "missing register",
                                 "stuck at 0", "not connected"},
    python_faults.mutants_of:   {"comparison 1", "operator", "and or or", "sign", "truth", "off by one", "extreme",
                                 "another number", "nothing returned", "statement left out", "condition"},
    c_faults.mutants_of:        {"comparison", "operator", "and or or", "sign", "truth", "off by one",
                                 "statement left out"},
}
FILES = [(area, file) for area in AREAS.values() for file in campaign.files_of(area)]


def code(area: Area, source: str):
    """Return what a source says: its syntax tree, or its tokens."""
    if area.faults is c_faults.mutants_of:
        return [token.text for token in c_faults.tokens(source)]
    return ast.dump(ast.parse(source))


@pytest.mark.parametrize("area, file", FILES, ids=[file for _, file in FILES])
def test_a_mutant_differs_in_one_place(area: Area, file: str) -> None:
    """Each mutant can be parsed, differs from the file, and equals it before and after the fault."""
    source = (CHECKOUT / file).read_text()
    found  = area.faults(file)
    assert found
    assert len(set(found)) == len(found)
    for mutant in random.Random(1).sample(found, min(10, len(found))):
        assert code(area, mutant.source) != code(area, source), mutant.name
        lines = source.splitlines(), mutant.source.splitlines()
        above = mutant.line - 1
        assert lines[0][:above] == lines[1][:above], mutant.name
        # The fault's own lines, then all others.
        below = next(n for n in range(1, len(lines[0])) if mutant.before in " ".join(
            " ".join(lines[0][above:above + n]).split()))
        assert mutant.source.endswith("".join(f"\n{line}" for line in lines[0][above + below:]) + "\n"), mutant.name
        assert mutant.code in mutant.diff and mutant.diff.startswith("    @@")


@pytest.mark.parametrize("name", AREAS)
def test_the_seed_draws_them(name: str) -> None:
    """A seed draws the same mutants every time, all different, of each file one per round."""
    area  = AREAS[name]
    files = campaign.files_of(area)
    first = list(islice(shuffled(area.faults, files, 1), 40))
    assert first == list(islice(shuffled(area.faults, files, 1), 40))
    assert first != list(islice(shuffled(area.faults, files, 2), 40))
    assert len(set(first)) == 40
    assert {mutant.file for mutant in first[:len(files)]} == set(files) or len(files) > 40


@pytest.mark.parametrize("faults", KINDS)
def test_every_kind_is_drawn(faults) -> None:
    kinds = {mutant.kind for area, file in FILES if area.faults is faults for mutant in faults(file)}
    assert kinds >= KINDS[faults]


def test_what_is_no_fault_in_c(tmp_path, monkeypatch) -> None:
    """Comments, texts, preprocessor lines, declarations, lengths and labels are not changed; bodies are."""
    monkeypatch.setattr("campaigns.mutation.mutant.CHECKOUT", tmp_path)
    (tmp_path / "a.c").write_text("""\
#define MOST 7
static const int table[2] = { 1, 2 }; /* 3 < 4 */
static uint8_t *find(const uint8_t *text, int way)
{
    uint8_t *copy[8]; // 5 + 6
    char     sign = '9';
    switch (way) {
    case 3:
        put(&copy, "1 + 2", (uint8_t *)text);
    }
    way = way > 4 ? *text : -way;
    return !sign ? copy[1] : NULL;
}
""")
    found = [(mutant.line, mutant.before, mutant.after) for mutant in c_faults.mutants_of("a.c")]
    assert found == [
        (8, "3", "4"), (9, 'put(&copy, "1 + 2", (uint8_t *)text);', ";"),
        (11, "way = way > 4 ? *text : -way;", ";"), (11, ">", ">="), (11, "4", "5"), (11, "-", ""),
        (12, "!", ""), (12, "1", "2"),
    ]


def test_what_is_no_fault_in_python(tmp_path, monkeypatch) -> None:
    """Docstrings, annotations, decorators and texts are not changed."""
    monkeypatch.setattr("campaigns.mutation.mutant.CHECKOUT", tmp_path)
    (tmp_path / "a.py").write_text('''\
"""1 < 2"""
from a import b

@cached(3)
def find(text: Literal[4], way=5) -> Literal[6]:
    """Say 7."""
    if way and ready:
        raise ValueError(f"{way + 8} is wrong")
    return text[-9:]
''')
    found = {(mutant.line, mutant.before, mutant.after) for mutant in python_faults.mutants_of("a.py")}
    assert found == {
        (5, "5", "6"), (7, "way and ready", "way or ready"), (8, 'raise ValueError(f"{way + 8} is wrong")', "pass"),
        (9, "return text[-9:]", "return None"), (9, "-9", "9"), (9, "9", "10"),
    }


@pytest.mark.parametrize("name", AREAS)
def test_every_file_has_tests(name: str) -> None:
    """Each file with possible faults has tests that exist, or a reason to have none."""
    area  = AREAS[name]
    found = {file.removeprefix(area.prefix) for folder in area.folders for file in files_below(folder, *area.suffixes)
             if area.faults(file)}
    elsewhere = set().union(*(campaign.files_of(other) for other in AREAS.values() if other is not area))
    assert not {file for file in found - set(area.tests) - set(area.excluded) if area.prefix + file not in elsewhere}
    assert set(area.excluded) <= found and not set(area.excluded) & set(area.tests)
    programs = {path.stem for path in (CHECKOUT / "firmware" / "tests").rglob("test_*.c")}
    for tests in area.tests.values():
        assert tests
        for test in tests:
            if PROGRAM.fullmatch(test):
                assert test in programs
            elif ".py" in test:
                name, _, node     = test.partition("::")
                function, _, case = node.partition("[")
                source = (CHECKOUT / "tests" / name).read_text()
                assert not node or f"def {function}(" in source, test
                assert not case or case.removesuffix("]") in {task.name for task in TASKS}, test


def test_exceptions_are_of_this_source() -> None:
    """Each explained mutant is still one of the file: an exception ends with its line."""
    for (file, *rest), reason in EXPLAINED.items():
        area = next(area for area, name in FILES if name == file)
        assert tuple(rest) in {(mutant.code, mutant.before, mutant.after) for mutant in area.faults(file)}, (file, rest)
        assert reason


@pytest.fixture
def judge(tmp_path):
    return Judge(folder=tmp_path)


#: An area of each kind of faults: file, its tests, a fault that they notice, and one that they do not.
EXAMPLES = {
    "python": ("host", "host_tools/protocol/cobs.py", ("host_tools/protocol/test_cobs.py",)),
    "c":      ("firmware", "firmware/lib/bytes.c", ("test_crc32", "test_message")),
    "core":   ("crossings", "gateware/common/pulse_crossing.py",
               ("formal/test_formal.py::test_a_core_as_it_is_passes[PulseCrossing]",)),
}


@pytest.mark.parametrize("kind", EXAMPLES)
def test_a_fault_is_noticed(kind, judge) -> None:
    """The file as it is passes its tests, and a mutant does not; the second time both verdicts are known."""
    name, file, tests = EXAMPLES[kind]
    area   = AREAS[name]
    area   = Area(**vars(area) | {"tests": {file.removeprefix(area.prefix): tests}})
    mutant = next(shuffled(area.faults, [file], 1))
    assert judge.judge(area, mutant).result == "caught", judge.log.read_text()
    results = sorted(path.read_text() for path in judge.results.iterdir())
    assert ['"caught"' in results[0], '"survived"' in results[1]] == [True, True]
    judge.log.unlink()
    assert judge.judge(area, mutant).result == "caught"
    assert not judge.log.exists()
    assert (judge.copy / file).read_text() == (CHECKOUT / file).read_text()


def test_verdicts_of_programs(judge) -> None:
    """A fault that the tests do not notice survives, one that changes no code is unchanged, unless it is not compiled.

    One that does not compile is refused, and an endless loop is stopped.
    """
    file    = "firmware/lib/bytes.c"
    area    = Area(**vars(AREAS["firmware"]) | {"tests": {"lib/bytes.c": ("test_crc32",)}, "limit_s": 1})
    splicer = c_faults.Splicer(file)
    begin   = splicer.source.index("{") + 1
    results = {text: judge.judge(area, splicer.mutant("fault", begin, begin, text)).result for text in [
        " volatile int i = 0; (void)i;", ";", "/* 1 */", " nothing", " for (volatile int i = 0; i < 1;) { }"]}
    assert list(results.values()) == ["survived", "unchanged", "survived", "refused", "hung"], results


def test_verdicts_of_cores(judge) -> None:
    """A fault that changes no model is unchanged if the tests come to its place, and survives if they do not."""
    file    = "gateware/common/stream_register.py"
    tests   = {"common/stream_register.py": ("formal/test_formal.py::test_a_core_as_it_is_passes[add_register]",)}
    area    = Area(**vars(AREAS["crossings"]) | {"tests": tests})
    splicer = gateware_faults.Splicer(file)
    results = {}
    for code in ("data.source.connect(sink)", "module.comb += source.connect(sink)"):
        begin = splicer.source.index(code) + code.index("sink")
        results[code] = judge.judge(area, splicer.mutant("fault", begin, begin + len("sink"), "sink", True)).result
    assert list(results.values()) == ["unchanged", "survived"], results
    assert (judge.sound / "formal").is_dir() and not judge.builds.exists()
    assert (judge.copy / file).read_text() == (CHECKOUT / file).read_text()


def test_tests_that_fail_without_a_fault_judge_nothing(judge) -> None:
    file = "host_tools/protocol/cobs.py"
    area = Area(**vars(AREAS["host"]) | {"tests": {"protocol/cobs.py": (
        "host_tools/protocol/test_cobs.py", "-k", "no_such_test")}})
    with pytest.raises(CampaignError, match="pytest ended with status 5"):
        judge.judge(area, area.faults(file)[0])


def test_one_campaign_at_a_time(judge) -> None:
    with pytest.raises(CampaignError, match="another campaign is running"):
        Judge(folder=judge.results.parent)


def test_a_survivor_is_reported(judge, monkeypatch, capsys) -> None:
    """The status is 1 with a survivor, whose place and diff are printed, and 0 once it is explained."""
    file   = "host_tools/protocol/cobs.py"
    area   = Area(**vars(AREAS["host"]) | {"tests": {"protocol/cobs.py": ("host_tools/protocol/test_cobs.py",)}})
    mutant = next(shuffled(area.faults, [file], 1))
    monkeypatch.setattr(campaign, "AREAS", {"host": area})
    monkeypatch.setattr(campaign, "Judge", lambda number: judge)
    monkeypatch.setattr(judge, "judge", lambda area, mutant: campaign.Verdict("survived", 1.0))
    monkeypatch.setattr("sys.argv", ["mutation", "--count", "1"])
    assert campaign.main() == 1
    printed = capsys.readouterr().out
    assert f"survived: {mutant.name}\n{mutant.diff}\n" in printed
    assert printed.splitlines()[-1].split() == ["host", "1", "0", "(0)", "0", "(0)", "1"]
    monkeypatch.setitem(EXPLAINED, (file, mutant.code, mutant.before, mutant.after), "a reason")
    assert campaign.main() == 0
    assert capsys.readouterr().out.splitlines()[-1].split() == ["host", "1", "0", "(0)", "1", "(0)", "0"]


def test_one_area_and_one_file(monkeypatch, capsys) -> None:
    monkeypatch.setattr("sys.argv", ["mutation", "--areas", "host", "--files", "gateware/post/border.py"])
    with pytest.raises(SystemExit):
        campaign.main()
    assert "no such file in these areas: gateware/post/border.py" in capsys.readouterr().err
