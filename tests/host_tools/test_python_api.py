#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The names that programs import, the program in the README, and devices that several threads use."""

import ast
import re
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import cv2
import numpy as np
import pytest

import litestereo.host_tools as api
from litestereo.host_tools.cameras.camera_info import ideal_cameras, write_camera_info
from litestereo.host_tools.cameras.rectify import FILES
from litestereo.host_tools.core import errors
from litestereo.host_tools.core.errors import DeviceError
from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.host_tools.devices import base
from support.expected import expected_map
from support.native_device import native_device, native_udp_device
from support.pairs import generator, textured_pair
from support.paths import CHECKOUT

README   = CHECKOUT / "README.md"
SETTINGS = MatcherSettings(16, 9)


@pytest.fixture(scope="module")
def pairs():
    rng = generator(150)
    return [textured_pair(96, 40, rng, shift) for shift in range(2, 10)]


@pytest.fixture(scope="module")
def maps(pairs):
    return [expected_map(*pair, SETTINGS) for pair in pairs]


@pytest.fixture(params=["model", "serial", "udp"])
def device(request):
    if request.param == "model":
        with api.connect("model:") as opened:
            yield opened
        return
    serve, scheme = {"serial": (native_device, "tcp"), "udp": (native_udp_device, "udp")}[request.param]
    with serve() as port, api.connect(f"{scheme}://127.0.0.1:{port}") as opened:
        yield opened


# Names.

def test_every_name_is_there():
    assert [name for name in api.__all__ if not hasattr(api, name)] == []
    assert sorted(api.__all__) == sorted(api._MODULES) and set(api.__all__) <= set(dir(api))
    assert api.StereoBM_create(32, device="model:").getNumDisparities() == 32
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = api.nothing


def test_every_error_is_there():
    classes = {name for name, value in vars(errors).items() if isinstance(value, type)}
    assert classes <= set(api.__all__)


def test_type_checkers_see_the_same_names():
    tree   = ast.parse(Path(api.__file__).read_text(encoding="utf-8"))
    (only,) = (node for node in tree.body if isinstance(node, ast.If))
    assert {alias.name: node.module for node in only.body for alias in node.names} == api._MODULES


def test_documents_import_public_names_alone():
    """Every import of the host tools in README and documents is from the package itself, of a name in `__all__`."""
    found = [match for path in (README, *sorted((CHECKOUT / "docs").glob("*.md")))
             for match in re.findall(r"from litestereo\.host_tools(\S*) import (.+)", path.read_text(encoding="utf-8"))]
    assert len(found) >= 2
    for module, names in found:
        assert module == "" and {name.strip() for name in names.split(",")} <= set(api.__all__)


def test_importing_the_package_loads_nothing():
    program = "import sys, litestereo.host_tools; print([n for n in ('cv2', 'numpy', 'rich') if n in sys.modules])"
    done    = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_the_host_tools_load_no_gateware():
    """The command, the names of the package and the device `model:` do without LiteX, even where it is installed."""
    program = ("import sys, litestereo.host_tools as api, litestereo.host_tools.cli as cli\n"
               "for name in api.__all__: getattr(api, name)\n"
               "cli._parser()\n"
               "api.connect('model:').close()\n"
               "print(*sorted({name.partition('.')[0] for name in sys.modules}))\n")
    done    = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    loaded  = done.stdout.split()
    assert {"litestereo", "cv2", "numpy"} <= set(loaded)
    assert [name for name in loaded if name.startswith(("litex", "litedram", "liteeth", "migen", "pythondata"))] == []


def test_the_program_in_the_readme(tmp_path):
    """Ten lines that open a device, match a pair and save its depth."""
    section = README.read_text(encoding="utf-8").split("\n## Python\n")[1]
    program = re.search(r"```python\n(.*?)```", section, re.DOTALL)[1]
    assert len([line for line in program.splitlines() if line.strip()]) == 10
    left, right = textured_pair(160, 60, generator(151), 8)
    cv2.imwrite(str(tmp_path/"left.png"), left)
    cv2.imwrite(str(tmp_path/"right.png"), right)
    geometry = api.StereoGeometry(160, 60, 200.0, 0.1, 80.0, 30.0, 80.0)
    for name, camera in zip(FILES, ideal_cameras(geometry), strict=True):
        write_camera_info(tmp_path/"calibration"/name, camera)
    subprocess.run([sys.executable, "-c", program], cwd=tmp_path, check=True, capture_output=True)
    depth = np.load(tmp_path/"depth.npy")
    assert depth.shape == (60, 160) and depth.dtype == np.float32
    assert np.nanmedian(depth) == pytest.approx(200*0.1/8, rel=0.01) and np.isfinite(depth).mean() > 0.3


# Threads.

def test_threads_share_a_device(device, pairs, maps):
    """Four threads, single pairs and streams at once: each gets its own maps."""
    def single(number):
        return [(number, device.compute(*pairs[number], SETTINGS).disparity)]

    def streamed(first):
        chosen = range(first, first + 3)
        return list(zip(chosen, (result.disparity for result in device.stream([pairs[n] for n in chosen], SETTINGS)),
                        strict=True))

    with ThreadPoolExecutor(4) as pool:
        futures = [pool.submit(call, number % 6) for number in range(12) for call in (single, streamed)]
        futures += [pool.submit(device.statistics)]
        results = [future.result(timeout=60) for future in futures]
    assert "frames_matched" in results.pop()
    for number, map_ in (item for result in results for item in result):
        assert np.array_equal(map_, maps[number])


def test_a_stream_keeps_others_waiting_until_its_end(device, pairs, maps):
    stream  = device.stream(pairs[:3], SETTINGS)
    first   = next(stream).disparity
    others  = []
    waiting = threading.Thread(target=lambda: others.append(device.compute(*pairs[5], SETTINGS).disparity))
    waiting.start()
    waiting.join(0.2)
    assert waiting.is_alive() and not others
    # With its last result the stream lets go: from then on the other thread may be the first to note its map.
    streamed = [first, *(result.disparity for result in stream)]
    waiting.join(20)
    assert all(np.array_equal(map_, maps[n]) for map_, n in zip([*streamed, *others], [0, 1, 2, 5], strict=True))


def test_waiting_for_a_thread_that_does_not_let_go(device, pairs, monkeypatch):
    monkeypatch.setattr(base, "LOCK_LIMIT_S", 0.1)
    stream = device.stream(pairs, SETTINGS)
    next(stream)
    with ThreadPoolExecutor(1) as pool:
        waiting = pool.submit(device.compute, *pairs[0], SETTINGS)
        with pytest.raises(DeviceError, match="another thread has used the device for 0.1 s"):
            waiting.result(timeout=20)
        stream.close()
        assert pool.submit(device.compute, *pairs[0], SETTINGS).result(timeout=20).settings == SETTINGS


def test_an_error_releases_the_lock(device, pairs, maps):
    small = np.zeros((3, 3), np.uint8)
    with ThreadPoolExecutor(1) as pool:
        assert isinstance(pool.submit(device.compute, small, small, SETTINGS).exception(timeout=20),
                          api.LiteStereoError)
    assert np.array_equal(device.compute(*pairs[1], SETTINGS).disparity, maps[1])
