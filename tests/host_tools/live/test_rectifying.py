#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Rectification on the device or on the host: the same bits, and the commands say where it was."""

from __future__ import annotations

import contextlib
import dataclasses
import json

import cv2
import numpy as np
import pytest

from litestereo.host_tools.cameras.camera_info import ideal_cameras, write_camera_info
from litestereo.host_tools.cameras.record import CalibrationRecord
from litestereo.host_tools.cameras.rectify import FILES, read_calibration
from litestereo.host_tools.core.errors import ImageError, UnsupportedError
from litestereo.host_tools.core.features import Feature
from litestereo.host_tools.core.geometry import StereoGeometry
from litestereo.host_tools.core.grid import Grid, grid_crc
from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.host_tools.devices import connect as module
from litestereo.host_tools.devices.connect import connect
from litestereo.host_tools.live.rectifying import choose_rectifying
from support.command import error_line, run
from support.devices import device_without
from support.expected import expected_map
from support.native_device import native_device
from support.pairs import generator, textured_pair
from support.rigs import lens_cameras

WIDTH, HEIGHT = 160, 60
SETTINGS      = MatcherSettings(16, 9)
SMALL         = ["--disparities", "16", "--block-size", "9"]

#: Where a device rectifies, by its URL; `lacking` is the model without rectification, `calibrated` a device with the
#: calibration, `empty` one without any, and `foreign` one with another.
WHERE = {"model:": "device", "lacking": "host", "native": "host", "calibrated": "device", "empty": "host",
         "foreign": "host"}

#: Why it is the host.
REASONS = {"model:": None, "lacking": "the device does not rectify", "native": "the device does not rectify",
           "calibrated": None,
           "empty": "the device has no calibration, `litestereo calibration write` gives it this one",
           "foreign": "the device has the calibration of another grid, {crc:08x}, `litestereo calibration write` gives "
                      "it this one"}


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    """A pair, folders of two pairs, and calibrations with a grid and without."""
    folder = tmp_path_factory.mktemp("rectifying")
    rng    = generator(360)
    pairs  = [textured_pair(WIDTH, HEIGHT, rng, shift) for shift in (4, 6)]
    for number, pair in enumerate(pairs):
        for side, image in zip(("left", "right"), pair, strict=True):
            (folder/"pairs"/side).mkdir(parents=True, exist_ok=True)
            cv2.imwrite(str(folder/"pairs"/side/f"{number}.png"), image)
    cameras = lens_cameras(rng, 60, 1, WIDTH, HEIGHT)
    while read(folder/"grid", cameras).pair.grids is None:
        cameras = lens_cameras(rng, 60, 1, WIDTH, HEIGHT)
    strong = dataclasses.replace(cameras[0], distortion=np.array([1.5, 0, 0, 0, 0]))
    assert read(folder/"pixels", (strong, cameras[1])).pair.grids is None
    return folder


def read(folder, cameras):
    for name, camera in zip(FILES, cameras, strict=True):
        write_camera_info(folder/name, camera)
    return read_calibration(folder)


def foreign(data):
    """Return the record of another calibration of the size."""
    record = CalibrationRecord.of(read_calibration(data/"grid"))
    other  = Grid(WIDTH, HEIGHT, record.grids[0].nodes + np.int16(5))
    return dataclasses.replace(record, grids=(other, record.grids[1]))


@contextlib.contextmanager
def device_url(kind, data, monkeypatch):
    """Give the URL of a device of `WHERE`."""
    records = {"calibrated": CalibrationRecord.of(read_calibration(data/"grid")), "foreign": foreign(data)}
    with contextlib.ExitStack() as stack:
        if kind == "lacking":
            monkeypatch.setattr(module, "open_model", lambda url: device_without(Feature(0)))
        if kind in ("model:", "lacking"):
            yield "model:"
            return
        options = () if kind == "native" else ("--flash", "--rectification", "64")
        url     = f"tcp://127.0.0.1:{stack.enter_context(native_device(*options))}"
        if kind in records:
            with connect(url) as device:
                device.write_calibration(records[kind].encode())
        yield url


def photos(data, number=0):
    return [cv2.imread(str(data/"pairs"/side/f"{number}.png"), cv2.IMREAD_GRAYSCALE) for side in ("left", "right")]


def expected(data, calibration, number=0):
    """Return the map of a pair that OpenCV has rectified and matched."""
    rectifier = read_calibration(data/calibration)
    pair      = photos(data, number)
    maps      = [(one.whole, one.fractions) for one in rectifier.pair.maps]
    moved     = [cv2.remap(image, *one, cv2.INTER_LINEAR) for image, one in zip(pair, maps, strict=True)]
    return rectifier.clean(expected_map(*moved, SETTINGS), SETTINGS)


@pytest.mark.parametrize("calibration", ["grid", "pixels"])
@pytest.mark.parametrize("kind", WHERE)
def test_match(kind, calibration, data, tmp_path, monkeypatch, capfd):
    """The map has the same bits on every device; a note and JSON say where the pair was rectified."""
    with device_url(kind, data, monkeypatch) as url:
        assert run("match", data/"pairs"/"left"/"0.png", data/"pairs"/"right"/"0.png", "-o", tmp_path, "--device", url,
                   "--calibration", data/calibration, *SMALL, "--json") == 0
    out, err = capfd.readouterr()
    told     = json.loads(out)["rectification"]
    assert np.array_equal(np.load(tmp_path/"disparity.npy"), expected(data, calibration))
    pair     = read_calibration(data/calibration).pair
    if calibration == "pixels":
        assert told == {"where": "host", "crc": None, "max_px": None, "rms_px": None, "reason": pair.no_grids}
        assert err == f"litestereo: note: rectified on this host with a position for each pixel: {pair.no_grids}\n"
        return
    reason = REASONS[kind] and REASONS[kind].format(crc=grid_crc(foreign(data).grids))
    assert told == {"where": WHERE[kind], "crc": f"{pair.grids.crc:08x}", "max_px": pair.grids.error.max_px,
                    "rms_px": pair.grids.error.rms_px, "reason": reason}
    place  = "the device" if reason is None else "this host"
    assert err == (f"litestereo: note: rectified on {place} with grid {pair.grids.crc:08x}, off by at most "
                   f"{pair.grids.error.max_px:.2f} pixels{'' if reason is None else f': {reason}'}\n")


@pytest.mark.parametrize("kind", WHERE)
def test_stream(kind, data, tmp_path, monkeypatch, capfd):
    with device_url(kind, data, monkeypatch) as url:
        assert run("stream", data/"pairs", "--device", url, "--calibration", data/"grid", *SMALL, "-o", tmp_path,
                   "--format", "npy", "--json") == 0
    out, err = capfd.readouterr()
    assert json.loads(out.splitlines()[-1])["summary"]["rectification"]["where"] == WHERE[kind]
    assert err == ""
    for number in range(2):
        assert np.array_equal(np.load(tmp_path/f"disparity_{number}.npy"), expected(data, "grid", number))


def test_the_text_of_a_stream(data, capfd):
    assert run("stream", data/"pairs", "--device", "model:", "--calibration", data/"grid", *SMALL) == 0
    out   = capfd.readouterr().out
    grids = read_calibration(data/"grid").pair.grids
    assert out.endswith(f"\nrectified on the device with grid {grids.crc:08x}, off by at most "
                        f"{grids.error.max_px:.2f} pixels\n")


def test_view_shows_rectified_images(data, tmp_path, monkeypatch, capfd):
    """The montage of a device that rectifies is that of one that does not."""
    pictures = []
    for kind in ("model:", "lacking"):
        with device_url(kind, data, monkeypatch) as url:
            path = tmp_path/f"{len(pictures)}.png"
            assert run("view", data/"pairs", "--device", url, "--calibration", data/"grid", *SMALL, "--montage", path,
                       "--json") == 0
        assert json.loads(capfd.readouterr().out)["rectification"]["where"] == WHERE[kind]
        pictures.append(cv2.imread(str(path)))
    left = read_calibration(data/"grid").rectify(*photos(data, 1))[0]
    assert np.array_equal(pictures[0][:HEIGHT, :WIDTH], pictures[1][:HEIGHT, :WIDTH])
    assert (pictures[0] == left[HEIGHT//2, WIDTH//2]).any()


def test_without_a_calibration(data, tmp_path, capfd):
    arguments = [data/"pairs"/side/"0.png" for side in ("left", "right")]
    assert run("match", *arguments, "-o", tmp_path, "--device", "model:", *SMALL, "--json") == 0
    out, err = capfd.readouterr()
    assert json.loads(out)["rectification"] is None and err == ""


def test_a_truth_is_that_of_the_rectified_pair(data, tmp_path, capfd):
    """A truth without a scale is compared with the rectified images, also if the device rectifies.

    The left camera is 8 columns aside: the pair has a disparity of 4 before it is rectified, and of 12 afterwards. So a
    truth of 12 has the scale 1, but before that it would have the scale 3.
    """
    left, right = ideal_cameras(StereoGeometry(WIDTH, HEIGHT, 140.0, 0.06, 79.5, 29.5, 79.5))
    matrix      = left.camera_matrix.copy()
    matrix[0, 2] -= 8
    read(tmp_path/"aside", (dataclasses.replace(left, camera_matrix=matrix), right))
    cv2.imwrite(str(tmp_path/"truth.png"), np.full((HEIGHT, WIDTH), 12, np.uint8))
    arguments = ["match", *(data/"pairs"/side/"0.png" for side in ("left", "right")), "--ground-truth",
                 tmp_path/"truth.png", "--device", "model:", *SMALL, "-o", tmp_path/"out"]
    assert run(*arguments, "--calibration", tmp_path/"aside") == 0
    capfd.readouterr()
    # Without the calibration the images contradict the truth.
    assert run(*arguments) == 1
    assert "--ground-truth-scale" in error_line(capfd)


def test_images_of_another_size(data, tmp_path, monkeypatch, capfd):
    """Found before anything is rectified, on the device too."""
    small = tmp_path/"small.png"
    cv2.imwrite(str(small), np.zeros((60, 150), np.uint8))
    for command in (["match", small, small, "-o", tmp_path/"out"],):
        assert run(*command, "--device", "model:", "--calibration", data/"grid") == 1
        assert "150x60 pixels, the calibration is for 160x60" in error_line(capfd)
    for kind in ("model:", "calibrated"):
        with device_url(kind, data, monkeypatch) as url, connect(url) as device, \
                pytest.raises(ImageError, match="150x60 pixels, the grids are for 160x60"):
            device.compute(np.zeros((60, 150), np.uint8), np.zeros((60, 150), np.uint8), SETTINGS,
                           grids=read_calibration(data/"grid").pair.grids.grids)


def test_a_device_without_rectification_refuses_grids(data):
    """One call with grids is refused; the next one without works."""
    rectifier = read_calibration(data/"grid")
    pair      = photos(data)
    with native_device() as port, connect(f"tcp://127.0.0.1:{port}") as remote:
        for device in (device_without(Feature(0)), remote):
            chosen = choose_rectifying(device, rectifier)
            assert chosen.device_grids is None and chosen.where == "host"
            with pytest.raises(UnsupportedError, match="cannot rectify the pair: the device does not rectify"):
                device.compute(*pair, SETTINGS, grids=rectifier.pair.grids.grids)
            disparity = device.compute(*pair, SETTINGS).disparity
            assert np.array_equal(disparity, expected_map(*pair, SETTINGS))


def test_two_calibrations_on_one_device(data):
    """Each call has its own grids."""
    rng  = generator(361)
    pair = photos(data)
    with connect("model:") as device:
        assert device.info().features & Feature.RECTIFICATION
        for _ in range(3):
            rectifier = read(data/"other", lens_cameras(rng, 60, 1, WIDTH, HEIGHT))
            if rectifier.pair.grids is not None:
                result = device.compute(*pair, SETTINGS, grids=rectifier.pair.grids.grids)
                assert np.array_equal(result.disparity, expected_map(*rectifier.rectify(*pair), SETTINGS))
        assert np.array_equal(device.compute(*pair, SETTINGS).disparity, expected_map(*pair, SETTINGS))
