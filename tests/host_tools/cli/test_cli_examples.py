#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The examples of all help texts are commands that work: each is parsed as printed, and run on made-up files."""

import argparse
import shlex

import cv2
import numpy as np
import pytest

from litestereo.host_tools import cli
from litestereo.host_tools.cameras.camera_info import ideal_cameras, write_camera_info
from litestereo.host_tools.cameras.rectify import FILES
from litestereo.host_tools.cli import evaluate
from litestereo.host_tools.core.geometry import StereoGeometry
from litestereo.host_tools.data.datasets import StereoPair
from support import data_sets, rig
from support.command import run
from support.native_device import native_ports
from support.pairs import generator, textured_pair
from support.videos import FakeCapture, write_video

WIDTH, HEIGHT, SHIFT = 160, 40, 20

#: Commands that need what no test has here, and are parsed only: a firmware file, which test_update.py makes.
PARSED_ONLY = ("update",)


def helps():
    """Help texts of the command and of each of its subcommands."""
    parser = cli._parser()
    (commands,) = (action for action in parser._actions if isinstance(action, argparse._SubParsersAction))
    return [parser.format_help(), *(command.format_help() for command in commands.choices.values())]


def examples():
    """Words of each example, without `litestereo`, comments and redirections."""
    lines = [line.strip() for text in helps() for line in text.splitlines() if line.startswith("  litestereo ")]
    words = [shlex.split(line, comments=True)[1:] for line in dict.fromkeys(lines)]
    return [[word for word in line if not word.startswith(">")] for line in words]


EXAMPLES = examples()


def test_every_command_has_an_example():
    assert all("\n  litestereo " in text for text in helps())
    assert len(EXAMPLES) > 40


@pytest.fixture(scope="module")
def ports():
    with native_ports("--max-width", "640", "--max-disparities", "64", "--max-block-size", "15", "--flash",
                      "--rectification", "64") as both:
        yield both


def write_pairs(folder, pair):
    """The pair as two images, folders, a video, and with its truth, calibrations and data sets."""
    left, right = pair
    truth       = np.full(left.shape, 4*SHIFT, np.uint8)
    data_sets.write(folder, {"left.png": left, "right.png": right, "truth.png": truth})
    geometry = StereoGeometry(WIDTH, HEIGHT, 200.0, 0.1, WIDTH/2, HEIGHT/2, WIDTH/2)
    for name, camera in zip(FILES, ideal_cameras(geometry), strict=True):
        write_camera_info(folder/"calibration"/name, camera)
    (folder/"calib.txt").write_text(data_sets.CALIB.replace(f"width={data_sets.WIDTH}", f"width={WIDTH}")
                                    .replace(f"height={data_sets.HEIGHT}", f"height={HEIGHT}"))
    write_video(folder/"both.avi", [np.hstack(pair)]*2)
    for number in range(2):
        data_sets.write(folder/"left",  {f"{number}.png": left})
        data_sets.write(folder/"right", {f"{number}.png": right})
    scaled = np.full(left.shape, 256*SHIFT, np.uint16)
    for name in ("data/teddy", "data/cones"):
        data_sets.write(folder/name, {"left.png": left, "right.png": right, "disp_left_u16.png": scaled})
    data_sets.write(folder/"MiddEval3"/"trainingQ"/"Teddy",
                    {"im0.png": left, "im1.png": right, "disp0GT.pfm": np.full(left.shape, SHIFT, np.float32)})
    for name, image in (("image_2", left), ("image_3", right), ("disp_occ_0", scaled)):
        data_sets.write(folder/"kitti"/"training"/name, {"000000_10.png": image})


def write_boards(folder, kind, size, square_m):
    """Images of the board that an example of `calibrate` names, in left/ and right/."""
    if kind == "chessboard":
        picture, width_m = rig.chessboard(), 12*square_m
    else:
        columns, rows = map(int, size.split("x"))
        markers = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_100)
        board   = cv2.aruco.CharucoBoard((columns, rows), square_m, 0.75*square_m, markers)
        picture = board.generateImage((40*(columns + 1), 40*(rows + 1)), marginSize=20)
        width_m = (columns + 1)*square_m
    for number, (middle, degrees) in enumerate(rig.board_places(generator(171), 6)):
        rig.take(folder, f"{number:02}", [rig.flat(picture, width_m, middle, degrees/2)])


def runnable(words, ports):
    """The example as it can run here: devices are the firmware on this computer, or the model; streams end."""
    tcp, udp = ports
    devices  = {"tcp": f"tcp://127.0.0.1:{tcp}", "ser": f"tcp://127.0.0.1:{tcp}", "udp": f"udp://127.0.0.1:{udp}",
                "cos": "model:", "mod": "model:"}
    words    = list(words)
    for index, word in enumerate(words):
        if word == "--device":
            words[index + 1] = devices[words[index + 1][:3]]
    if "--cluster" in words:
        index = words.index("--cluster")
        del words[index:index + 2]
    if "--region" in words:
        # Inside these small images.
        index = words.index("--region")
        words[index + 1:index + 5] = [str(number) for number in (WIDTH//2, HEIGHT//4, WIDTH//4, HEIGHT//2)]
    if words[0] == "bench":
        words += ["--frames", "1"]
    if "camera:0" in words:
        words += ["--frames", "2"]
    if words[0] == "view" and not {"--montage", "--save"} & set(words):
        words = [word for word in words if word != "--serve"] + ["--save", "out.rrd"]
    return words


@pytest.mark.parametrize("words", EXAMPLES, ids=" ".join)
def test_examples_work(words, ports, tmp_path, monkeypatch, capfd):
    monkeypatch.delenv("LITESTEREO_DEVICE", raising=False)
    monkeypatch.chdir(tmp_path)
    cli._parser().parse_args(words)
    if words[0] in PARSED_ONLY:
        return
    if words[0] == "view":
        pytest.importorskip("rerun", reason="Rerun is in the extra `view`")
    pair = textured_pair(WIDTH, HEIGHT, generator(170), SHIFT)
    if words[0] == "calibrate":
        options = dict(zip(words, words[1:], strict=False))
        board   = options["--pattern"], words[words.index("--pattern") + 2], float(options["--square"])
        write_boards(tmp_path, *board)
        if "left/" not in words:
            # One folder with both sides in it.
            (tmp_path/words[1]).mkdir()
            for path in [*(tmp_path/"left").iterdir(), *(tmp_path/"right").iterdir()]:
                path.rename(tmp_path/words[1]/f"{path.parent.name}-{path.name}")
    else:
        write_pairs(tmp_path, pair)
    if any(word.startswith("out/disparity.") for word in words):
        settings = [word for name in ("--disparities", "--min-disparity") if name in words
                    for word in (name, words[words.index(name) + 1])]
        assert run("match", "left.png", "right.png", "-o", "out", "--device", "model:", *settings) == 0
    played = any(word.startswith("played/") for word in words)
    if played or "walk.mcap" in words and "--record" not in words:
        assert run("stream", "left/", "right/", "--device", "model:", "--calibration", "calibration/",
                   "--record", "walk.mcap") == 0
    if played:
        assert run("play", "walk.mcap", "-o", "played", "--format", "npy") == 0
    if words[0] == "calibration" and "--device" in words:
        # Each example finds a calibration on the device.
        assert run(*runnable(["calibration", "write", "calibration/", "--device", "tcp:"], ports)) == 0
    if words[0] == "calibration" and words[2] == "calibration.bin":
        assert run("calibration", "write", "calibration/", "-o", "calibration.bin") == 0
    monkeypatch.setattr(cv2, "VideoCapture", cv2.VideoCapture if "camera:0" not in words else FakeCapture)
    monkeypatch.setattr(FakeCapture, "scenes", {0: pair[0], 1: pair[1]})
    monkeypatch.setattr(evaluate, "load_motorcycle",
                        lambda: StereoPair(*pair, np.full(pair[0].shape, SHIFT, np.float32)))
    assert run(*runnable(words, ports)) == 0, capfd.readouterr()
