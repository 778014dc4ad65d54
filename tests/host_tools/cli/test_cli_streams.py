#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The standard streams in every state, under every command: files are written, one line at most is told."""

import itertools
import json
import os
import pty
import subprocess
import sys
import threading

import cv2
import numpy as np
import pytest

from litestereo.host_tools.cameras.camera_info import ideal_cameras, write_camera_info
from litestereo.host_tools.cameras.rectify import FILES
from litestereo.host_tools.core.geometry import StereoGeometry
from litestereo.host_tools.core.images import write_disparity
from litestereo.host_tools.core.settings import MatcherSettings
from support.data_sets import write
from support.expected import expected_map
from support.pairs import generator, textured_pair

COMMAND = [sys.executable, "-c", "import sys; from litestereo.host_tools.cli import main; sys.exit(main())"]
SMALL   = ["--device", "model:", "--disparities", "16"]

#: Commands, and files that they write; names with other letters than ASCII.
COMMANDS = {
    "match":   (["match", "l\u00e9.png", "r.png", "-o", "\u00f6ut", *SMALL], ["\u00f6ut/disparity.npy"]),
    "json":    (["match", "l\u00e9.png", "r.png", "-o", "\u00f6ut", *SMALL, "--json"], ["\u00f6ut/disparity.npy"]),
    "stream":  (["stream", "pairs", "-o", "\u00f6ut", *SMALL, "--json"],
                ["\u00f6ut/disparity_0\u00e9.png", "\u00f6ut/disparity_2\u00e9.png"]),
    "rectify": (["rectify", "l\u00e9.png", "r.png", "-o", "\u00f6ut", "--calibration", "cal"],
                ["\u00f6ut/left.png", "\u00f6ut/right.yaml"]),
    "export":  (["export", "map/disparity.npy", "-o", "\u00f6ut", "--format", "pfm"], ["\u00f6ut/disparity.pfm"]),
    "eval":    (["eval", "t\u00e9ddy", "--csv", "\u00f6.csv", *SMALL], ["\u00f6.csv"]),
    "view":    (["view", "pairs", "--montage", "\u00f6.png", *SMALL], ["\u00f6.png"]),
    "info":    (["info", "--device", "model:"], []),
    "help":    (["match", "--help"], []),
    "version": (["--version"], []),
}
STDOUT = ("open", "closed", "full", "departed", "ascii")
STDERR = ("open", "closed", "full")


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    folder      = tmp_path_factory.mktemp("streams")
    left, right = textured_pair(96, 40, generator(240), 5)
    write(folder, {"l\u00e9.png": left, "r.png": right})
    for number in range(3):
        for side, image in (("left", left), ("right", right)):
            write(folder/"pairs"/side, {f"{number}\u00e9.png": image})
    write(folder/"t\u00e9ddy", {"left.png": left, "right.png": right,
                                "disp_left_u16.png": np.full(left.shape, 256*5, np.uint16)})
    write_disparity(folder/"map", expected_map(left, right, MatcherSettings(16)), MatcherSettings(16))
    for name, camera in zip(FILES, ideal_cameras(StereoGeometry(96, 40, 100.0, 0.06, 48.0, 20.0, 48.0)), strict=True):
        write_camera_info(folder/"cal"/name, camera)
    return folder


def launched(arguments, folder, stdout, stderr, tmp_path):
    """Run a command with streams in these states, and give its status and what it wrote to them."""
    outs = {name: tmp_path/name for name in ("out", "err")}
    redirections = {
        "open": f">{outs['out']}", "ascii": f">{outs['out']}", "closed": ">&-", "full": ">/dev/full", "departed": "",
    }
    errors = {"open": f"2>{outs['err']}", "closed": "2>&-", "full": "2>/dev/full"}
    # The reader of the pipe has gone before the first word: the shell waits for it.
    script = f'"$@" {redirections[stdout]} {errors[stderr]}'
    if stdout == "departed":
        script = f'mkfifo "{tmp_path}/fifo"; : <"{tmp_path}/fifo" & exec 3>"{tmp_path}/fifo"; wait; ' \
                 f'"$@" >&3 {errors[stderr]}'
    environment = {name: value for name, value in os.environ.items() if name != "LITESTEREO_DEVICE"}
    environment |= {"PYTHONUTF8": "0", "LC_ALL": "C.UTF-8",
                    "PYTHONIOENCODING": "ascii" if stdout == "ascii" else "utf-8"}
    done = subprocess.run(["sh", "-c", script, "sh", *COMMAND, *arguments], cwd=folder, env=environment, check=False,
                          timeout=120)
    return done.returncode, *(path.read_text() if path.exists() else "" for path in outs.values())


#: Every command with its stdout in every state, and with two states of both streams.
CASES = [*(case if case[0] in ("match", "help") else pytest.param(*case, marks=pytest.mark.long)
           for case in itertools.product(COMMANDS, STDOUT, ["open"])),
         *((name, STDOUT[(index + shift) % len(STDOUT)], STDERR[(index + shift) % 3])
           for index, name in enumerate(COMMANDS) for shift in (1, 2))]


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full")
@pytest.mark.parametrize(("name", "stdout", "stderr"), CASES)
def test_streams(name, stdout, stderr, data, tmp_path):
    arguments, files = COMMANDS[name]
    # Each result is away before the command, and there after it.
    for file in files:
        (data/file).unlink(missing_ok=True)
    status, out, err = launched(arguments, data, stdout, stderr, tmp_path)
    assert status == {"open": 0, "ascii": 0, "closed": 0, "full": 1, "departed": 1}[stdout], err
    assert all((data/file).stat().st_size for file in files)
    assert "Traceback" not in err and err.count("\n") <= 1
    if stdout == "full" and stderr == "open":
        assert err == "litestereo: error: the output cannot be written to stdout: No space left on device\n"
    elif stderr == "open":
        assert err == ""
    if stdout in ("open", "ascii"):
        assert out.isascii() or stdout == "open"
        assert len(out) > 10


@pytest.mark.parametrize("stderr", STDERR)
@pytest.mark.parametrize(("arguments", "status"), [
    (["match", "none.png", "r.png", "-o", "x", *SMALL], 1), (["match"], 2), (["info", "--device", "model:?a=b"], 2)])
def test_an_error_has_its_status_in_any_state(arguments, status, stderr, data, tmp_path):
    found, out, err = launched(arguments, data, "open", stderr, tmp_path)
    assert (found, out) == (status, "")
    assert err.count("\n") == (stderr == "open") and "Traceback" not in err


def test_a_file_does_not_get_what_is_printed(data, tmp_path):
    """With stderr closed the next file would have its number, and messages of libraries would be in it."""
    (data/"broken.png").write_bytes((data/"r.png").read_bytes()[:-200])
    script = ('exec 2>&-; "$@"')
    words  = ["match", "l\u00e9.png", "broken.png", "-o", "x", *SMALL]
    done   = subprocess.run(["sh", "-c", script, "sh", *COMMAND, *words], cwd=data, capture_output=True, check=False,
                            timeout=60)
    assert (done.returncode, done.stdout, done.stderr) == (1, b"", b"")


def test_a_stream_that_only_prints_ends_with_its_reader(data):
    """Without -o there is nothing more to do: the pairs of a camera have no end."""
    for number in range(3, 300):
        for side in ("left", "right"):
            os.makedirs(data/"many"/side, exist_ok=True)
            if not (data/"many"/side/f"{number}.png").exists():
                os.symlink(data/"pairs"/side/"0\u00e9.png", data/"many"/side/f"{number}.png")
    with subprocess.Popen([*COMMAND, "stream", "many", *SMALL, "--json"], cwd=data, stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, text=True) as running:
        assert json.loads(running.stdout.readline())["frame"] == 0
        running.stdout.close()
        assert running.wait(60) == 1
        assert running.stderr.read() == ""


def test_bars_are_on_a_terminal_and_results_on_stdout(data):
    """Rich must not take what is printed while the bars are shown."""
    master, slave = pty.openpty()
    shown = []

    def reading():
        try:
            while chunk := os.read(master, 4096):
                shown.append(chunk)
        except OSError: # The other side is closed.
            pass

    reader = threading.Thread(target=reading)
    reader.start()
    done = subprocess.run([*COMMAND, "stream", "pairs", *SMALL, "--json"], cwd=data, stdout=subprocess.PIPE,
                          stderr=slave, text=True, check=False, timeout=60, env={**os.environ, "TERM": "xterm"})
    os.close(slave)
    reader.join(20)
    os.close(master)
    assert done.returncode == 0
    assert [json.loads(line).get("frame") for line in done.stdout.splitlines()] == [0, 1, 2, None]
    assert b"frames/s" in b"".join(shown) and b"latency_s" not in b"".join(shown)


def test_no_bars_without_a_terminal(data, tmp_path):
    environment = {**os.environ, "FORCE_COLOR": "1", "TERM": "xterm"}
    done = subprocess.run([*COMMAND, "stream", "pairs", *SMALL, "--json"], cwd=data, capture_output=True, text=True,
                          check=False, timeout=60, env=environment)
    assert (done.returncode, done.stderr) == (0, "")
    assert cv2.imread(str(data/"r.png")) is not None
