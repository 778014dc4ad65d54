#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Results never replace what a command reads, nor files of another kind; and they are written all or nothing."""

import os
import stat
import subprocess
import sys

import cv2
import numpy as np
import pytest

from litestereo.host_tools.core import outputs as module
from litestereo.host_tools.core.errors import ImageError
from litestereo.host_tools.core.images import encode_png, plan_disparity, write_disparity
from litestereo.host_tools.core.outputs import (
    CLOUD_PLY,
    COLOURS_PNG,
    DEPTH_NPY,
    DEPTH_PNG,
    DISPARITY_NPY,
    DISPARITY_PFM,
    DISPARITY_PNG,
    METRICS_CSV,
    MONTAGE_PNG,
    RECORDING,
    RECTIFIED_PNG,
    Outputs,
    finish,
    partial_of,
    write_file,
)
from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.host_tools.evaluation.report import write_csv
from litestereo.host_tools.export import files

POINTS = np.zeros((4, 5, 3), np.float32)
DEPTH  = np.ones((4, 5), np.float32)

PNG_KINDS = (COLOURS_PNG, DEPTH_PNG, DISPARITY_PNG, MONTAGE_PNG, RECTIFIED_PNG)


def samples(folder):
    """A file of each kind, written by what writes it."""
    found = {kind: encode_png(np.zeros((4, 5), np.uint8), kind) for kind in PNG_KINDS}
    write_disparity(folder, np.zeros((4, 5), np.int16), MatcherSettings())
    write_csv(folder/"metrics.csv", [])
    found |= {DISPARITY_NPY: (folder/"disparity.npy").read_bytes(),
              DISPARITY_PFM: (folder/"disparity.pfm").read_bytes(),
              METRICS_CSV: (folder/"metrics.csv").read_bytes(), DEPTH_NPY: files.depth_npy(DEPTH),
              CLOUD_PLY: files.ply(POINTS), RECORDING: b"RRF2"}
    assert found[DISPARITY_PNG] != (folder/"disparity.png").read_bytes()
    assert DISPARITY_PNG.is_of((folder/"disparity.png").read_bytes())
    assert COLOURS_PNG.is_of((folder/"disparity_color.png").read_bytes())
    return found


def test_every_kind_is_told_from_every_other(tmp_path):
    found  = samples(tmp_path/"samples")
    photo  = cv2.imencode(".png", np.zeros((4, 5, 3), np.uint8))[1].tobytes()
    others = {"photo": photo, "jpeg": cv2.imencode(".jpg", np.zeros((4, 5), np.uint8))[1].tobytes(), "text": b"words",
              "byte": b"\0", "npy of others": found[DEPTH_NPY].replace(b"<f4", b"<f8")}
    for kind in found:
        for other, data in [*found.items(), *others.items()]:
            (tmp_path/"file").write_bytes(data)
            assert kind.is_of(data) == (other is kind), (kind.name, other)
            if other is kind:
                Outputs().add(tmp_path/"file", kind)
                continue
            with pytest.raises(ImageError, match="is no .* that this command has written"):
                Outputs().add(tmp_path/"file", kind)
            Outputs(force=True).add(tmp_path/"file", kind)


def test_a_marked_png_is_the_same_image(tmp_path):
    image = np.arange(60, dtype=np.uint16).reshape(6, 10)*1000
    write_file(tmp_path/"a.png", encode_png(image, DEPTH_PNG))
    assert np.array_equal(cv2.imread(str(tmp_path/"a.png"), cv2.IMREAD_UNCHANGED), image)


def test_an_input_by_any_of_its_names(tmp_path, monkeypatch):
    (tmp_path/"in").mkdir()
    (tmp_path/"in"/"map.npy").write_bytes(files.depth_npy(DEPTH))
    os.symlink(tmp_path/"in", tmp_path/"folder")
    os.symlink("in/map.npy", tmp_path/"link.npy")
    os.link(tmp_path/"in"/"map.npy", tmp_path/"hard.npy")
    monkeypatch.chdir(tmp_path/"in")
    for reading in (tmp_path/"in"/"map.npy", tmp_path/"link.npy", tmp_path/"hard.npy"):
        for writing in ("map.npy", "../in/map.npy", "../folder/map.npy", "../link.npy", "../hard.npy", "./map.npy"):
            with pytest.raises(ImageError, match="is an input of this command"):
                Outputs([reading]).add(tmp_path/"in"/writing, DEPTH_NPY)
            Outputs([reading], force=True).add(tmp_path/"in"/writing, DEPTH_NPY)
    # Not an input: an earlier result.
    Outputs([tmp_path/"none.npy"]).add(tmp_path/"link.npy", DEPTH_NPY)


@pytest.mark.parametrize("folds", [False, True])
def test_names_that_differ_in_case(folds, tmp_path, monkeypatch):
    monkeypatch.setattr(module, "folds_case", lambda folder: folds)
    outputs = Outputs()
    outputs.add(tmp_path/"new"/"Map.png", DEPTH_PNG)
    outputs.add(tmp_path/"other"/"map.png", DEPTH_PNG)
    for name in ("map.PNG", "Ma\u0301p.png", "M\u00e1p.png"):
        if folds and name != "Ma\u0301p.png":
            with pytest.raises(ImageError, match="two results"):
                outputs.add(tmp_path/"new"/name, DEPTH_PNG)
        else:
            outputs.add(tmp_path/"new"/name, DEPTH_PNG)
    monkeypatch.undo()
    (tmp_path/"Letters").mkdir()
    assert module.folds_case(tmp_path/"Letters") == (tmp_path/"lETTERS").exists()


@pytest.mark.parametrize("force", [False, True])
def test_two_results_never_have_one_name(force, tmp_path):
    os.symlink(tmp_path, tmp_path/"link")
    for second in (tmp_path/"a.png", tmp_path/"link"/"a.png", tmp_path/"x"/".."/"a.png"):
        outputs = Outputs(force=force)
        outputs.add(tmp_path/"a.png", DEPTH_PNG)
        with pytest.raises(ImageError, match="two results"):
            outputs.add(second, MONTAGE_PNG)


def test_what_can_be_no_file(tmp_path):
    (tmp_path/"file").write_text("text")
    for place, text in ((tmp_path, "it is a folder"), (tmp_path/"file"/"a.png", "is no folder"),
                        (tmp_path/"file"/"b"/"a.png", "is no folder")):
        for force in (False, True):
            with pytest.raises(ImageError, match=text):
                Outputs(force=force).add(place, DEPTH_PNG)
    (tmp_path/"empty").touch()
    Outputs().add(tmp_path/"empty", DEPTH_PNG)
    plan_disparity(tmp_path/"new", Outputs())


def test_a_device_stays_a_device(tmp_path):
    os.mkfifo(tmp_path/"pipe")
    for place in (os.devnull, tmp_path/"pipe"):
        Outputs().add(module.Path(place), METRICS_CSV)
    write_file(module.Path(os.devnull), b"text")
    assert stat.S_ISCHR(os.stat(os.devnull).st_mode)
    assert partial_of(tmp_path/"pipe") == tmp_path/"pipe"
    finish(tmp_path/"pipe", tmp_path/"pipe")
    assert stat.S_ISFIFO(os.stat(tmp_path/"pipe").st_mode)


def test_a_file_is_written_whole_or_not_at_all(tmp_path, monkeypatch):
    (tmp_path/"old").write_text("old")
    os.chmod(tmp_path/"old", 0o640)
    os.symlink("old", tmp_path/"link")
    os.link(tmp_path/"old", tmp_path/"copy")

    def full(*arguments):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(ImageError, match="link: cannot be written: No space left on device"):
        write_file(tmp_path/"link", b"new")
    monkeypatch.undo()
    assert (tmp_path/"old").read_text() == "old"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["copy", "link", "old"]
    write_file(tmp_path/"link", b"new")
    # The link and the rights of the file are as before, the file by its other name too.
    assert (tmp_path/"link").is_symlink() and (tmp_path/"old").read_text() == "new"
    assert stat.S_IMODE((tmp_path/"old").stat().st_mode) == 0o640 and (tmp_path/"copy").read_text() == "old"
    write_file(tmp_path/"a"/"b", b"new")
    umask = os.umask(0)
    os.umask(umask)
    assert stat.S_IMODE((tmp_path/"a"/"b").stat().st_mode) == 0o666 & ~umask
    monkeypatch.setattr(os, "access", lambda *arguments: False)
    with pytest.raises(ImageError, match="Permission denied"):
        write_file(tmp_path/"old", b"newer")
    assert (tmp_path/"old").read_text() == "new"


@pytest.mark.skipif(not os.path.exists("/dev/stdout"), reason="needs /dev/stdout")
@pytest.mark.parametrize("reader", [">{}", "| cat >{}"])
def test_the_standard_output_as_a_file(reader, tmp_path):
    """Of a pipe and of a file: what is printed afterwards follows."""
    script = "from pathlib import Path; from litestereo.host_tools.core.outputs import *; out = Path('/dev/stdout'); " \
             "Outputs().add(out, METRICS_CSV); write_file(out, b'one\\n'); print('two')"
    path   = tmp_path/"file"
    subprocess.run(["sh", "-c", f'"$@" {reader.format(path)}', "sh", sys.executable, "-c", script], check=True)
    assert path.read_text().splitlines()[-1] == "two" and (reader.startswith(">") or "one" in path.read_text())
