#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""`litestereo export`: all that it writes is read back by other software."""

import dataclasses
import json
import re
import sys
import time

import cv2
import mcap.reader
import mcap_ros2.decoder
import numpy as np
import pytest

from litestereo.host_tools.cameras.camera_info import ideal_cameras, write_camera_info
from litestereo.host_tools.core.extras import install_command
from litestereo.host_tools.core.geometry import StereoGeometry
from litestereo.host_tools.core.images import write_disparity
from litestereo.host_tools.core.settings import MatcherSettings
from support import data_sets
from support.command import error_line, run
from support.data_sets import HEIGHT, WIDTH
from support.pairs import generator

#: The cameras of `data_sets.CALIB`.
GEOMETRY = StereoGeometry(WIDTH, HEIGHT, focal_px=500.5, baseline_m=0.1205, cx_left_px=60.25, cy_px=24.5,
                          cx_right_px=63.5)
SETTINGS = MatcherSettings(disparities=32, block_size=11)

#: As the map was matched, for the bag.
MATCHED = ("--disparities", 32, "--block-size", 11)

#: Cameras by two numbers.
IDEAL = ("--focal", "500", "--baseline", "0.1")


def cameras():
    """Two cameras of `GEOMETRY`, which have to be undistorted and turned first."""
    turned = cv2.Rodrigues(np.array([0.01, -0.02, 0.03]))[0]
    return [dataclasses.replace(camera, camera_matrix=camera.camera_matrix + np.diag([9.0, 8.0, 0.0]),
                                distortion=np.array([-0.3, 0.1, 0.001, side, 0.0]), rectification=turned)
            for side, camera in enumerate(ideal_cameras(GEOMETRY))]


@pytest.fixture
def folder(tmp_path):
    """A map as `match` writes it, left image, and cameras."""
    rng    = generator(90)
    map_   = np.full((HEIGHT, WIDTH), SETTINGS.invalid, np.int16)
    inside = np.s_[5:-5, 36:-5]
    map_[inside] = rng.integers(0, 16*31, map_[inside].shape)
    map_[inside][rng.random(map_[inside].shape) < 0.2] = SETTINGS.invalid
    map_[5, 36:39] = 0, 8, 16*31
    write_disparity(tmp_path, map_, SETTINGS)
    data_sets.write(tmp_path, {"left.png": rng.integers(0, 256, (HEIGHT, WIDTH, 3)).astype(np.uint8),
                               "grey.png": rng.integers(0, 256, (HEIGHT, WIDTH)).astype(np.uint8),
                               "small.png": np.zeros((HEIGHT, WIDTH - 1), np.uint8)})
    (tmp_path / "calib.txt").write_text(data_sets.CALIB)
    for name, camera in zip(("left", "right"), cameras(), strict=True):
        write_camera_info(tmp_path / f"{name}.yaml", camera)
        write_camera_info(tmp_path / "swapped" / f"{'right' if name == 'left' else 'left'}.yaml", camera)
    return tmp_path


def export(folder_, *arguments, source="disparity.npy", out="out"):
    return run("export", folder_/source, "-o", folder_/out, *arguments)


def pixels(folder_):
    """The map in pixels, nan where there is none."""
    map_ = np.load(folder_ / "disparity.npy")
    return np.where(map_ > -16, map_/16, np.nan)


def points(folder_):
    """The points by OpenCV, with its Q, nan where there is none."""
    found = cv2.reprojectImageTo3D(pixels(folder_).astype(np.float32), GEOMETRY.q())
    found[~np.isfinite(found).all(axis=-1)] = np.nan
    return found


def test_maps_are_those_of_match(folder, capfd):
    assert export(folder, "--format", "pfm", "--format", "png", "--format", "pfm") == 0
    out, err = capfd.readouterr()
    assert (out.splitlines(), err) == ([f"wrote       {folder}/out/disparity.{end}" for end in ("pfm", "png")], "")
    for name in ("disparity.pfm", "disparity.png"):
        assert (folder / "out" / name).read_bytes() == (folder / name).read_bytes()
    read = cv2.imread(str(folder / "out" / "disparity.pfm"), cv2.IMREAD_UNCHANGED)
    np.testing.assert_array_equal(np.where(np.isinf(read), np.nan, read), pixels(folder))
    # From the 16-bit image too, which does not know 0.
    assert export(folder, "--format", "pfm", source="disparity.png") == 0
    read = cv2.imread(str(folder / "out" / "disparity.pfm"), cv2.IMREAD_UNCHANGED)
    np.testing.assert_allclose(np.where(np.isinf(read), np.nan, read), np.maximum(pixels(folder), 1/256))


def test_depth(folder, capfd):
    assert export(folder, "--format", "depth-npy", "--format", "depth-png", "--calib", folder/"calib.txt",
                  "--json") == 0
    told  = json.loads(capfd.readouterr().out)
    depth = np.load(folder / "out" / "depth.npy")
    valid = np.isfinite(pixels(folder))
    assert told == {"width": WIDTH, "height": HEIGHT, "valid_pixels": valid.sum(),
                    "files": [f"{folder}/out/depth.{end}" for end in ("npy", "png")]}
    assert depth.dtype == np.float32 and np.array_equal(np.isfinite(depth), valid)
    # Middlebury's own formula, with doffs.
    np.testing.assert_allclose(depth[valid], 120.5*500.5/(pixels(folder)[valid] + 3.25)/1000, rtol=1e-6)
    image = cv2.imread(str(folder / "out" / "depth.png"), cv2.IMREAD_UNCHANGED)
    assert image.dtype == np.uint16 and np.array_equal(image > 0, valid)
    np.testing.assert_allclose(image[valid], 1000*depth[valid], atol=0.5001)


def test_depth_beyond_16_bits_is_none(folder, capfd):
    assert export(folder, "--format", "depth-png", "--format", "depth-npy", "--focal", 655.354, "--baseline", 0.05) == 0
    image = cv2.imread(str(folder / "out" / "depth.png"), cv2.IMREAD_UNCHANGED)
    depth = np.load(folder / "out" / "depth.npy")
    # Of 0 pixels, of half a pixel, and of 31.
    assert np.isinf(depth[5, 36]) and image[5, 36] == 0
    assert image[5, 37] == 65535 and depth[5, 37] == pytest.approx(65.5354)
    assert image[5, 38] == round(655.354*0.05/31*1000)
    assert export(folder, "--format", "depth-png", "--focal", 655.36, "--baseline", 0.05) == 0
    assert cv2.imread(str(folder / "out" / "depth.png"), cv2.IMREAD_UNCHANGED)[5, 37] == 0


def read_ply(path):
    """Vertices of a binary PLY, by what its header says."""
    header, body = path.read_bytes().split(b"end_header\n", 1)
    assert header.startswith(b"ply\nformat binary_little_endian 1.0\n")
    (number,)  = re.findall(rb"element vertex (\d+)", header)
    properties = re.findall(rb"property (float|uchar) (\w+)", header)
    kinds      = {b"float": "<f4", b"uchar": "u1"}
    vertices   = np.frombuffer(body, [(name.decode(), kinds[kind]) for kind, name in properties])
    assert len(vertices) == int(number)
    return vertices


@pytest.mark.parametrize("image", ["left.png", "grey.png", None])
def test_ply(folder, image):
    colours = ["--left", folder/image] if image else []
    assert export(folder, "--format", "ply", "--calibration", folder, *colours) == 0
    vertices = read_ply(folder / "out" / "cloud.ply")
    expected = points(folder)
    there    = np.isfinite(expected[:, :, 2])
    np.testing.assert_allclose(np.stack([vertices[axis] for axis in "xyz"], axis=-1), expected[there], rtol=1e-4)
    if image is None:
        assert vertices.dtype.names == ("x", "y", "z")
    else:
        bgr = cv2.imread(str(folder / image), cv2.IMREAD_COLOR)[there]
        assert np.array_equal(np.stack([vertices[name] for name in ("blue", "green", "red")], axis=-1), bgr)
    assert export(folder, "--format", "ply", "--calib", folder/"calib.txt", "--max-depth", 5) == 0
    assert len(read_ply(folder / "out" / "cloud.ply")) == np.sum(expected[there][:, 2] <= 5) < len(vertices)


def read_bag(path):
    """Messages by topic, with their log time, as mcap's own library decodes them."""
    with path.open("rb") as file:
        reader = mcap.reader.make_reader(file, decoder_factories=[mcap_ros2.decoder.DecoderFactory()])
        return {channel.topic: (schema.name, message.log_time, decoded)
                for schema, channel, message, decoded in reader.iter_decoded_messages()}


def floats(image):
    """Values of a sensor_msgs/Image."""
    assert (image.encoding, image.is_bigendian, image.step) == ("32FC1", 0, 4*image.width)
    return np.frombuffer(image.data, "<f4").reshape(image.height, image.width)


def test_a_bag(folder, capfd):
    stamp = 1_700_000_000_123_456_789
    assert export(folder, "--format", "mcap", "--calibration", folder, "--left",
                  folder/"left.png", "--stamp-ns", stamp, "--frame-id", "eye", "--namespace", "/rig/stereo",
                  *MATCHED) == 0
    bag = read_bag(folder / "out" / "rosbag2" / "rosbag2.mcap")
    assert capfd.readouterr().out == f"wrote       {folder}/out/rosbag2/rosbag2.mcap\n"
    assert {topic: kind for topic, (kind, _, _) in bag.items()} == {
        "/rig/stereo/disparity":         "stereo_msgs/msg/DisparityImage",
        "/rig/stereo/depth":             "sensor_msgs/msg/Image",
        "/rig/stereo/left/camera_info":  "sensor_msgs/msg/CameraInfo",
        "/rig/stereo/right/camera_info": "sensor_msgs/msg/CameraInfo",
        "/rig/stereo/points2":           "sensor_msgs/msg/PointCloud2",
    }
    for _, log_time, message in bag.values():
        assert log_time == stamp
        assert (message.header.stamp.sec, message.header.stamp.nanosec) == (1_700_000_000, 123_456_789)
        assert message.header.frame_id == "eye"
    messages = {topic.removeprefix("/rig/stereo/"): message for topic, (_, _, message) in bag.items()}

    told   = messages["disparity"]
    values = floats(told.image)
    window = told.valid_window
    whole  = (0, 0, WIDTH, HEIGHT)
    assert told.image.header.frame_id == "eye"
    assert (window.x_offset, window.y_offset, window.width, window.height) == cv2.getValidDisparityROI(
        whole, whole, 0, SETTINGS.disparities, SETTINGS.block_size) == (36, 5, 79, 40)
    assert (told.f, told.t) == pytest.approx((500.5, 0.1205))
    assert (told.min_disparity, told.max_disparity, told.delta_d) == (3.25, 34.25, 1/16)
    valid  = np.isfinite(pixels(folder))
    np.testing.assert_allclose(values[valid], pixels(folder)[valid] + 3.25)
    assert (values[~valid] < told.min_disparity).all()

    # As a node of ROS computes the depth.
    depth = floats(messages["depth"])
    np.testing.assert_allclose(depth[valid], 500.5*0.1205/values[valid], rtol=1e-5)
    assert np.isnan(depth[~valid]).all()

    left, right = messages["left/camera_info"], messages["right/camera_info"]
    for camera, written in zip((left, right), cameras(), strict=True):
        assert (camera.width, camera.height, camera.distortion_model) == (WIDTH, HEIGHT, "plumb_bob")
        for name, matrix in (("k", written.camera_matrix), ("d", written.distortion), ("r", written.rectification),
                             ("p", written.projection)):
            np.testing.assert_allclose(getattr(camera, name), matrix.ravel())
    assert right.p[3] == pytest.approx(-500.5*0.1205) and left.p[3] == 0

    cloud  = messages["points2"]
    fields = [(field.name, field.offset, field.datatype, field.count) for field in cloud.fields]
    assert fields == [("x", 0, 7, 1), ("y", 4, 7, 1), ("z", 8, 7, 1), ("rgb", 12, 7, 1)]
    assert (cloud.height, cloud.width, cloud.point_step, cloud.row_step) == (HEIGHT, WIDTH, 16, 16*WIDTH)
    assert not cloud.is_bigendian and not cloud.is_dense
    table = np.frombuffer(cloud.data, [("xyz", "<f4", 3), ("bgr", "u1", 4)]).reshape(HEIGHT, WIDTH)
    np.testing.assert_allclose(table["xyz"], points(folder), rtol=1e-4)
    assert np.array_equal(table["bgr"][:, :, :3], cv2.imread(str(folder / "left.png")))


def test_a_bag_without_more_than_needed(folder):
    before = time.time_ns()
    assert export(folder, "--format", "mcap", *IDEAL, "--principal-point", 50, 20, *MATCHED) == 0
    bag  = read_bag(folder / "out" / "rosbag2" / "rosbag2.mcap")
    told = bag["/stereo/disparity"][2]
    assert (told.min_disparity, told.max_disparity) == (0, 31)
    assert before <= bag["/stereo/depth"][1] <= time.time_ns()
    assert bag["/stereo/left/camera_info"][2].p[2] == 50 and bag["/stereo/left/camera_info"][2].p[6] == 20
    assert len(bag["/stereo/points2"][2].fields) == 3


def test_a_bag_is_read_by_rosbags_too(folder):
    from rosbags.highlevel import AnyReader

    assert export(folder, "--format", "mcap", *IDEAL, *MATCHED) == 0
    with AnyReader([folder / "out" / "rosbag2"]) as reader:
        assert {connection.topic for connection, _, _ in reader.messages()} == {
            f"/stereo/{name}" for name in ("disparity", "depth", "left/camera_info", "right/camera_info", "points2")}


@pytest.mark.parametrize(("arguments", "status", "text"), [
    (["--format", "obj"], 2, "invalid choice"),
    ([], 2, "--format"),
    (["--format", "ply"], 2, "--format ply needs the cameras: give --calibration, --calib, or --focal with --baseline"),
    (["--format", "ply", "--focal", "500"], 2, "need each other"),
    (["--format", "ply", "--focal", "0", "--baseline", "1"], 2, "above 0"),
    (["--format", "ply", "--focal", "1", "--baseline", "1"], 1, "no focal length in pixels"),
    (["--format", "ply", *IDEAL, "--principal-point", "nan", "1"], 1, "cx_left_px must be a number"),
    (["--format", "ply", *IDEAL, "--principal-point", "5000", "1"], 1, "a principal point far outside"),
    (["--format", "ply", "--calib", "calib.txt", *IDEAL], 2, "only one of"),
    (["--format", "ply", "--calib", "calib.txt", "--principal-point", "1", "2"], 2, "goes with --focal"),
    (["--format", "ply", "--calib", "left.yaml"], 1, "no calib.txt"),
    (["--format", "ply", "--calib", "none.txt"], 1, "no such file"),
    (["--format", "ply", "--calibration", "none"], 1, "none/left.yaml: there is no such file"),
    (["--format", "ply", "--calibration", "swapped"], 1, "swapped"),
    (["--format", "ply", "--left", "small.png", *IDEAL], 1, "is 119x50 pixels, the map 120x50"),
    (["--format", "ply", "--left", "calib.txt", *IDEAL], 1, "not an image"),
    (["--format", "mcap", *IDEAL, "--disparities", "16", "--block-size", "11"], 1, "out of range"),
    (["--format", "mcap", *IDEAL, "--disparities", "64"], 1, "at its border"),
    (["--format", "mcap", *IDEAL, "--block-size", "8"], 2, "odd"),
    (["--format", "mcap", *IDEAL, "--namespace", "my topic"], 2, "as /stereo"),
    (["--format", "mcap", *IDEAL, "--stamp-ns", "9999999999999999999"], 2, "less than"),
])
def test_mistakes_are_one_line(folder, arguments, status, text, monkeypatch, capfd):
    monkeypatch.chdir(folder)
    assert run("export", "disparity.npy", "-o", "out", *arguments) == status
    assert text in error_line(capfd)
    assert not (folder / "out").exists()


def test_more_mistakes(folder, capfd):
    for source, text in (("none.npy", "no such file"), ("left.png", "no disparity map"), ("calib.txt", "not an image")):
        assert export(folder, "--format", "pfm", source=source) == 1
        assert text in error_line(capfd)
    assert export(folder, "--format", "pfm", out="left.png") == 1
    assert "cannot be written" in error_line(capfd)
    assert export(folder, "--format", "mcap", *IDEAL, *MATCHED, out="left.png") == 1
    assert "cannot be written" in error_line(capfd)
    np.save(folder / "smaller.npy", np.full((40, 60), -16, np.int16))
    assert export(folder, "--format", "ply", "--calib", folder/"calib.txt", source="smaller.npy") == 1
    assert "the map has 60x40 pixels, the cameras 120x50" in error_line(capfd)
    assert export(folder, "--format", "mcap", *IDEAL, *MATCHED) == 0
    capfd.readouterr()
    assert export(folder, "--format", "mcap", *IDEAL, *MATCHED) == 1
    assert "is there already" in error_line(capfd)


def test_without_rosbags_it_says_what_to_install(folder, monkeypatch, capfd):
    monkeypatch.setitem(sys.modules, "rosbags.typesys", None)
    assert export(folder, "--format", "mcap", *IDEAL, *MATCHED) == 1
    assert error_line(capfd).endswith(f"not installed: {install_command('ros')}\n")
    assert export(folder, "--format", "ply", *IDEAL) == 0


def test_help_has_examples(capfd):
    assert run("export", "--help") == 0
    out = capfd.readouterr().out
    assert "litestereo export out/disparity.npy" in out and "rosbag2" in out


@pytest.mark.parametrize("doffs", [-40, -3.25, 0, 3.25, 10])
def test_depth_by_numbers_has_doffs(folder, doffs, capfd):
    """As Middlebury's formula has it, in all formats; without the option 0 is said to be assumed."""
    given = ("--format", "depth-npy", "--format", "ply", *IDEAL)
    assert export(folder, *given, "--doffs", doffs) == 0
    assert "doffs" not in capfd.readouterr().err
    depth = np.load(folder / "out" / "depth.npy")
    known = np.isfinite(pixels(folder)) & (pixels(folder) + doffs > 0)
    np.testing.assert_allclose(depth[known], 50/(pixels(folder)[known] + doffs), rtol=1e-5)
    np.testing.assert_allclose(read_ply(folder / "out" / "cloud.ply")["z"], depth[known])
    assert export(folder, *given) == 0
    (note,) = capfd.readouterr().err.splitlines()
    assert note.startswith("litestereo: note: --doffs is not given: ") and "doffs 0" in note
    assert np.array_equal(np.load(folder / "out" / "depth.npy"), depth, equal_nan=True) == (doffs == 0)


def test_doffs_of_a_calibration_are_known(folder, capfd):
    for cameras_ in (("--calib", folder/"calib.txt"), ("--calibration", folder)):
        assert export(folder, "--format", "depth-npy", *cameras_) == 0
        assert capfd.readouterr().err == ""
        assert export(folder, "--format", "depth-npy", *cameras_, "--doffs", 1) == 2
        assert "--doffs goes with --focal" in error_line(capfd)
    assert export(folder, "--format", "pfm", *IDEAL) == 0
    assert capfd.readouterr().err == ""
    for wrong in ("nan", "inf", "x"):
        assert export(folder, "--format", "depth-npy", *IDEAL, "--doffs", wrong) == 2
        assert "must be a number" in error_line(capfd)


def test_maps_of_other_programs_are_said_and_uncertain_ones_refused(folder, capfd):
    floats = np.where(np.isnan(pixels(folder)), -1, pixels(folder)).astype(np.float32)
    np.save(folder / "floats.npy", floats)
    assert export(folder, "--format", "png", "--format", "pfm", "--json", source="floats.npy") == 0
    out, err = capfd.readouterr()
    count    = int(np.isnan(pixels(folder)).sum())
    assert err == (f"litestereo: note: {folder}/floats.npy: read as float32 in .npy, in pixels; {count} pixels without "
                   "a disparity (values -1)\n")
    assert json.loads(out)["valid_pixels"] == floats.size - count
    assert (folder / "out" / "disparity.png").read_bytes() == (folder / "disparity.png").read_bytes()
    np.save(folder / "sixteenths.npy", np.load(folder / "disparity.npy").astype(np.float32))
    assert export(folder, "--format", "png", source="sixteenths.npy") == 1
    assert "give --map-scale 16" in error_line(capfd)
    assert export(folder, "--format", "png", "--map-scale", 16, source="sixteenths.npy") == 0
    assert (folder / "out" / "disparity.png").read_bytes() == (folder / "disparity.png").read_bytes()
    floats[0, 0] = -2
    np.save(folder / "floats.npy", floats)
    assert export(folder, "--format", "png", source="floats.npy") == 1
    capfd.readouterr()
    assert export(folder, "--format", "png", "--none-value", -1, "--none-value", -2, source="floats.npy") == 0
    assert (folder / "out" / "disparity.png").read_bytes() == (folder / "disparity.png").read_bytes()
