#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""`litestereo eval`: gateware and cv2.StereoBM alike on real pairs; data sets, processes, a cluster, mistakes."""

import csv
import json
import math
import os
import signal
import subprocess
import sys
import threading
import time

import cv2
import distributed
import numpy as np
import pytest
import rich.console

from litestereo.host_tools.cli import evaluate
from litestereo.host_tools.core.errors import MissingExtraError, WorkerError
from litestereo.host_tools.core.extras import import_extra
from litestereo.host_tools.core.speckle import SpeckleFilter
from litestereo.host_tools.evaluation import parallel, work
from litestereo.host_tools.evaluation.metrics import METRICS
from litestereo.host_tools.evaluation.report import table
from litestereo.host_tools.evaluation.work import Row
from support import data_sets
from support.command import error_line, run
from support.data import FOLDERS, stereo_folder, stereo_pair
from support.interruptible import interruptible
from support.native_device import native_device
from support.pairs import generator, textured_pair

COMMAND = [sys.executable, "-c", "import sys; from litestereo.host_tools.cli import main; sys.exit(main())"]


@pytest.fixture(autouse=True)
def no_device_in_the_environment(monkeypatch):
    monkeypatch.delenv("LITESTEREO_DEVICE", raising=False)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder of two pairs, one with a separate number of disparities, and of an empty folder."""
    path = tmp_path_factory.mktemp("sets")
    (path / "empty").mkdir()
    data_sets.litestereo(path / "own", 1)
    data_sets.middlebury_2014(path / "new", 2)
    return path


def results(capfd, *arguments):
    """What the command prints as JSON: results by pair, matcher and region, and all."""
    assert run("eval", *arguments, "--json") == 0
    out, err = capfd.readouterr()
    assert err == ""
    printed  = json.loads(out)
    return {(row["pair"], row["matcher"], row["region"]): row for row in printed["results"]}, printed


def metrics(row):
    return {name: row[name] for name in METRICS}


def by_counting(map_, truth_256):
    """Metrics of a map in sixteenths by a truth in 256ths, 0 if unknown: in whole numbers, by counting each error."""
    known  = truth_256 > 0
    valid  = known & (map_ >= 0)
    counts = np.bincount(np.abs(16*map_[valid].astype(int) - truth_256[valid].astype(int)))
    values = np.arange(len(counts))
    number = int(counts.sum())

    def at(place):
        return int(np.searchsorted(np.cumsum(counts), place, side="right"))/256

    found  = {"known_pixels": int(known.sum()), "valid_pixels": number, "density": 100*number/int(known.sum()),
              "avgerr": int((counts*values).sum())/number/256,
              "rms": math.sqrt(int((counts*values**2).sum())/number)/256}
    for name, limit in (("0_5", 128), ("1_0", 256), ("2_0", 512), ("4_0", 1024)):
        wrong = int(counts[limit + 1:].sum())
        found |= {f"bad_{name}": 100*wrong/int(known.sum()), f"bad_of_valid_{name}": 100*wrong/number,
                  f"bad_or_invalid_{name}": 100*(wrong + int(known.sum()) - number)/int(known.sum())}
    for share in (50, 90, 95, 99):
        below, part = divmod((number - 1)*share, 100)
        found[f"a{share}"] = at(below) + (at(min(below + 1, number - 1)) - at(below))*part/100
    return found


@pytest.mark.parametrize("name", [*FOLDERS, "motorcycle"])
def test_the_gateware_is_as_good_as_opencv_and_the_metrics_are_right(name, monkeypatch, capfd):
    if name == "motorcycle":
        pair = stereo_pair(name)
        monkeypatch.setattr(evaluate, "load_motorcycle", lambda: pair)
        rows, _ = results(capfd, "--motorcycle", "--device", "cosim:", "--opencv", "bm")
    else:
        rows, _ = results(capfd, stereo_folder(name), "--device", "cosim:", "--opencv", "bm")
    regions = {region for _, _, region in rows}
    assert {"all", "disc"} <= regions and ("nonocc" in regions) == (name != "motorcycle")
    for region in regions:
        ours = metrics(rows[name, "cosim:", region])
        assert ours == metrics(rows[name, "cv2:bm", region])
        assert 20 < ours["density"] < 100 and ours["a50"] < 1 < ours["a99"]
    if name != "motorcycle":
        truth = cv2.imread(str(stereo_folder(name) / "disp_left_u16.png"), cv2.IMREAD_UNCHANGED)
        pair  = stereo_pair(name)
        # A disparity of less than 0 is one too: sixteenths from -15 on.
        map_  = cv2.StereoBM_create(64, 9).compute(pair.left, pair.right)
        assert not ((map_ > -16) & (map_ < 0)).any()
        counted = by_counting(map_, truth)
        ours    = rows[name, "cosim:", "all"]
        assert {key: ours[key] for key in counted} == pytest.approx(counted, rel=1e-6, abs=1e-6)


def test_a_table_with_means(folder, capfd):
    assert run("eval", folder, "--device", "model:", "--opencv", "sgbm", "--disparities", 16) == 0
    out, err = capfd.readouterr()
    assert err == ""
    heads, shown = [], {}
    for line in out.splitlines():
        words = line.split()
        if len(words) == 2 and words[0].endswith(","):
            heads.append((words[0][:-1], words[1]))
        elif heads and len(words) == 8:
            shown[(*heads[-1], words[0])] = words[1:]
    assert heads == [("new", "all"), ("new", "nonocc"), ("new", "disc"), ("own", "all"), ("own", "disc"),
                     ("mean", "all"), ("mean", "nonocc"), ("mean", "disc")]
    assert list(shown) == [(*head, matcher) for head in heads for matcher in ("model:", "cv2:sgbm")]
    assert 60 < float(shown["own", "all", "model:"][0]) < 100 and float(shown["own", "all", "model:"][1]) == 0
    assert shown["own", "disc", "model:"] == ["-"]*7
    for column in range(7):
        values = [float(shown[pair, "all", "model:"][column]) for pair in ("own", "new")]
        assert float(shown["mean", "all", "model:"][column]) == pytest.approx(sum(values)/2, abs=0.011)


def test_the_table_of_a_narrow_terminal():
    """Of 80 characters: all numbers are whole, and all of the names is there."""
    url  = "cosim:?disparities=128&max_width=1024"
    rows = [Row("Motorcycle", url, "nonocc", dict.fromkeys(METRICS, 100.0))]
    text = rich.console.Console(width=80)
    with text.capture() as captured:
        text.print(table(rows))
    lines = captured.get().splitlines()
    assert max(map(len, lines)) <= 80
    assert "Motorcycle, nonocc" in captured.get() and captured.get().count("100.00") == 7
    assert url in "".join(line[:20].strip() for line in lines)


def test_settings_are_equal_and_suit_all_devices(folder, capfd):
    rows, printed = results(capfd, folder, "--device", "model:", "--device", "cosim:?disparities=16&max_width=120",
                            "--opencv", "bm")
    assert [settings["disparities"] for settings in printed["settings"]] == [16, 16]
    assert {matcher for _, matcher, _ in rows} == {"model:", "cosim:?disparities=16&max_width=120", "cv2:bm"}
    for region in ("all", "nonocc"):
        (one,) = {json.dumps(metrics(row)) for key, row in rows.items() if (key[0], key[2]) == ("new", region)}
        assert json.loads(one)["bad_1_0"] == 0
    _, printed = results(capfd, folder, "--device", "model:")
    assert {settings["pair"]: settings["disparities"] for settings in printed["settings"]} == {"new": 32, "own": 64}
    _, printed = results(capfd, folder, "--opencv", "bm", "--disparities", 48, "--block-size", 11, "--min-disparity", 2)
    assert {settings["disparities"] for settings in printed["settings"]} == {48}


def test_opencv_s_settings_are_ours(folder, capfd):
    """All that both have, off its default: the maps are equal, and with them the metrics."""
    rows, _ = results(capfd, folder / "own", "--device", "model:", "--opencv", "bm", "--disparities", 16,
                      "--block-size", 7, "--min-disparity", 3, "--prefilter-cap", 20, "--texture-threshold", 300,
                      "--uniqueness-ratio", 5, "--disp12-max-diff", 1, "--speckle-window", 20, "--speckle-range", 8)
    assert metrics(rows["own", "model:", "all"]) == metrics(rows["own", "cv2:bm", "all"])
    assert rows["own", "model:", "all"]["density"] > 50


def test_processes_and_csv(folder, tmp_path, capfd):
    alone, printed = results(capfd, folder, "--device", "model:", "--opencv", "bm")
    again, _       = results(capfd, folder, "--device", "model:", "--opencv", "bm", "--jobs", 2, "--csv",
                             tmp_path / "new" / "all.csv")
    assert again == alone and list(again) == list(alone)
    with (tmp_path / "new" / "all.csv").open(newline="") as file:
        lines = list(csv.DictReader(file))
    assert len(lines) == len(printed["results"]) == 10
    for line, row in zip(lines, printed["results"], strict=True):
        assert {name: float(text) if text else None for name, text in list(line.items())[3:]} == metrics(row)
        assert (line["pair"], line["matcher"], line["region"]) == (row["pair"], row["matcher"], row["region"])


def test_a_cluster(folder, capfd):
    alone, _ = results(capfd, folder, "--device", "model:", "--opencv", "bm")
    with distributed.LocalCluster(n_workers=1, threads_per_worker=2, dashboard_address=None) as there:
        again, _ = results(capfd, folder, "--device", "model:", "--opencv", "bm", "--cluster", there.scheduler_address)
        assert again == alone
        assert run("eval", folder / "own", "--opencv", "bm", "--disparities", 128, "--cluster",
                   there.scheduler_address) == 1
        assert "too small" in error_line(capfd)


def test_kitti_has_d1(tmp_path, capfd):
    data_sets.kitti(tmp_path)
    capfd.readouterr()
    rows, _ = results(capfd, tmp_path, "--opencv", "sgbm", "--disparities", 16)
    assert {pair for pair, _, _ in rows} == {"000000_10", "000001_10"}
    row = rows["000000_10", "cv2:sgbm", "nonocc"]
    assert row["d1"] == 0 and row["d1_or_invalid"] == pytest.approx(100 - row["density"])


def test_a_device_with_one_host_at_a_time_gets_all_pairs_one_after_the_other():
    tasks = work.tasks_of(["udp://1.2.3.4", "model:"], [("a", None), ("b", None)], None)
    assert [(task.matcher, len(task.jobs)) for task in tasks] == [("udp://1.2.3.4", 2), ("model:", 1), ("model:", 1)]


def test_a_device_with_less_than_the_defaults(folder, capfd):
    with native_device("--max-width", "200", "--max-disparities", "16", "--max-block-size", "7") as port:
        rows, printed = results(capfd, folder, "--device", f"tcp://127.0.0.1:{port}", "--opencv", "bm", "--jobs", 2)
    assert {(settings["disparities"], settings["block_size"]) for settings in printed["settings"]} == {(16, 7)}
    for pair in ("own", "new"):
        assert metrics(rows[pair, f"tcp://127.0.0.1:{port}", "all"]) == metrics(rows[pair, "cv2:bm", "all"])


def test_an_interrupt_ends_all_processes_with_one_line(tmp_path):
    """As a terminal sends it: to the command and to its processes, while they start and while they match."""
    for number in range(2):
        left, right = textured_pair(1200, 800, generator(71))
        data_sets.write(tmp_path / str(number), {"left.png": left, "right.png": right, "disp_left_u16.png": left})
    for after_s in (1.0, 1.5, 2.0, 5.0):
        command = [*COMMAND, "eval", str(tmp_path), "--device", "model:", "--disparities", "128", "--jobs", "2"]
        with interruptible(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, process_group=0) as running:
            time.sleep(after_s)
            os.killpg(running.pid, signal.SIGINT)
            out, err = running.communicate(timeout=20)
        assert (running.returncode, out, err) == (130, "", "litestereo: interrupted\n"), f"after {after_s} s"


class Deadly:
    """Ends the process that it comes to."""

    def __reduce__(self):
        return os._exit, (1,)


def test_a_process_that_is_killed():
    task = work.Task(Deadly(), (("a", None),), SpeckleFilter())
    with pytest.raises(WorkerError, match="Take fewer --jobs"):
        work.evaluate([task], print, processes=2)


def test_the_environment_names_the_device(folder, monkeypatch, capfd):
    monkeypatch.setenv("LITESTEREO_DEVICE", "model:")
    assert {matcher for _, matcher, _ in results(capfd, folder)[0]} == {"model:"}
    assert {matcher for _, matcher, _ in results(capfd, folder, "--opencv", "bm")[0]} == {"cv2:bm"}


@pytest.mark.parametrize(("arguments", "status", "text"), [
    (["--opencv", "bm"], 2, "no pairs to rate"),
    (["own"], 2, "give --device or --opencv"),
    (["own", "--opencv", "orb"], 2, "invalid choice"),
    (["own", "--device", "foo:"], 2, "tcp://127.0.0.1:2000"),
    (["own", "--opencv", "bm", "--jobs", "0"], 2, "at least 1"),
    (["none", "--opencv", "bm"], 1, "no such folder"),
    (["empty", "--opencv", "bm"], 1, "empty: has no stereo pair"),
    (["own", "--opencv", "bm", "--prefilter", "none"], 1, "without prefilter"),
    (["own", "--opencv", "sgbm", "--median"], 1, "a median"),
    (["own", "--opencv", "bm", "--disparities", "128"], 1, "too small"),
    (["own", "--opencv", "bm", "--disparities", "128", "--jobs", "2"], 1, "too small"),
    (["own", "--opencv", "bm", "--csv", "own"], 1, "is a folder"),
    (["own", "--opencv", "bm", "--disparities", "16", "--csv", "own/left.png/a.csv"], 1, "cannot be written"),
    (["own", "--opencv", "bm", "--cluster", "tls://127.0.0.1:1"], 1, "no Dask scheduler"),
])
def test_mistakes_are_one_line(folder, arguments, status, text, monkeypatch, capfd):
    monkeypatch.chdir(folder)
    assert run("eval", *arguments) == status
    assert text in error_line(capfd)


def test_a_cluster_of_an_unknown_kind(folder, capfd):
    """What was begun for it has ended: Python would end it at some time, and hang if another one starts just then."""
    before = set(threading.enumerate())
    assert run("eval", folder, "--opencv", "bm", "--cluster", "nonsense://") == 1
    assert "no Dask scheduler answers there" in error_line(capfd)
    assert not [thread for thread in threading.enumerate() if thread.name == "IO loop" and thread not in before]


def test_a_cluster_that_is_not_there(folder, monkeypatch, capfd):
    monkeypatch.setattr(parallel, "_CLUSTER_TIMEOUT_S", 1)
    assert run("eval", folder, "--opencv", "bm", "--cluster", "tcp://127.0.0.1:1") == 1
    assert "no Dask scheduler answers there" in error_line(capfd)


def test_a_package_that_is_not_installed():
    with pytest.raises(MissingExtraError, match=r"--cluster needs nopackage, .*-m pip install .*\[cluster\]'$"):
        import_extra("nopackage.sub", "cluster", "--cluster needs")


def test_help_has_examples(capfd):
    assert run("eval", "--help") == 0
    out = capfd.readouterr().out
    assert "litestereo eval data/teddy" in out and "bad_or_invalid_2_0" in out


def test_what_was_guessed_is_said_by_all_processes(tmp_path, capfd):
    """The size of 2003 with a scale of 4, one that is guessed, a mask of 0 and 1, and truths out of reach."""
    for name, size, scale in (("known", (450, 60), 4), ("guessed", (200, 60), 3)):
        left, right = textured_pair(*size, generator(72), 20)
        data_sets.write(tmp_path / "set" / name, {"im2.png": left, "im6.png": right, "disp2.png":
                                                  np.full(left.shape, 20*scale, np.uint8)})
    data_sets.write(tmp_path / "set" / "known", {"nonocc.png": np.ones((60, 450), np.uint8)})
    errs = []
    for jobs in (1, 2):
        assert run("eval", tmp_path/"set", "--opencv", "bm", "--disparities", 16, "--jobs", jobs) == 0
        errs.append(capfd.readouterr().err)
    assert errs[0] == errs[1]
    lines = errs[0].splitlines()
    assert len(lines) == 5 and all(line.startswith("litestereo: note: ") for line in lines)
    for text in ("known/disp2.png: read as 8-bit image, 4 levels per pixel", "guessed/disp2.png: 3 levels per pixel is",
                 "mask of 0 and 1", "known: 100.00 % of the true", "guessed: 100.00 % of the true"):
        assert sum(text in line for line in lines) == 1
