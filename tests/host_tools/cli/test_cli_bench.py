#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""`litestereo bench` and `litestereo completion`, and the help of every command."""

import json
import shutil
import subprocess

import pytest

from support.command import error_line, run
from support.native_device import native_udp_device

COMMANDS = ["match", "stream", "view", "calibrate", "calibration", "rectify", "eval", "export", "bench", "info",
            "stats", "console", "completion"]


@pytest.fixture(autouse=True)
def no_device_in_the_environment(monkeypatch):
    monkeypatch.delenv("LITESTEREO_DEVICE", raising=False)


def test_bench_of_a_device_on_a_network(capfd):
    with native_udp_device() as port:
        url = f"udp://127.0.0.1:{port}"
        assert run("bench", "--device", url, "--size", "160x60", "--size", "96x40", "--frames", 3, "--disparities", 32,
                   "--json") == 0
        told = json.loads(capfd.readouterr().out)
        # Warm-up, single frames, and the stream.
        assert run("stats", "--device", url, "--json") == 0
        assert json.loads(capfd.readouterr().out)["frames_matched"] == 2*(1 + 3 + 3)
    assert (told["url"], told["disparities"], told["block_size"]) == (url, 32, 9)
    assert [(size["width"], size["height"], size["clocks"]) for size in told["sizes"]] == [(160, 60, 9600),
                                                                                          (96, 40, 3840)]
    for size in told["sizes"]:
        assert 0 < size["latency_p50_s"] <= size["latency_p95_s"] <= size["latency_p99_s"] < 10
        assert size["link_mb_per_s"] == pytest.approx(size["frames_per_s"]*4*size["width"]*size["height"]/1e6)


def test_bench_for_people(capfd):
    """The default sizes are those that the device takes; a device in this process has no link."""
    assert run("bench", "--device", "model:?max_width=200&disparities=32", "--frames", 2) == 0
    out, err = capfd.readouterr()
    assert err == "" and "160x120" in out and "320x240" not in out
    for text in ("reference model at model:", "frames/s", "latency 50 %", " ms", " - "):
        assert text in out


@pytest.mark.parametrize(("arguments", "status", "text"), [
    (["--size", "640"], 2, "like 640x480"),
    (["--size", "39x40"], 1, "too small"),
    (["--size", "640x480"], 1, "too large"),
    (["--frames", "0"], 2, "at least 1"),
    (["--disparities", "64"], 1, "64 are too many"),
    (["--speckle-window", "9"], 2, "unrecognized"),
])
def test_mistakes_of_bench(arguments, status, text, capfd):
    assert run("bench", "--device", "model:?max_width=200&disparities=32", *arguments) == status
    assert text in error_line(capfd)


@pytest.mark.parametrize("shell", ["bash", "zsh", "tcsh", "fish"])
def test_completion_scripts_name_every_command(shell, capfd):
    assert run("completion", shell) == 0
    script, err = capfd.readouterr()
    assert err == "" and all(command in script for command in COMMANDS)
    if shutil.which(shell) and shell not in ("tcsh", "fish"):
        subprocess.run([shell, "-n"], input=script, text=True, check=True)


@pytest.mark.parametrize(("words", "wanted"), [
    (["str"], "stream"),
    (["match", "--disp1"], "--disp12-max-diff"),
    (["calibrate", "--model", "rat"], "rational_polynomial"),
])
def test_bash_completes(words, wanted, tmp_path, capfd):
    assert run("completion", "bash") == 0
    (tmp_path/"script").write_text(capfd.readouterr().out)
    program = f"source {tmp_path}/script; COMP_WORDS=(litestereo {' '.join(words)}); COMP_CWORD={len(words)}; " \
              "_shtab_litestereo; echo ${COMPREPLY[@]}"
    done    = subprocess.run(["bash", "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.split() == [wanted]


@pytest.mark.parametrize(("arguments", "text"), [([], "required"), (["ksh"], "invalid choice"),
                                                 (["bash", "--device", "model:"], "unrecognized")])
def test_mistakes_of_completion(arguments, text, capfd):
    assert run("completion", *arguments) == 2
    assert text in error_line(capfd)


def test_the_help_names_every_command(capfd):
    assert run("--help") == 0
    out = capfd.readouterr().out
    assert [command for command in COMMANDS if f"\n    {command}" not in out] == []
    assert "exit status: 0 success, 1 failure, 2 wrong usage, 130 interrupted" in out


@pytest.mark.parametrize("command", COMMANDS)
def test_the_help_of_a_command_has_examples(command, capfd):
    assert run(command, "--help") == 0
    out, err = capfd.readouterr()
    assert err == "" and "example" in out and f"\n  litestereo {command} " in out
    if command not in ("console", "completion"):
        assert "--json" in out
