#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The command `litestereo`: results, exit statuses, and one clear line for every mistake."""

import importlib.metadata
import json
import os
import pty
import re
import signal
import socket
import subprocess
import sys
import time

import cv2
import numpy as np
import pytest

from litestereo.host_tools.cli import info
from litestereo.host_tools.core.features import Feature
from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.host_tools.data.ground_truth import read_ground_truth
from litestereo.host_tools.evaluation.metrics import METRICS
from litestereo.host_tools.link import link
from litestereo.host_tools.link.settings import LinkSettings
from litestereo.host_tools.protocol import payloads
from litestereo.host_tools.protocol.messages import ErrorCode, Message, MessageType
from support.command import error_line, run
from support.data import stereo_folder
from support.expected import expected_map
from support.interruptible import interruptible
from support.native_device import native_device, native_udp_device
from support.pairs import generator, textured_pair
from support.scripted_device import framed, scripted_server
from support.udp_device import udp_device

COMMAND = [sys.executable, "-c", "import sys; from litestereo.host_tools.cli import main; sys.exit(main())"]


@pytest.fixture(scope="module")
def port():
    with native_device("--max-width", "200", "--max-disparities", "32", "--max-block-size", "11") as port_:
        yield port_


@pytest.fixture(scope="module")
def url(port):
    return f"tcp://127.0.0.1:{port}"


@pytest.fixture(scope="module")
def pair(tmp_path_factory):
    """Files of a pair of 120 x 50 pixels, 7 pixels apart, and its images."""
    folder      = tmp_path_factory.mktemp("pair")
    left, right = textured_pair(120, 50, generator(60))
    images      = {
        "left":   left,
        "right":  right,
        "narrow": right[:, :100],
        "tiny":   right[:8, :30],
        "wide":   np.zeros((50, 201), np.uint8),
        "high":   np.zeros((65535, 40), np.uint8),
        "truth":  np.full((50, 120), 28, np.uint8),
    }
    for name, image in images.items():
        cv2.imwrite(str(folder / f"{name}.png"), image)
    (folder / "text.png").write_text("no image")
    return folder


@pytest.fixture(autouse=True)
def no_device_in_the_environment(monkeypatch):
    monkeypatch.delenv("LITESTEREO_DEVICE", raising=False)


def match(pair_, *options, left="left.png", right="right.png", device="model:"):
    return ["match", pair_/left, pair_/right, "-o", pair_/"out", "--device", device, *options]


def rated(pair_):
    """Options for the truth, which is 7 pixels everywhere."""
    return ["--ground-truth", pair_/"truth.png", "--ground-truth-scale", 4]


def test_match_writes_the_map_and_a_summary(pair, url, tmp_path, capfd):
    images = [cv2.imread(str(pair / f"{name}.png"), cv2.IMREAD_GRAYSCALE) for name in ("left", "right")]
    status = run("match", pair/"left.png", pair/"right.png", "-o", tmp_path/"a"/"b", "--device", url,
                 "--disparities", 16, "--block-size", 7, *rated(pair))
    out, err = capfd.readouterr()
    assert (status, err) == (0, "")
    written = np.load(tmp_path / "a" / "b" / "disparity.npy")
    assert np.array_equal(written, expected_map(*images, MatcherSettings(16, 7)))
    for text in ("120x50", "16 disparities", "block size 7", "6000, 1.000 per pixel", "frames/s at 100 MHz",
                 "bad-1.0     0.00 % of the known pixels", "bad-2.0", "mean error  0.0", "mean over the valid pixels",
                 "density", "disparity_color.png"):
        assert text in out
    assert sorted(path.name for path in (tmp_path / "a" / "b").iterdir()) == [
        "disparity.npy", "disparity.pfm", "disparity.png", "disparity_color.png"]


def test_match_as_json(pair, url, capfd):
    assert run(*match(pair, "--json", *rated(pair), device=url)) == 0
    summary = json.loads(capfd.readouterr().out)
    assert (summary["width"], summary["height"]) == (120, 50)
    assert (summary["disparities"], summary["block_size"]) == (32, 9)
    assert summary["clocks"] == 6000 and summary["clocks_per_pixel"] == 1.0
    assert summary["fps_at_100_mhz"] == pytest.approx(1e8/6000)
    assert list(summary["quality"]) == list(METRICS)
    assert summary["quality"]["bad_1_0"] == 0 and summary["quality"]["avgerr"] < 0.1
    assert 50 < summary["quality"]["density"] < 100
    assert all(os.path.isfile(path) for path in summary["files"])


def test_match_with_a_device_that_counts_no_clocks(pair, capfd):
    assert run(*match(pair)) == 0
    assert "clocks" not in capfd.readouterr().out
    np.save(pair / "nothing.npy", np.zeros((50, 120), np.float32))
    assert run(*match(pair, "--json", "--ground-truth", pair/"nothing.npy")) == 0
    summary = json.loads(capfd.readouterr().out)
    assert summary["clocks"] is None and summary["quality"]["bad_1_0"] is None


def test_match_of_a_colour_pair_says_so(tmp_path, capfd):
    folder = stereo_folder("tsukuba")
    status = run("match", folder/"left.png", folder/"right.png", "-o", tmp_path, "--device", "model:",
                 "--disparities", 16, "--ground-truth", folder/"disp_left_u16.png")
    out, err = capfd.readouterr()
    assert status == 0
    assert err.count("litestereo: note:") == err.count("converted to grey") == 2
    bad = float(out.split("bad-1.0")[1].split("%")[0])
    assert 0 < bad < 30
    map_   = np.load(tmp_path / "disparity.npy")
    truth  = read_ground_truth(folder / "disp_left_u16.png")
    both   = (map_ >= 0) & np.isfinite(truth)
    wrong  = np.sum(np.abs(map_[both]/16 - truth[both]) > 1)
    assert bad == pytest.approx(100*wrong/np.isfinite(truth).sum(), abs=0.006)


def test_info(url, capfd):
    assert run("info", "--device", url) == 0
    out = capfd.readouterr().out
    for text in ("LiteStereo", "200x", "disparities  32", "5 to 11", "100 MHz", "firmware 0.1",
                 "dma_alignment 16, alignment of images", "lacks        64 disparities, the default of cv2.StereoBM",
                 "lacks        block size 21, the default of cv2.StereoBM", "lacks        images of 640x480"):
        assert text in out
    assert run("info", "--device", url, "--json") == 0
    told = json.loads(capfd.readouterr().out)
    assert (told["max_width"], told["max_disparities"], told["url"]) == (200, 32, url)
    assert told["capabilities"]["dma_alignment"] == 16
    assert told["lacks"] == {"stages": [], "disparities": 64, "block_size": 21, "size": [640, 480]}
    assert run("info", "--device", "model:") == 0
    out = capfd.readouterr().out
    assert "reference model" in out
    assert out.splitlines()[-1] == "lacks        nothing that cv2.StereoBM has"


def test_info_names_the_stages_that_a_device_lacks(capfd):
    """Those of cv2.StereoBM: it has neither a median nor matching without prefilter."""
    with udp_device() as there:
        there.features = int(Feature.XSOBEL | Feature.SUBPIXEL)
        assert run("info", "--device", there.url) == 0
        out = capfd.readouterr().out
        assert run("info", "--device", there.url, "--json") == 0
    assert ("lacks        of cv2.StereoBM: the texture test, the uniqueness test, the left-right check, "
            "a smallest disparity above 0\n") in out
    assert json.loads(capfd.readouterr().out)["lacks"]["stages"] == ["texture", "uniqueness", "left_right",
                                                                     "min_disparity"]


def test_stats(url, capfd):
    assert run("stats", "--device", url) == 0
    lines = dict(line.split() for line in capfd.readouterr().out.splitlines())
    assert list(lines) == list(payloads.COUNTERS)
    assert int(lines["sessions"]) > 0
    assert run("stats", "--device", url, "--json") == 0
    assert list(json.loads(capfd.readouterr().out)) == list(payloads.COUNTERS)


def test_match_tells_how_fast_the_link_was(pair, url, capfd):
    assert run(*match(pair, "--json", device=url)) == 0
    summary = json.loads(capfd.readouterr().out)
    for phase in ("upload", "download"):
        assert summary[f"{phase}_mb_per_s"] == pytest.approx(12000/summary[f"{phase}_s"]/1e6)
    assert summary["repairs"] == 0
    assert run(*match(pair, device=url)) == 0
    assert re.search(r"^link +upload [0-9.e+]+ MB/s, download [0-9.e+]+ MB/s, repairs 0$", capfd.readouterr().out, re.M)
    assert run(*match(pair, "--json")) == 0
    summary = json.loads(capfd.readouterr().out)
    assert summary["upload_mb_per_s"] is summary["download_mb_per_s"] is summary["repairs"] is None


def test_a_device_on_a_network(pair, capfd):
    with native_udp_device() as port:
        there = f"udp://127.0.0.1:{port}"
        assert run("info", "--device", there) == 0
        assert there in capfd.readouterr().out
        assert run(*match(pair, "--disparities", 32, device=there)) == 0
        assert "repairs 0" in capfd.readouterr().out
        assert run("stats", "--device", there) == 0
        lines  = capfd.readouterr().out.splitlines()
        groups = [line for line in lines if not line.startswith(" ")]
        names  = [line.split()[0] for line in lines if line.startswith(" ")]
        assert groups == ["throughput:", "loss:", "repairs:", "others:"]
        assert sorted(names) == sorted(payloads.COUNTERS)
        assert lines.index("loss:") < next(index for index, line in enumerate(lines) if "malformed" in line)
        assert run("stats", "--device", there, "--json") == 0
        assert json.loads(capfd.readouterr().out)["chunks_received"] == 12
        assert run("console", "--device", there, "help") == 1
        assert "serial line" in error_line(capfd)


def test_console(url, capfd):
    assert run("console", "--device", url, "help") == 0
    assert capfd.readouterr().out.startswith("help: ")
    assert run("console", "--device", url, "selftest") == 0
    assert "selftest: passed" in capfd.readouterr().out
    assert run("console", "--device", url, "bench", 100, 40, 16, 7, "sad") == 0
    assert "clocks=4000" in capfd.readouterr().out


@pytest.mark.parametrize(("line", "text"), [("nonsense", "unknown command"), ("bench", "usage: bench"),
                                            ("bench 9999 9999 16 7 sad", "refused")])
def test_console_commands_that_fail(url, line, text, capfd):
    assert run("console", "--device", url, *line.split()) == 1
    assert text in capfd.readouterr().out


def test_a_failed_self_test_fails_the_command(capfd):
    with native_device("--bus-error") as broken:
        assert run("console", "--device", f"tcp://127.0.0.1:{broken}", "selftest") == 1
    assert "selftest: FAILED" in capfd.readouterr().out


def test_the_environment_names_the_device(monkeypatch, url, capfd):
    monkeypatch.setenv("LITESTEREO_DEVICE", url)
    assert run("info", "--json") == 0
    assert json.loads(capfd.readouterr().out)["url"] == url


COMMANDS = ("match", "eval", "export", "info", "stats", "console", "update")


@pytest.mark.parametrize("arguments", [["--help"], ["--version"], *([command, "--help"] for command in COMMANDS)])
def test_help_and_version(arguments, capfd):
    assert run(*arguments) == 0
    out, err = capfd.readouterr()
    assert err == ""
    if arguments == ["--version"]:
        assert out == f"litestereo {importlib.metadata.version('litestereo')}\n"
    else:
        assert "example" in out and "litestereo" in out
        assert "default" in out


# Mistakes of usage: status 2.

@pytest.mark.parametrize(("arguments", "text"), [
    ([], "COMMAND"),
    (["nonsense"], "invalid choice"),
    (["match"], "required"),
    (["info"], "--device"),
    (["info", "--device", "foo:"], "tcp://127.0.0.1:2000"),
    (["info", "--device", "tcp://host:99999"], "port must be a number"),
    (["info", "--device", "tcp://host"], "tcp://127.0.0.1:2000"),
    (["info", "--device", "model:?colour=blue"], "unknown option 'colour'"),
    (["info", "--device", "serial:/dev/null?baud=fast"], "baud must be a whole number"),
    (["stats"], "--device"),
    (["update", "--device", "model:"], "FILE"),
    (["update", "firmware.bin"], "--device"),
    (["update", "f", "--device", "model:", "--restart-limit", "0"], "above 0"),
    (["stats", "--device", "model"], "tcp://127.0.0.1:2000"),
    (["stats", "--device", "model:", "all"], "unrecognized"),
    (["console", "--device", "model:"], "COMMAND"),
    (["console", "--device", "model:", "--timeout", "never", "help"], "above 0"),
    (["match", "l", "r", "-o", "o", "--device", "model:", "--block-size", "8"], "odd"),
    (["match", "l", "r", "-o", "o", "--device", "model:", "--block-size", "3"], "from 5 on"),
    (["match", "l", "r", "-o", "o", "--device", "model:", "--block-size", "x"], "whole number"),
    (["match", "l", "r", "-o", "o", "--device", "model:", "--disparities", "40"], "multiple of 16"),
    (["match", "l", "r", "-o", "o", "--device", "model:", "--disparities", "0"], "multiple of 16"),
    (["match", "l", "r", "-o", "o", "--device", "model:", "--ground-truth-scale", "0"], "above 0"),
    (["match", "l", "r", "-o", "o", "--dev", "model:"], "required"),
])
def test_wrong_usage_is_one_line_and_status_2(arguments, text, capfd):
    assert run(*arguments) == 2
    assert text in error_line(capfd)


# Failures: status 1.

@pytest.mark.parametrize(("options", "text"), [
    ({"left": "none.png"}, "no such file"),
    ({"right": "text.png"}, "is not an image"),
    ({"right": "narrow.png"}, "one size"),
    ({"left": "tiny.png", "right": "tiny.png"}, "too small"),
])
def test_wrong_images_are_one_line_and_status_1(pair, options, text, capfd):
    assert run(*match(pair, **options)) == 1
    assert text in error_line(capfd)


@pytest.mark.parametrize(("options", "text"), [
    (["--block-size", 13], "block sizes from 5 to 11"),
    (["--disparities", 64], "has 32 disparities"),
])
def test_what_the_device_was_not_built_for(pair, url, options, text, capfd):
    assert run(*match(pair, *options, device=url)) == 1
    assert text in error_line(capfd)


def test_images_too_large_for_the_device(pair, url, capfd):
    assert run(*match(pair, left="wide.png", right="wide.png", device=url)) == 1
    assert "201x50 pixels are too large" in error_line(capfd)
    assert run(*match(pair, left="high.png", right="high.png", device=url)) == 1
    assert "40x65535 pixels are too large" in error_line(capfd)


def test_images_are_checked_before_connecting(pair, capfd):
    nowhere = "tcp://127.0.0.1:1"
    for options in ({"left": "none.png"}, {"right": "narrow.png"}):
        assert run(*match(pair, device=nowhere, **options)) == 1
        assert "127.0.0.1" not in error_line(capfd)
    for more in (["--ground-truth", "none.png"], ["--ground-truth", pair/"tiny.png"],
                 ["--disparities", 128, "--block-size", 9]):
        assert run(*match(pair, *more, device=nowhere)) == 1
        assert "127.0.0.1" not in error_line(capfd)


def test_output_that_cannot_be_written(pair, capfd):
    for folder, text in ((pair/"text.png", "the results need a folder"),
                         (pair/"text.png"/"sub", "cannot be written")):
        assert run("match", pair/"left.png", pair/"right.png", "-o", folder, "--device", "model:") == 1
        assert text in error_line(capfd)


def test_no_device(pair, tmp_path, capfd):
    with socket.create_server(("127.0.0.1", 0)) as server:
        free = server.getsockname()[1]
    for device, text in ((f"tcp://127.0.0.1:{free}", "refused the connection"),
                         (f"serial:{tmp_path}/tty", "no such port"),
                         ("tcp://no-such-host.invalid:1", "cannot connect"),
                         (f"udp://127.0.0.1:{free}", "nothing listens there"),
                         ("udp://no-such-host.invalid", "cannot find")):
        for command in (["info"], ["stats"], ["console", "help"]):
            assert run(*command, "--device", device) == 1
            assert text in error_line(capfd)
        assert run(*match(pair, device=device)) == 1
        assert text in error_line(capfd)


def test_a_busy_port(capfd):
    master, slave = pty.openpty()
    from litestereo.host_tools.link.transports.serial_port import SerialTransport

    other = SerialTransport(os.ttyname(slave), 115200)
    assert run("info", "--device", f"serial:{os.ttyname(slave)}") == 1
    assert "busy" in error_line(capfd)
    other.close()
    os.close(slave)
    os.close(master)


@pytest.fixture
def impatient(monkeypatch):
    """Limits that are over soon, in place of the default ones."""
    monkeypatch.setattr(link, "LinkSettings", lambda: LinkSettings(timeout_floor_s=0.1, hello_limit_s=0.6))


def test_a_device_that_never_answers(impatient, capfd):
    with scripted_server(lambda request: b"") as silent:
        begin = time.monotonic()
        assert run("info", "--device", silent) == 1
        assert "has not answered" in error_line(capfd)
        assert time.monotonic() - begin < 5


def test_a_device_that_only_talks(impatient, capfd):
    with scripted_server(lambda request: b"login: ") as other:
        assert run("info", "--device", other) == 1
        assert "has not answered" in error_line(capfd)


def test_a_device_that_hangs_up(capfd):
    with scripted_server(None) as closing:
        assert run("info", "--device", closing) == 1
    assert "closed the connection" in (line := error_line(capfd)) or "lost" in line


def test_a_device_of_another_version(capfd):
    def script(request):
        error = payloads.pack_error(ErrorCode.VERSION, request.type, 3)
        return framed(Message(MessageType.ERROR, 0, request.sequence, payload=error, version=3))

    with scripted_server(script) as newer:
        assert run("info", "--device", newer) == 1
    assert "protocol version 3" in error_line(capfd)


def test_a_matcher_that_fails(pair, capfd):
    with native_device("--bus-error") as broken:
        assert run(*match(pair, device=f"tcp://127.0.0.1:{broken}")) == 1
    assert "could not match" in error_line(capfd)


def test_ctrl_c_in_this_process(monkeypatch, capfd):
    def interrupt(_):
        raise KeyboardInterrupt

    monkeypatch.setattr(info, "connect", interrupt)
    assert run("info", "--device", "model:") == 130
    assert capfd.readouterr().err == "litestereo: interrupted\n"


# The same as separate processes.

def process(*arguments):
    return subprocess.run([*COMMAND, *map(str, arguments)], capture_output=True, text=True, check=False)


def test_processes_end_as_main_does(pair):
    missing = process(*match(pair, left="none.png"))
    assert (missing.returncode, missing.stdout) == (1, "")
    assert missing.stderr == f"litestereo: error: {pair}/none.png: there is no such file\n"
    usage = process("match")
    assert usage.returncode == 2 and usage.stderr.count("\n") == 1
    fine = process(*match(pair))
    assert (fine.returncode, fine.stderr) == (0, "")


def test_ctrl_c_of_a_process():
    with scripted_server(lambda request: b"") as silent, interruptible(
            [*COMMAND, "info", "--device", silent], stderr=subprocess.PIPE) as running:
        time.sleep(1.5)
        running.send_signal(signal.SIGINT)
        _, err = running.communicate(timeout=10)
    assert (running.returncode, err) == (130, "litestereo: interrupted\n")


def test_a_reader_that_goes_away_is_no_traceback():
    ended = subprocess.run(f"{sys.executable} -c 'import sys; from litestereo.host_tools.cli import main; "
                           "sys.exit(main([\"info\", \"--device\", \"model:\"]))' | true",
                           shell=True, capture_output=True, text=True, check=False)
    assert ended.stderr == ""


def test_importing_prints_nothing():
    imports = "import litestereo.host_tools.cli.match, litestereo.host_tools.data.datasets"
    done    = subprocess.run([sys.executable, "-c", imports], capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == ("", "")


def test_what_a_truth_was_read_as_is_said(pair, tmp_path, capfd):
    """And a scale that the images contradict is refused: without one 8 bits are pixels."""
    def rated_by(*truth):
        status = run("match", pair/"left.png", pair/"right.png", "-o", tmp_path/"out", "--device", "model:", "--json",
                     "--disparities", 16, "--block-size", 7, "--ground-truth", *truth)
        out, err = capfd.readouterr()
        return status, err, json.loads(out)["quality"] if out else None

    status, err, _ = rated_by(pair/"truth.png")
    assert status == 1 and "the images agree with 4: give --ground-truth-scale 4" in err and err.count("\n") == 1
    status, err, quality = rated_by(pair/"truth.png", "--ground-truth-scale", 4)
    assert (status, err) == (0, "") and quality["bad_1_0"] == 0
    cv2.imwrite(str(tmp_path / "pixels.png"), np.full((50, 120), 7, np.uint8))
    np.save(tmp_path / "int16.npy", np.full((50, 120), 7*16, np.int16))
    for name, said in (("pixels.png", "8-bit image, in pixels"), ("int16.npy", "int16 in .npy, in sixteenths")):
        status, err, again = rated_by(tmp_path/name)
        assert (status, again) == (0, quality) and err.count("\n") == 1 and f"{name}: read as {said}" in err
    np.save(tmp_path / "far.npy", np.where(np.arange(120) < 30, 20, 7)*np.ones((50, 1), np.float32))
    status, err, _ = rated_by(tmp_path/"far.npy")
    assert status == 0 and "25.00 % of the true disparities are out of the range searched, 0 to 15 pixels" in err
