#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The object with cv2.StereoBM's methods, against cv2.StereoBM."""

import re
import warnings
from pathlib import Path

import cv2
import numpy as np
import pytest

from litestereo.host_tools.core.errors import ImageError, LiteStereoError, SettingsError, UnsupportedError
from litestereo.host_tools.core.features import ALL_STAGES, DESCRIPTIONS, Feature
from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.host_tools.devices.connect import connect
from litestereo.host_tools.devices.stereo_bm import PREFILTER_NORMALIZED_RESPONSE, StereoBM, StereoBM_create
from support.devices import device_without
from support.opencv import defined_region
from support.pairs import generator, textured_pair
from support.settings import OpenCVDraws


def test_it_has_the_methods_and_the_defaults_of_cv2():
    ours, theirs = StereoBM_create(device="model:"), cv2.StereoBM_create()
    names        = {name for name in dir(cv2.StereoBM) if not name.startswith("_")}
    assert names <= set(dir(StereoBM))
    getters = [name for name in sorted(names) if name.startswith("get")]
    assert len(getters) == 15
    for name in getters:
        if name not in ("getROI1", "getROI2"):
            assert getattr(ours, name)() == getattr(theirs, name)(), name
    for name in getters:
        if name not in ("getDefaultName", "getROI1", "getROI2"):
            for matcher in (ours, theirs):
                getattr(matcher, name.replace("get", "set"))(7)
            assert getattr(ours, name)() == getattr(theirs, name)(), name
    assert ours.getBlockSize() == 7
    ours.setROI1((1, 2, 3, 4))
    ours.setROI2((5, 6, 7, 8))
    assert (ours.getROI1(), ours.getROI2()) == ((1, 2, 3, 4), (5, 6, 7, 8))
    ours.clear()
    assert ours.empty() is theirs.empty() is False


def test_it_computes_what_cv2_computes():
    """One changed line: everything after it is the same for both."""
    rng   = generator(45)
    draws = OpenCVDraws(rng, block_size=15, disparities=48)
    for _ in range(40):
        settings    = draws.settings()
        width       = settings.minimum_size[0] + int(rng.integers(30, 60))
        left, right = textured_pair(width, settings.block_size + 20, rng, int(rng.integers(1, 12)))
        # Smooth images have larger islands.
        left, right = (cv2.GaussianBlur(image, (7, 7), 0) for image in (left, right))
        speckle     = int(rng.choice([0, 20, 200])), int(rng.choice([0, 4, 32, -1]))
        maps        = []
        for matcher in (StereoBM_create(settings.disparities, settings.block_size, device="model:"),
                        cv2.StereoBM_create(settings.disparities, settings.block_size)):
            matcher.setMinDisparity(settings.min_disparity)
            matcher.setPreFilterCap(settings.prefilter_cap)
            matcher.setTextureThreshold(settings.texture_threshold)
            matcher.setUniquenessRatio(settings.uniqueness_ratio)
            matcher.setDisp12MaxDiff(settings.disp12_max_diff)
            matcher.setSpeckleWindowSize(speckle[0])
            matcher.setSpeckleRange(speckle[1])
            maps.append(matcher.compute(left, right))
        region = defined_region(left.shape, settings)
        assert maps[0].dtype == maps[1].dtype == np.int16
        assert np.array_equal(maps[0][region], maps[1][region]), (settings, speckle)
    draws.check()


def test_an_open_device_stays_open():
    left, right = textured_pair(120, 40, generator(46))
    with connect("model:") as device:
        with StereoBM_create(64, 9, device=device) as matcher:
            first = matcher.compute(left, right)
        assert np.array_equal(device.compute(left, right).disparity, first)
    with StereoBM(device="model:", num_disparities=0) as matcher:
        assert matcher.getNumDisparities() == 64
        assert matcher.compute(left, right).shape == (40, 120)
        matcher.close()
        assert matcher.compute(left, right).shape == (40, 120)


@pytest.mark.parametrize(("setter", "value", "error", "text"), [
    ("setPreFilterType", PREFILTER_NORMALIZED_RESPONSE, UnsupportedError, "PREFILTER_XSOBEL"),
    ("setROI1", (0, 0, 9, 9), UnsupportedError, "cut the map"),
    ("setNumDisparities", 17, SettingsError, "multiple of 16"),
    ("setBlockSize", 8, SettingsError, "odd"),
    ("setPreFilterCap", 64, SettingsError, "prefilter cap"),
    ("setMinDisparity", -1, SettingsError, "min disparity"),
    ("setUniquenessRatio", 101, SettingsError, "uniqueness ratio"),
    ("setSpeckleWindowSize", -1, SettingsError, "speckle window"),
])
def test_what_is_not_there_is_refused_by_compute(setter, value, error, text):
    matcher = StereoBM_create(device="model:")
    getattr(matcher, setter)(value)
    image = np.zeros((40, 120), np.uint8)
    with pytest.raises(error, match=text):
        matcher.compute(image, image)


def test_numbers_are_whole():
    with pytest.raises(SettingsError, match="whole number"):
        StereoBM_create(device="model:").setBlockSize(9.5)


def test_a_device_that_is_not_there():
    image = np.zeros((40, 120), np.uint8)
    with pytest.raises(LiteStereoError):
        StereoBM_create(device="tcp://127.0.0.1:1").compute(image, image)


def both(disparities=32, block=11):
    return StereoBM_create(disparities, block, device="model:"), cv2.StereoBM_create(disparities, block)


def test_the_factory_of_the_class():
    for make in (StereoBM.create, cv2.StereoBM.create):
        matcher = make(32, 11)
        assert (matcher.getNumDisparities(), matcher.getBlockSize()) == (32, 11)
        assert make().getNumDisparities() == 64 and make(blockSize=9).getBlockSize() == 9


@pytest.mark.parametrize("make", [
    lambda shape: np.full(shape, 5, np.int16),
    lambda shape: np.full((*shape, 1), 5, np.int16),
    lambda shape: np.full(shape, 5, np.float32),
    lambda shape: np.full(shape, 5, np.uint16),
    lambda shape: np.full((3, 3), 5, np.int16),
    lambda shape: None,
])
def test_an_array_for_the_map(make):
    left, right = textured_pair(120, 40, generator(47))
    for matcher in both():
        plain = matcher.compute(left, right)
        given = make(left.shape)
        found = matcher.compute(left, right, given)
        taken = given is not None and given.dtype == np.int16 and given.size == left.size
        assert np.array_equal(found.reshape(plain.shape), plain) and found.dtype == np.int16
        if given is not None:
            assert (found is given) == taken, type(matcher)
            assert taken or (given == 5).all()
    ours, theirs = (matcher.compute(left[:, :, None], right[:, :, None]) for matcher in both())
    assert ours.shape == theirs.shape == left.shape


@pytest.mark.parametrize("width", [11, 12, 20, 31, 32, 33, 40, 41, 42, 43, 60])
@pytest.mark.parametrize("smallest", [0, 7])
def test_narrow_images(width, smallest):
    """Where cv2 has a map we have one: of invalid pixels if no block fits."""
    left, right = textured_pair(width, 30, generator(48))
    ours, theirs = both()
    for matcher in (ours, theirs):
        matcher.setMinDisparity(smallest)
    try:
        expected = theirs.compute(left, right)
    except cv2.error:
        assert width <= 11
        return
    region = defined_region(left.shape, MatcherSettings(32, 11, smallest))
    found  = ours.compute(left, right)
    assert np.array_equal(found[region], expected[region])
    if width < 42 + smallest:
        assert (found == (smallest - 1)*16).all()


@pytest.mark.parametrize("shape", [(10, 100), (40, 10), (4, 4)])
def test_images_smaller_than_a_block(shape):
    image = np.zeros(shape, np.uint8)
    for matcher, error in zip(both(), (ImageError, cv2.error), strict=True):
        with pytest.raises(error):
            matcher.compute(image, image)


@pytest.mark.parametrize(("setter", "values"), [("setDisp12MaxDiff", (-7, 0, 15, 16, 254, 255, 300, 1 << 30)),
                                                ("setTextureThreshold", (0, 7623, 7624, 1 << 20, 1 << 30))])
def test_limits_that_are_larger_than_what_they_limit(setter, values):
    left, right = textured_pair(100, 40, generator(49))
    for value in values:
        maps = []
        for matcher in both(16, 11):
            getattr(matcher, setter)(value)
            maps.append(matcher.compute(left, right))
        assert np.array_equal(*maps), value


@pytest.mark.parametrize("ending", [".yml", ".yaml", ".xml", ".json"])
def test_settings_in_files(ending, tmp_path):
    """What one writes the other reads; the text of cv2 5 is the same."""
    rng   = generator(50)
    names = [name[3:] for name in dir(cv2.StereoBM) if name.startswith("set") and "ROI" not in name
             and "Smaller" not in name]
    assert len(names) == 11
    for _ in range(5):
        values  = {name: int(rng.integers(-5, 1000)) for name in names}
        writers = both()
        for writer in writers:
            for name, value in values.items():
                getattr(writer, f"set{name}")(value)
            path = tmp_path/f"{type(writer).__module__}{ending}"
            writer.save(str(path))
            ours, theirs = both()
            ours.load(path)
            storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
            theirs.read(storage.getFirstTopLevelNode())
            for name, value in values.items():
                assert getattr(ours, f"get{name}")() == getattr(theirs, f"get{name}")() == value, (path, name)
            again = StereoBM.create(device="model:")
            again.read(storage.getFirstTopLevelNode())
            assert again._values == values
        texts = [path.read_text() for path in sorted(tmp_path.iterdir())]
        assert len(texts) == 2
        if cv2.__version__ == "5.0.0":
            assert texts[0].split() == texts[1].split()
    # Into a storage of the caller.
    storage = cv2.FileStorage(str(tmp_path/f"own{ending}"), cv2.FILE_STORAGE_WRITE)
    writers[0].write(storage, "mine")
    storage.release()
    theirs  = cv2.StereoBM_create()
    storage = cv2.FileStorage(str(tmp_path/f"own{ending}"), cv2.FILE_STORAGE_READ)
    theirs.read(storage.getNode("mine"))
    assert theirs.getBlockSize() == values["BlockSize"]


def test_files_that_are_no_settings(tmp_path):
    matcher = StereoBM_create(device="model:")
    matcher.save(tmp_path/"good.yml")
    good = (tmp_path/"good.yml").read_text()
    with pytest.raises(ImageError, match="no such file"):
        matcher.load(tmp_path/"none.yml")
    with pytest.raises(ImageError, match="ending must be"):
        matcher.save(tmp_path/"x.txt")
    with pytest.raises(ImageError, match="cannot be written"):
        matcher.save(tmp_path/"good.yml"/"x.yml")
    matcher.setBlockSize(5)
    for text in ("", "words", "%YAML:1.0\n---\na: 1\n", good.replace("StereoMatcher.BM", "StereoMatcher.SGBM"),
                 good.replace("   uniquenessRatio: 15\n", ""), good.replace("blockSize: 21", "blockSize: 2.5")):
        (tmp_path/"bad.yml").write_text(text)
        with pytest.raises(SettingsError):
            matcher.load(tmp_path/"bad.yml")
        assert matcher.getBlockSize() == 5


@pytest.mark.parametrize("create", [StereoBM, StereoBM_create, StereoBM.create])
def test_the_device_if_none_is_given(create, monkeypatch):
    """The environment's, else the model: never a simulation that takes minutes to build."""
    image = np.zeros((40, 120), np.uint8)
    monkeypatch.setenv("LITESTEREO_DEVICE", "tcp://127.0.0.1:1")
    with pytest.raises(LiteStereoError, match="127.0.0.1"):
        create().compute(image, image)
    monkeypatch.delenv("LITESTEREO_DEVICE")
    with create() as matcher:
        assert matcher.compute(image, image).shape == (40, 120)
        assert matcher._device.info().url == "model:"


@pytest.mark.parametrize(("setter", "value", "stage"), [("setTextureThreshold", 10, Feature.TEXTURE),
                                                        ("setUniquenessRatio", 15, Feature.UNIQUENESS)])
def test_stages_that_the_device_lacks(setter, value, stage):
    """By default they are off, with a warning; asked for they are refused."""
    left, right = textured_pair(120, 40, generator(51))
    matcher     = StereoBM_create(32, 11, device=device_without(stage))
    with pytest.warns(RuntimeWarning, match=DESCRIPTIONS[stage]):
        found = matcher.compute(left, right)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert np.array_equal(matcher.compute(left, right), found)
    other = StereoBM_create(32, 11, device="model:")
    getattr(other, setter)(0)
    assert np.array_equal(other.compute(left, right), found)
    getattr(matcher, setter)(value)
    with pytest.raises(UnsupportedError, match=DESCRIPTIONS[stage]):
        matcher.compute(left, right)
    # Without the prefilter there is no texture test: it was asked for, too.
    bare = StereoBM_create(32, 11, device=device_without(Feature.XSOBEL))
    with pytest.warns(RuntimeWarning, match="prefilter is off|texture test is off"):
        bare.compute(left, right)
    bare.setTextureThreshold(10)
    with pytest.raises(UnsupportedError):
        bare.compute(left, right)
    assert ALL_STAGES & stage


def test_the_list_of_differences():
    """docs/theory.md has every setting of cv2.StereoBM that is refused here."""
    text    = (Path(__file__).parents[3]/"docs"/"theory.md").read_text()
    section = text.split("## Differences from cv2.StereoBM")[1].split("\n## ")[0]
    image   = np.zeros((60, 400), np.uint8)
    drawn   = {"MinDisparity": (-1, 0, 255, 256), "NumDisparities": (16, 256, 272), "BlockSize": (5, 51, 53),
               "SpeckleWindowSize": (-1, 0), "SpeckleRange": (-1, 0), "Disp12MaxDiff": (-2, 254, 255, 1000),
               "PreFilterType": (0, 1), "PreFilterSize": (5, 255), "PreFilterCap": (1, 63),
               "TextureThreshold": (0, 1 << 24), "UniquenessRatio": (0, 100, 101)}
    for name, values in drawn.items():
        for value in values:
            ours, theirs = both(16, 9)
            for matcher in (ours, theirs):
                getattr(matcher, f"set{name}")(value)
            theirs.compute(image, image)
            try:
                ours.compute(image, image)
            except LiteStereoError:
                first = name[0].lower() + name[1:]
                assert re.search(rf"^\| `{first}`", section, re.MULTILINE), (name, value)
    assert "| `setROI1`" in section and "minDisparity" in section
