#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The host tools' fuzz targets find nothing, and their runner finds a planted fault."""

import subprocess
import sys

import pytest

from campaigns.fuzz import host
from litestereo.host_tools.core.errors import ImageError
from support.paths import CHECKOUT


@pytest.mark.parametrize("seconds", [3, pytest.param(10, marks=pytest.mark.long)])
@pytest.mark.parametrize("name", sorted(host.TARGETS))
def test_a_target_finds_nothing(name, seconds):
    result = host.run(name, seconds, seed=seconds)
    assert not result.fault, result
    assert result.executions > len(host.SEEDS[name]) and result.outcomes.most_common(1)
    # Valid files are read: a target that refuses everything tests nothing.
    assert result.outcomes["read"], result.outcomes


def planted(data):
    """Fails for the fourth byte of an input, deep enough that a mutation has to find it."""
    if data[3:4] == b"\xff":
        raise KeyError("planted")


def two_lines(data):
    if len(data) > 100:
        raise ImageError("one line\nand another")


@pytest.mark.parametrize(("target", "text"), [(planted, "KeyError: 'planted' (test_host.py:"),
                                              (two_lines, "not one line")])
def test_a_planted_fault_is_found_and_its_input_kept(target, text, tmp_path, monkeypatch):
    monkeypatch.setenv("LITESTEREO_BUILD", str(tmp_path))
    monkeypatch.setitem(host.SEEDS, "planted", [bytes(60)])
    result = host.run("planted", 20, targets={"planted": target})
    assert text in result.fault and "FAULT" in str(result)
    assert host.outcome(target, result.input.read_bytes())[1] == result.fault
    assert result.input.is_relative_to(tmp_path)


def test_what_takes_too_long_is_a_fault(monkeypatch):
    monkeypatch.setattr(host, "LIMIT_S", -1)
    assert "took" in host.outcome(len, b"")[1]


def test_the_campaign_prints_a_line_for_each_target():
    command = [sys.executable, "-m", "campaigns.fuzz.host", "--seconds", "1", "--targets", "npy", "map-pfm"]
    done = subprocess.run(command, cwd=CHECKOUT/"tests", capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0, done
    assert [line.split()[0] for line in done.stdout.splitlines()] == ["npy", "map-pfm"]
    assert all("executions" in line and "outcomes" in line for line in done.stdout.splitlines())


def test_the_campaign_fails_with_a_fault(monkeypatch, capsys):
    monkeypatch.setattr(host.resource, "setrlimit", lambda *_: None)
    monkeypatch.setitem(host.TARGETS, "npy", planted)
    monkeypatch.setattr(sys, "argv", ["host", "--seconds", "20", "--targets", "npy"])
    assert host.main() == 1
    assert "FAULT: KeyError" in capsys.readouterr().out
