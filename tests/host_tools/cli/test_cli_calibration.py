#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""`litestereo calibration`: folders, records and devices, shown and made of each other."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest

from litestereo.host_tools.cameras.camera_info import ideal_cameras
from litestereo.host_tools.cameras.record import CalibrationRecord
from litestereo.host_tools.cameras.rectify import read_calibration, write_calibration
from litestereo.host_tools.core.geometry import StereoGeometry
from litestereo.host_tools.core.grid import Grid
from support.command import error_line, run
from support.native_device import native_device
from support.pairs import generator
from support.rigs import lens_cameras

WIDTH, HEIGHT = 160, 120


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Calibrations of a pair, of one without a grid, and of one that no device has room for; and a file."""
    cameras = lens_cameras(generator(365), 44, 1, WIDTH, HEIGHT)
    write_calibration(tmp_path/"cal", cameras)
    bent    = dataclasses.replace(cameras[0], distortion=np.array([1.5, 0, 0, 0, 0]))
    write_calibration(tmp_path/"bent", (bent, cameras[1]))
    write_calibration(tmp_path/"large", ideal_cameras(StereoGeometry(1280, 480, 900.0, 0.1, 640.0, 240.0, 640.0)))
    (tmp_path/"text.bin").write_text("no record")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_folder_becomes_a_record_and_a_folder_again(folder, capfd):
    """The files are the same bytes, and all three show the same, which is the host's own grid."""
    assert run("calibration", "write", "cal", "-o", "rig.bin") == 0
    assert "wrote         rig.bin" in capfd.readouterr().out
    assert run("calibration", "read", "rig.bin", "-o", "again", "--json") == 0
    assert json.loads(capfd.readouterr().out)["files"] == ["again/left.yaml", "again/right.yaml"]
    for name in ("left.yaml", "right.yaml"):
        assert (folder/"again"/name).read_bytes() == (folder/"cal"/name).read_bytes()
    told = []
    for path in ("cal", "rig.bin", "again"):
        assert run("calibration", "show", path, "--json") == 0
        told.append(json.loads(capfd.readouterr().out))
    assert told[0] == told[1] == told[2]
    rectifier = read_calibration(folder/"cal")
    grids     = rectifier.pair.grids
    assert told[0]["grid"] == {"crc": f"{grids.crc:08x}", "max_px": grids.error.max_px, "rms_px": grids.error.rms_px,
                               "rows": grids.rows, "delay_rows": grids.delay_rows, "boards": told[0]["grid"]["boards"]}
    assert "ulx3s" in told[0]["grid"]["boards"]
    assert told[0]["bytes"] == len((folder/"rig.bin").read_bytes()) and told[0]["cameras"] == ["left", "right"]
    assert told[0]["baseline_m"] == rectifier.geometry.baseline_m and told[0]["files"] == []
    assert run("calibration", "show", "cal") == 0
    out = capfd.readouterr().out
    for text in (f"grid          {grids.crc:08x}, error {grids.error.max_px:.3f} pixels at most",
                 f"rows          {grids.rows} at once", "none has a rectifier yet", "cameras       left, right",
                 f"record        {told[0]['bytes']} bytes, a device has room for 20224", "baseline"):
        assert text in out


def test_grids_of_others(folder, capfd):
    """Grids that this host does not find itself are shown without an error."""
    record = CalibrationRecord.of(read_calibration(folder/"cal"))
    other  = Grid(WIDTH, HEIGHT, record.grids[0].nodes + np.int16(3))
    (folder/"other.bin").write_bytes(dataclasses.replace(record, grids=(other, record.grids[1])).encode())
    assert run("calibration", "show", "other.bin", "--json") == 0
    told = json.loads(capfd.readouterr().out)["grid"]
    assert told["max_px"] is None and told["rms_px"] is None
    assert run("calibration", "show", "other.bin") == 0
    assert f"grid          {told['crc']}\n" in capfd.readouterr().out


@pytest.mark.parametrize(("arguments", "status", "text"), [
    (["show", "none"], 1, "none: there is no such file"),
    (["show", "text.bin"], 1, "text.bin: is no calibration record"),
    (["show", "bent"], 1, "bent: no device can rectify for these cameras"),
    (["show", "."], 1, "left.yaml: there is no such file"),
    (["show", "cal", "-o", "x"], 2, "show writes nothing"),
    (["write", "cal"], 2, "calibration write needs -o"),
    (["read", "cal"], 2, "calibration read needs -o"),
    (["write", "large", "-o", "x"], 1, "has 20940 bytes, a device has room for 20224"),
    (["write", "cal", "-o", "text.bin"], 1, "is there already, and is no calibration record"),
    (["write", "cal", "-o", "cal"], 1, "it is a folder"),
    (["write", "cal", "-o", "cal/left.yaml"], 1, "is an input of this command"),
    (["read", "cal", "-o", "text.bin"], 1, "is a file, the cameras need a folder"),
    (["read", "cal", "-o", "cal"], 1, "is an input of this command"),
    (["melt", "cal"], 2, "invalid choice"),
    (["show"], 2, "required"),
    (["show", "cal", "--device", "model:"], 2, "either FILE or --device is required"),
    (["show", "--device", "model:", "-o", "x"], 2, "show writes nothing"),
    (["show", "--device", "model:"], 1, "reference model keeps no calibration"),
    (["write", "--device", "model:"], 2, "FILE is required"),
    (["write", "cal", "--device", "model:", "-o", "x"], 2, "needs -o for a file, or --device"),
    (["write", "cal", "--device", "model:"], 1, "reference model keeps no calibration"),
    (["write", "large", "--device", "model:"], 1, "has 20940 bytes, a device has room for 20224"),
    (["read", "--device", "model:"], 2, "calibration read needs -o"),
    (["erase"], 2, "erase needs --device, and nothing else"),
    (["erase", "cal", "--device", "model:"], 2, "erase needs --device, and nothing else"),
    (["erase", "--device", "model:"], 1, "reference model keeps no calibration"),
    (["erase", "--device", "camel:"], 2, "camel"),
])
def test_mistakes(arguments, status, text, folder, capfd):
    """One line, and no file."""
    before = sorted(path.name for path in folder.rglob("*"))
    assert run("calibration", *arguments) == status
    assert text in error_line(capfd)
    assert sorted(path.name for path in folder.rglob("*")) == before


def test_a_large_calibration_is_shown(folder, capfd):
    """Its record has no room on a device; that is said, and `write` refuses it."""
    assert run("calibration", "show", "large") == 0
    assert "record        20940 bytes, a device has room for 20224" in capfd.readouterr().out


def test_an_older_record_is_replaced(folder, capfd):
    """And another file only with --force."""
    for _ in range(2):
        assert run("calibration", "write", "cal", "-o", "rig.bin") == 0
    assert run("calibration", "write", "cal", "-o", "text.bin", "--force") == 0
    assert (folder/"text.bin").read_bytes() == (folder/"rig.bin").read_bytes()


def test_a_damaged_record(folder, capfd):
    assert run("calibration", "write", "cal", "-o", "rig.bin") == 0
    capfd.readouterr()
    data      = bytearray((folder/"rig.bin").read_bytes())
    data[900] ^= 1
    (folder/"rig.bin").write_bytes(data)
    assert run("calibration", "show", "rig.bin") == 1
    assert "rig.bin: the CRC of the calibration record is wrong: it is damaged" in error_line(capfd)


def test_a_device_keeps_it(folder, capfd):
    """What is written to a device is shown and read there, until it is erased."""
    assert run("calibration", "show", "cal", "--json") == 0
    shown = json.loads(capfd.readouterr().out)
    with native_device("--flash", "--rectification", "64") as port:
        device = ["--device", f"tcp://127.0.0.1:{port}"]
        assert run("calibration", "show", *device) == 1
        assert error_line(capfd).endswith("the device has no calibration\n")
        assert run("calibration", "write", "cal", *device) == 0
        assert f"wrote         {device[1]}\n" in capfd.readouterr().out
        for _ in range(2):
            assert run("calibration", "show", *device, "--json") == 0
            assert json.loads(capfd.readouterr().out) == {**shown, "device": device[1]}
        assert run("calibration", "read", *device, "-o", "again") == 0
        for name in ("left.yaml", "right.yaml"):
            assert (folder/"again"/name).read_bytes() == (folder/"cal"/name).read_bytes()
        capfd.readouterr()
        assert run("calibration", "erase", *device) == 0
        assert capfd.readouterr().out == f"{device[1]}: the device keeps no calibration\n"
        assert run("calibration", "erase", *device, "--json") == 0
        assert json.loads(capfd.readouterr().out) == {"device": device[1]}
        assert run("calibration", "show", *device) == 1
