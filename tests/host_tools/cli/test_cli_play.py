#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Recordings: `stream --record`, `play`, recordings as sources, and what other programs read in them."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
import tracemalloc

import cv2
import mcap.reader
import mcap_ros2.decoder
import numpy as np
import pytest

from litestereo.host_tools.cameras.camera_info import ideal_cameras, read_camera_info, write_camera_info
from litestereo.host_tools.cameras.rectify import FILES, read_calibration
from litestereo.host_tools.core import mcap as ours
from litestereo.host_tools.core.disparity_map import DisparityMap
from litestereo.host_tools.core.errors import ImageError
from litestereo.host_tools.core.filters import FilterChain
from litestereo.host_tools.core.geometry import StereoGeometry
from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.host_tools.data.recordings import RecordedMap, RecordingReader
from litestereo.host_tools.data.sources import Shot
from litestereo.host_tools.export.recorder import recording
from support import data_sets
from support.command import error_line, run
from support.interruptible import interruptible
from support.pairs import generator, textured_pair

rosbags = pytest.importorskip("rosbags", reason="rosbags is in the extra `ros`")

WIDTH, HEIGHT, FRAMES = 96, 40, 4
# Infinity is at 1/3 of a pixel, which no float holds.
GEOMETRY = StereoGeometry(WIDTH, HEIGHT, 100.0, 0.06, 48.0 + 1/3, 20.0, 48.0)
MATCHING = ["--device", "model:", "--disparities", 16, "--block-size", 5, "--min-disparity", 2]
COMMAND  = [sys.executable, "-c", "import sys; from litestereo.host_tools.cli import main; sys.exit(main())"]


@pytest.fixture(autouse=True)
def no_device_in_the_environment(monkeypatch):
    monkeypatch.delenv("LITESTEREO_DEVICE", raising=False)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with pairs, and cameras whose right one is turned a little: they rectify."""
    rng = generator(1700)
    for number in range(FRAMES):
        left, right = textured_pair(WIDTH, HEIGHT, rng, 4 + number)
        data_sets.write(tmp_path/"left", {f"{number}.png": left})
        data_sets.write(tmp_path/"right", {f"{number}.png": right})
    cameras = list(ideal_cameras(GEOMETRY))
    angle   = 0.01
    cameras[1].rectification[:] = [[1, 0, 0], [0, np.cos(angle), -np.sin(angle)], [0, np.sin(angle), np.cos(angle)]]
    for name, camera in zip(FILES, cameras, strict=True):
        write_camera_info(tmp_path/"calibration"/name, camera)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def maps_of(folder):
    return [np.load(path) for path in sorted((folder).glob("disparity_*.npy"))]


def equal(ours, theirs):
    return len(ours) == len(theirs) and all(np.array_equal(one, other, equal_nan=True)
                                            for one, other in zip(ours, theirs, strict=True))


@pytest.mark.parametrize("calibrated", [False, True])
@pytest.mark.parametrize("filters", [[], ["--filter", "decimation:filter_magnitude=3", "--filter", "temporal"]])
@pytest.mark.parametrize("png", [False, True])
def test_played_back_the_maps_are_the_same(folder, calibrated, filters, png, capfd):
    """Those that `play` writes are those of the stream, and so are those of a stream from the recording."""
    calibration = ["--calibration", "calibration"] if calibrated else []
    record      = ["--record", "new/a.mcap", *(["--record-png"] if png else [])]
    stream      = ["--format", "npy", *MATCHING, *filters]
    assert run("stream", "left", "right", "-o", "maps", *stream, *calibration, *record) == 0
    out, err = capfd.readouterr()
    assert err == "" and "wrote    new/a.mcap" in out
    assert run("play", "new/a.mcap", "-o", "played", "--format", "npy", "--images", "--json") == 0
    played = json.loads(capfd.readouterr().out)
    maps   = maps_of(folder/"maps")
    assert len(maps) == FRAMES and equal(maps_of(folder/"played"), maps)
    assert (played["frames"], played["whole"], played["calibrated"]) == (FRAMES, True, calibrated)
    assert played["decimated_by"] == (3 if filters else 1) and played["settings"]["min_disparity"] == 2
    assert (played["width"], played["height"]) == (WIDTH, HEIGHT)
    for number in range(FRAMES):
        for side in ("left", "right"):
            assert np.array_equal(cv2.imread(f"played/{side}/{number:06}.png", cv2.IMREAD_UNCHANGED),
                                  cv2.imread(f"{side}/{number}.png", cv2.IMREAD_UNCHANGED))
    if calibrated:
        assert equal([np.load(f"played/depth_{number:06}.npy") for number in range(FRAMES)],
                     [np.load(f"maps/depth_{number}.npy") for number in range(FRAMES)])
        for name in FILES:
            ours, theirs = (read_camera_info(path/name) for path in (folder/"played"/"calibration",
                                                                     folder/"calibration"))
            assert np.array_equal(ours.projection, theirs.projection)
            assert np.array_equal(ours.rectification, theirs.rectification)
            assert ours.distortion_model == theirs.distortion_model
    # The calibration of the recording is as good as the original.
    calibration = ["--calibration", "played/calibration"] if calibrated else []
    assert run("stream", "new/a.mcap", "-o", "again", *stream, *calibration) == 0
    err = capfd.readouterr().err
    assert ("was recorded with a calibration" in err) == calibrated
    assert equal(maps_of(folder/"again"), maps)


@pytest.mark.long
def test_a_thousand_frames(tmp_path, monkeypatch, capfd):
    """Of pairs that all differ: maps and images come back in their order, over many chunks."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(ours, "CHUNK_BYTES", 20_000)
    rng   = generator(1705)
    pairs = [textured_pair(36, 12, rng, 4 + number % 5) for number in range(1000)]
    for number, pair in enumerate(pairs):
        for side, image in zip(("left", "right"), pair, strict=True):
            data_sets.write(tmp_path/side, {f"{number:04}.png": image})
    assert run("stream", "left", "right", "-o", "maps", "--format", "npy", *MATCHING, "--record", "a.mcap") == 0
    assert run("play", "a.mcap", "-o", "played", "--format", "npy", "--images") == 0
    maps = maps_of(tmp_path/"maps")
    assert len(maps) == 1000 and equal(maps_of(tmp_path/"played"), maps)
    assert len({map_.tobytes() for map_ in maps}) > 900
    for number, pair in enumerate(pairs):
        for side, image in zip(("left", "right"), pair, strict=True):
            assert np.array_equal(cv2.imread(f"played/{side}/{number:06}.png", cv2.IMREAD_UNCHANGED), image)
    # Forwards and, by the index, at any place, for the library of MCAP's inventors.
    with open("a.mcap", "rb") as stream:
        summary = mcap.reader.make_reader(stream, validate_crcs=True).get_summary()
    assert summary.statistics.chunk_count > 50 and summary.statistics.message_count == 3000


def test_a_recording_in_other_commands(folder, capfd):
    """It is a source of `view` and `measure`, and `export` converts what `play` has written."""
    assert run("stream", "left", "right", *MATCHING, "--calibration", "calibration", "--record", "a.mcap") == 0
    assert run("view", "a.mcap", *MATCHING, "--montage", "still.png", "--calibration", "calibration") == 0
    assert run("view", "left", "right", *MATCHING, "--montage", "still2.png", "--calibration", "calibration") == 0
    assert np.array_equal(cv2.imread("still.png"), cv2.imread("still2.png"))
    capfd.readouterr()
    assert run("measure", "a.mcap", *MATCHING, "--calibration", "calibration", "--json") == 0
    assert json.loads(capfd.readouterr().out)["frames"] == FRAMES
    assert run("play", "a.mcap", "-o", "played", "--frames", 1, "--format", "npy") == 0
    assert run("export", "played/disparity_000000.npy", "-o", "out", "--format", "ply", "--min-disparity", 2,
               "--calibration", "played/calibration") == 0


def test_other_programs_read_it(folder):
    """By the decoder of MCAP's inventors: times, images, cameras, the map relative to infinity, and the transform."""
    assert run("stream", "left", "right", "-o", "maps", "--format", "npy", *MATCHING, "--calibration", "calibration",
               "--record", "a.mcap") == 0
    now_ns = time.time_ns()
    with open("a.mcap", "rb") as stream:
        reader = mcap.reader.make_reader(stream, validate_crcs=True,
                                         decoder_factories=[mcap_ros2.decoder.DecoderFactory()])
        found: dict[str, list] = {}
        for _, channel, message, decoded in reader.iter_decoded_messages(log_time_order=False):
            found.setdefault(channel.topic, []).append((message.log_time, decoded))
    assert {topic: len(messages) for topic, messages in found.items()} == {
        "/tf_static": 1, **{f"/stereo/{name}": FRAMES for name in (
            "left/image_raw", "right/image_raw", "left/camera_info", "right/camera_info", "disparity")}}
    rectifier = read_calibration(folder/"calibration")
    maps      = maps_of(folder/"maps")
    for number, (stamp_ns, message) in enumerate(found["/stereo/disparity"]):
        assert now_ns - 60e9 < stamp_ns < now_ns
        assert message.header.stamp.sec*10**9 + message.header.stamp.nanosec == stamp_ns
        assert message.header.frame_id == "left_camera_optical"
        assert (message.f, message.t) == pytest.approx((rectifier.geometry.focal_px, 0.06))
        values = np.frombuffer(bytes(message.image.data), np.float32).reshape(HEIGHT, WIDTH)
        valid  = maps[number] > 16
        assert np.array_equal(values >= message.min_disparity - 0.01, valid)
        assert values[valid] == pytest.approx(maps[number][valid]/16 - 1/3, abs=1e-5)
        left = found["/stereo/left/image_raw"][number][1]
        assert left.encoding == "mono8" and left.step == WIDTH
        assert bytes(left.data) == cv2.imread(f"left/{number}.png", cv2.IMREAD_UNCHANGED).tobytes()
    (transform,) = found["/tf_static"][0][1].transforms
    assert (transform.header.frame_id, transform.child_frame_id) == ("left_camera_optical", "right_camera_optical")
    assert (transform.transform.translation.x, transform.transform.rotation.w) == pytest.approx((0.06, 1.0))
    camera = found["/stereo/right/camera_info"][0][1]
    assert camera.p == pytest.approx(list(rectifier.cameras[1].projection.ravel()))


def recorded(path, frames, geometry=None, settings=None, filters=(), compressed=False, size=(WIDTH, HEIGHT)):
    """Write a recording without a device; return the maps."""
    rng      = generator(1701)
    settings = settings or MatcherSettings(16, 5)
    chain    = FilterChain.parse(filters)
    cameras  = None if geometry is None else (geometry, ideal_cameras(geometry))
    maps     = []
    with recording(path, settings, cameras, compressed) as recorder:
        for number in range(frames):
            left, right = textured_pair(*size, rng, 5)
            values = rng.integers(16*settings.min_disparity, 16*(settings.min_disparity + settings.disparities - 1) + 1,
                                  left.shape)
            values = np.where(rng.random(left.shape) < 0.3, settings.invalid, values).astype(np.int16)
            maps.append(chain.process(DisparityMap(values, settings, geometry)))
            recorder.add(Shot(str(number), left, right), maps[-1])
    return maps


@pytest.mark.parametrize("least", [0, 255])
@pytest.mark.parametrize("zero_px", [None, 1/3, -17.123456789, 250.1])
@pytest.mark.parametrize("factor", [1, 3])
def test_every_sixteenth_is_kept(least, zero_px, factor, tmp_path):
    """At the ends of the range too, wherever infinity is."""
    geometry = None if zero_px is None else StereoGeometry(WIDTH, HEIGHT, 100.0, 0.06, 48.0 + zero_px, 20.0, 48.0)
    filters  = [] if factor == 1 else [f"decimation:filter_magnitude={factor}"]
    settings = MatcherSettings(256, 5, min_disparity=least)
    maps     = recorded(tmp_path/"a.mcap", 2, geometry, settings, filters)
    reader   = RecordingReader(tmp_path/"a.mcap")
    frames   = list(reader.frames())
    assert [frame.number for frame in frames] == [0, 1] and not reader.cut
    assert reader.recorded.matched == settings and reader.recorded.settings == maps[0].settings
    for frame, map_ in zip(frames, maps, strict=True):
        assert np.array_equal(frame.map.disparity, map_.disparity)
        assert (frame.map.factor, frame.map.geometry is None) == (factor, geometry is None)
        assert geometry is None or frame.map.geometry.zero_px == pytest.approx(map_.geometry.zero_px)


def test_a_recording_that_is_cut(tmp_path, capfd):
    """`play` and `stream` take the frames of the finished chunks, say so, and fail."""
    size = (640, 200)
    maps = recorded(tmp_path/"a.mcap", 5, size=size)
    data = (tmp_path/"a.mcap").read_bytes()
    (tmp_path/"a.mcap").write_bytes(data[:len(data)*3//5])
    frames = list(RecordingReader(tmp_path/"a.mcap").frames())
    assert 1 <= len(frames) < 5
    assert all(np.array_equal(frame.map.disparity, map_.disparity) for frame, map_ in zip(frames, maps, strict=False))
    capfd.readouterr()
    assert run("play", tmp_path/"a.mcap", "--json") == 1
    out, err = capfd.readouterr()
    assert json.loads(out)["frames"] == len(frames) and not json.loads(out)["whole"]
    assert err == (f"litestereo: error: {tmp_path/'a.mcap'}: what follows after {len(frames)} frames cannot be read: "
                   "the recording was not finished\n")
    assert run("stream", tmp_path/"a.mcap", "--device", "model:", "--disparities", 16, "--json") == 1
    out, err = capfd.readouterr()
    assert json.loads(out.splitlines()[-1])["summary"]["frames"] == len(frames)
    assert f"a.mcap: frames after the first {len(frames)} cannot be read: the recording was not finished" in err


@pytest.mark.parametrize("ending", [signal.SIGKILL, signal.SIGINT])
def test_a_recording_whose_process_ends(ending, folder, capfd):
    """Killed: all finished chunks are there. Ctrl-C: all frames are."""
    rng = generator(1702)
    for number in range(100):
        left, right = textured_pair(256, 128, rng, 6)
        data_sets.write(folder/"many"/"left", {f"{number:02}.png": left})
        data_sets.write(folder/"many"/"right", {f"{number:02}.png": right})
    command = [*COMMAND, "stream", "many", "--device", "model:", "--disparities", "16", "--record", "a.mcap", "--json"]
    with interruptible(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as running:
        lines = [json.loads(running.stdout.readline()) for _ in range(14)]
        os.kill(running.pid, ending)
        out, _ = running.communicate(timeout=120)
    printed = [*lines, *map(json.loads, out.splitlines())]
    assert running.returncode == (0 if ending == signal.SIGINT else -signal.SIGKILL)
    reader = RecordingReader(folder/"a.mcap")
    frames = list(reader.frames())
    assert reader.cut == (ending == signal.SIGKILL)
    if ending == signal.SIGINT:
        assert len(frames) == printed[-1]["summary"]["frames"] >= 14
    else:
        # A chunk has at least a mebibyte: six frames of these, and two chunks were finished.
        assert 12 <= len(frames) < 100 and len(frames) % 6 == 0
    for frame in frames:
        assert np.array_equal(frame.left, cv2.imread(f"many/left/{frame.number:02}.png", cv2.IMREAD_UNCHANGED))


def test_memory_does_not_grow_with_the_frames(tmp_path):
    """Writing and reading 40 frames of 0.7 MB takes no more than a few of them."""
    size = (512, 256)
    tracemalloc.start()
    try:
        settings = MatcherSettings(16, 5)
        shot     = Shot("", *textured_pair(*size, generator(1703), 5))
        map_     = DisparityMap(np.full((size[1], size[0]), 80, np.int16), settings)
        with recording(tmp_path/"a.mcap", settings, None, False) as recorder:
            recorder.add(shot, map_)
            tracemalloc.reset_peak()
            for _ in range(40):
                recorder.add(shot, map_)
        assert tracemalloc.get_traced_memory()[1] < 12e6
        tracemalloc.reset_peak()
        assert sum(1 for _ in RecordingReader(tmp_path/"a.mcap").frames()) == 41
        assert tracemalloc.get_traced_memory()[1] < 30e6
    finally:
        tracemalloc.stop()
    assert (tmp_path/"a.mcap").stat().st_size > 28e6


def test_no_frame_no_file(tmp_path):
    with recording(tmp_path/"a.mcap", MatcherSettings(16, 5), None, False):
        pass
    assert not (tmp_path/"a.mcap").exists()


def test_a_full_disk_is_one_line(folder, capfd):
    """Linux's device that is always full."""
    assert run("stream", "left", "right", *MATCHING, "--record", "/dev/full") == 1
    assert "/dev/full: cannot be written: No space left on device" in error_line(capfd)


def test_a_file_that_is_there(folder, capfd):
    """It is kept without --force, and a source is never recorded into."""
    stream = ["stream", "left", "right", *MATCHING, "--frames", 1, "--record", "a.mcap"]
    assert run(*stream) == 0
    before = (folder/"a.mcap").read_bytes()
    capfd.readouterr()
    assert run(*stream) == 1
    assert "a.mcap: is there already: name another file, or give --force to replace it" in error_line(capfd)
    assert (folder/"a.mcap").read_bytes() == before
    assert run(*stream, "--force") == 0
    capfd.readouterr()
    for force in ([], ["--force"]):
        assert run("stream", "a.mcap", *MATCHING, "--record", "a.mcap", *force) == 1
        error_line(capfd)
    assert list(RecordingReader(folder/"a.mcap").frames())


@pytest.mark.parametrize(("arguments", "status", "text"), [
    # The likeliest ones: a file that is not there, one of another program, and a folder that is a file.
    (["play", "none.mcap"], 1, "none.mcap: cannot be read: No such file"),
    (["play", "left/0.png"], 1, "left/0.png: is no MCAP file"),
    (["play", "other.mcap"], 1, "other.mcap: is no recording of `litestereo stream --record`"),
    (["play", "a.mcap", "-o", "left/0.png"], 1, "left/0.png: is a file, the maps need a folder"),
    (["play", "a.mcap", "--images"], 2, "--images needs -o"),
    (["play", "a.mcap", "--frames", "0"], 2, "at least 1"),
    (["stream", "left", "right", *MATCHING, "--record-png"], 2, "--record-png goes with --record"),
    (["stream", "left", "right", *MATCHING, "--record", "left"], 1, "left: cannot be written: it is a folder"),
    (["stream", "a.mcap", "other.mcap", *MATCHING], 2, "a recording is a source alone"),
    (["stream", "other.mcap", *MATCHING], 1, "other.mcap: is no recording"),
    (["stream", "a.mcap", "left", *MATCHING], 2, "a.mcap is a recording, left a folder"),
])
def test_mistakes_are_one_line(folder, arguments, status, text, capfd):
    recorded(folder/"a.mcap", 1)
    (folder/"other.mcap").write_bytes((folder/"a.mcap").read_bytes().replace(b"litestereo", b"LITESTEREO"))
    capfd.readouterr()
    assert run(*arguments) == status
    assert text in error_line(capfd)


def test_damaged_messages(tmp_path, monkeypatch):
    """Any byte may be another one: what is read are images, or the file is refused, or its end is missing."""
    # Without the sums of the chunks, so that damage comes to the messages.
    monkeypatch.setattr(ours.zlib, "crc32", lambda data: 0)
    recorded(tmp_path/"a.mcap", 2, GEOMETRY)
    data    = (tmp_path/"a.mcap").read_bytes()
    rng     = generator(1704)
    refused = 0
    for _ in range(100):
        broken = bytearray(data)
        # Most bytes are pixels: half of the damage is near the begins of messages.
        place  = data.index(b"mono8", int(rng.integers(len(data)//4))) if rng.random() < 0.5 else len(data)//2
        spread = 60 if rng.random() < 0.5 else len(data)//2 - 1
        broken[place + int(rng.integers(-spread, spread)) if place + spread < len(data) else place] ^= int(
            rng.integers(1, 256))
        (tmp_path/"b.mcap").write_bytes(bytes(broken))
        try:
            for frame in RecordingReader(tmp_path/"b.mcap").frames():
                assert frame.left.dtype == frame.right.dtype == np.uint8 and frame.left.ndim == frame.right.ndim == 2
        except ImageError as error:
            assert str(tmp_path/"b.mcap") in str(error)
            refused += 1
    assert refused > 10


@pytest.mark.parametrize("name", ["version", "matched", "settings", "factor", "namespace"])
@pytest.mark.parametrize("value", [None, "", "x", "[]", "{}", '{"disparities": null}', "["*100_000, "0", "-1"])
def test_metadata_of_no_recording(name, value):
    """Texts that are not there, or not those that a recorder writes, are a ValueError: the file is no recording."""
    settings = MatcherSettings(16, 5)
    values   = RecordedMap(settings, settings, 1, "/stereo").values()
    assert RecordedMap.parse(values) == RecordedMap(settings, settings, 1, "/stereo")
    if name == "namespace" and value is not None:
        return  # Any text is one.
    values = {key: text for key, text in values.items() if key != name} | ({name: value} if value is not None else {})
    if value == "{}" and name in ("matched", "settings"):
        assert RecordedMap.parse(values).matched.disparities  # The defaults.
        return
    with pytest.raises(ValueError):
        RecordedMap.parse(values)


@pytest.mark.parametrize("value", [np.inf, 2048.0, 1e30, np.nan])
def test_a_disparity_that_no_map_holds(value, tmp_path, monkeypatch, recwarn, capfd):
    """It is refused, and NumPy casts nothing that it warns of; a number that is none is no disparity."""
    monkeypatch.setattr(ours.zlib, "crc32", lambda data: 0)
    (map_,) = recorded(tmp_path/"a.mcap", 1)
    row     = np.where(map_.valid[0], map_.disparity[0]/16, -1).astype("<f4")
    data    = (tmp_path/"a.mcap").read_bytes()
    assert data.count(row.tobytes()) == 1
    place        = int(np.flatnonzero(map_.valid[0])[0])
    other        = row.copy()
    other[place] = value
    (tmp_path/"a.mcap").write_bytes(data.replace(row.tobytes(), other.tobytes()))
    capfd.readouterr()
    status = run("play", tmp_path/"a.mcap", "-o", tmp_path/"played", "--format", "npy")
    if np.isnan(value):
        assert status == 0 and maps_of(tmp_path/"played")[0][0, place] == map_.settings.invalid
    else:
        assert status == 1 and "frame 0 has disparities that no map holds" in error_line(capfd)
    assert not recwarn.list


@pytest.mark.parametrize(("right", "map_"), [((8, 10), (9, 12)), ((9, 12), (8, 12)), ((9, 12), (9, 6))])
def test_images_and_map_of_other_sizes(right, map_, tmp_path, capfd):
    """No device makes such a frame: it is refused with its number."""
    settings = MatcherSettings(16, 5)
    with recording(tmp_path/"a.mcap", settings, None, False) as recorder:
        for sizes in (((9, 12), (9, 12)), (right, map_)):
            recorder.add(Shot("", np.zeros((9, 12), np.uint8), np.zeros(sizes[0], np.uint8)),
                         DisparityMap(np.zeros(sizes[1], np.int16), settings))
    assert run("play", tmp_path/"a.mcap") == 1
    assert "is damaged: images and map of frame 1 do not fit each other" in error_line(capfd)


def test_opencv_does_not_print_of_damaged_pngs(tmp_path, monkeypatch, capfd):
    """What libpng has to say of them is in the one line of the error."""
    monkeypatch.setattr(ours.zlib, "crc32", lambda data: 0)
    recorded(tmp_path/"a.mcap", 1, compressed=True)
    data  = bytearray((tmp_path/"a.mcap").read_bytes())
    place = data.index(b"IDAT") + 4
    data[place:place + 40] = bytes(40)
    (tmp_path/"a.mcap").write_bytes(bytes(data))
    capfd.readouterr()
    assert run("play", tmp_path/"a.mcap") == 1
    assert "a message of /stereo/left/image_raw/compressed cannot be read" in error_line(capfd)
