#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The calibration of a device, and frames that it rectifies: the firmware compiled for this computer, on both links."""

from __future__ import annotations

import dataclasses
import zlib

import numpy as np
import pytest

from litestereo.host_tools.cameras.record import CalibrationRecord
from litestereo.host_tools.cameras.rectify import Rectifier
from litestereo.host_tools.core.errors import DeviceError, DeviceRefused, GeometryError, UnsupportedError
from litestereo.host_tools.core.grid import Grid, grid_crc
from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.host_tools.devices.calibrating import ask_calibration
from litestereo.host_tools.devices.connect import connect
from litestereo.host_tools.protocol.payloads import CalibrationState
from support.expected import expected_map
from support.native_device import native_device, native_ports, native_udp_device
from support.pairs import byte_generator, generator, textured_pair
from support.rectification_maps import maps_of, opencv_remap, shifted
from support.rigs import lens_cameras
from support.udp_faults import Faults
from support.udp_proxy import udp_proxied

WIDTH, HEIGHT = 112, 90
SETTINGS      = MatcherSettings(16, 9)


def record_of(number):
    return CalibrationRecord.of(Rectifier(*lens_cameras(generator(number), 44, 1, WIDTH, HEIGHT)))


def urls(ports):
    return [f"tcp://127.0.0.1:{ports[0]}", f"udp://127.0.0.1:{ports[1]}"]


def check(device, grids, images=("left", "right"), count=3):
    """Match pairs by the grids, and compare maps and images with those of cv2.remap and the model."""
    maps  = maps_of([grid.nodes for grid in grids], WIDTH, HEIGHT)
    pairs = [textured_pair(WIDTH, HEIGHT, generator(390 + shift), shift) for shift in range(count)]
    for pair, result in zip(pairs, device.stream(pairs, SETTINGS, grids=grids, images=images), strict=True):
        left, right = (opencv_remap(*one) for one in zip(pair, maps, strict=True))
        assert np.array_equal(result.disparity, expected_map(left, right, SETTINGS))
        for name, found, image in (("left", result.left, left), ("right", result.right, right)):
            assert np.array_equal(found, image) if name in images else found is None


@pytest.mark.parametrize("link", [0, 1], ids=["tcp", "udp"])
def test_written_read_and_erased(link):
    """A calibration outlives a restart, another one replaces it, and an erased one does not come back."""
    first, second = record_of(380), record_of(381)
    steps         = []
    with native_ports("--flash", "--rectification", "64") as ports:
        url = urls(ports)[link]
        with connect(url) as device:
            assert device.calibration() is None
            device.erase_calibration()
            device.write_calibration(first.encode(), progress=lambda *step: steps.append(step))
            assert device.calibration() == first.encode()
            chunks = -(-first.length//1024)
            assert steps == [("upload", done, chunks) for done in range(chunks + 1)] + [
                ("write", 0, 1), ("write", 1, 1)]
        restart(ports)
        with connect(url) as device:
            assert device.calibration() == first.encode()
            check(device, first.grids)
            device.write_calibration(second.encode())
            check(device, second.grids)
            assert "another grid" in device.rectification_gap(first.grids)
            with pytest.raises(UnsupportedError, match=f"cannot rectify the pair: .*{grid_crc(second.grids):08x}"):
                device.compute(*textured_pair(WIDTH, HEIGHT, generator(1), 3), SETTINGS, grids=first.grids)
        restart(ports)
        with connect(url) as device:
            assert device.calibration() == second.encode()
            device.erase_calibration()
            assert "has no calibration" in device.rectification_gap(second.grids)
        restart(ports)
        with connect(url) as device:
            assert device.calibration() is None


def restart(ports):
    """Restart the device by its console."""
    with connect(urls(ports)[0]) as device:
        device.console("reset")


@pytest.mark.parametrize("images", [(), ("left",), ("right",), ("left", "right")], ids=str)
@pytest.mark.parametrize("mode", ["tcp", "stored", "streamed"])
def test_images(mode, images):
    """Stored and streamed frames are rectified, and their images come if they are asked for; raw ones alternate."""
    record = record_of(382)
    with native_ports("--rectification", "64") as ports:
        tcp, udp = urls(ports)
        with connect(tcp if mode == "tcp" else f"{udp}?mode={mode}") as device:
            device.write_calibration(record.encode(), keep=False)
            check(device, record.grids, images)
            raw    = textured_pair(WIDTH, HEIGHT, generator(383), 5)
            result = device.compute(*raw, SETTINGS, images=images)
            assert np.array_equal(result.disparity, expected_map(*raw, SETTINGS))
            assert np.array_equal(result.left, raw[0]) if "left" in images else result.left is None
            assert np.array_equal(result.right, raw[1]) if "right" in images else result.right is None
            check(device, record.grids, images)


def test_kept_after_all():
    """A calibration that is in use may be sent again to be kept; one that is kept is not sent again."""
    record = record_of(384)
    with native_ports("--flash", "--rectification", "64") as ports, connect(urls(ports)[1]) as device:
        device.write_calibration(record.encode(), keep=False)
        assert not ask_calibration(device._link).kept
        device.write_calibration(record.encode())
        assert ask_calibration(device._link).kept
        steps = []
        device.write_calibration(record.encode(), progress=lambda *step: steps.append(step))
        assert "upload" not in [phase for phase, *_ in steps]
        assert ask_calibration(device._link).state == CalibrationState.DONE


def test_too_many_rows():
    """Both numbers are told, and the calibration before stays in use."""
    record = record_of(385)
    level  = Grid(WIDTH, HEIGHT, shifted(WIDTH, HEIGHT, 0, 0))
    apart  = dataclasses.replace(record, grids=(level, Grid(WIDTH, HEIGHT, shifted(WIDTH, HEIGHT, 0, 40))))
    with native_device("--flash", "--rectification", "32") as port, connect(f"tcp://127.0.0.1:{port}") as device:
        device.write_calibration(record.encode())
        with pytest.raises(DeviceRefused, match=r"needs 4[46] rows of the images at once, the device keeps 32"):
            device.write_calibration(apart.encode())
        assert device.calibration() == record.encode()
        check(device, record.grids)


def test_no_flash():
    """A device without a flash refuses to keep a calibration; it may use it."""
    record = record_of(386)
    with native_device("--rectification", "64") as port, connect(f"tcp://127.0.0.1:{port}") as device:
        with pytest.raises(DeviceRefused, match="ADOPT: it has no flash for a calibration"):
            device.write_calibration(record.encode())
        device.write_calibration(record.encode(), keep=False)
        check(device, record.grids)


def test_a_flash_that_keeps_nothing():
    record = record_of(386)
    with native_device("--flash-protected", "--rectification", "64") as port, \
            connect(f"tcp://127.0.0.1:{port}") as device:
        with pytest.raises(DeviceRefused, match="its flash does not keep it; it is in use until the next reset"):
            device.write_calibration(record.encode())
        check(device, record.grids)


def test_rows_that_are_gone():
    """A frame that was not rectified as it should is an error, not a map."""
    record = record_of(387)
    with native_device("--rectification", "64", "--rows-gone") as port, \
            connect(f"tcp://127.0.0.1:{port}") as device:
        device.write_calibration(record.encode(), keep=False)
        with pytest.raises(DeviceRefused, match="could not rectify frame 1: a row of the images was gone"):
            check(device, record.grids)
        raw = textured_pair(WIDTH, HEIGHT, generator(383), 5)
        assert np.array_equal(device.compute(*raw, SETTINGS).disparity, expected_map(*raw, SETTINGS))


def ended(data):
    """Return bytes with their CRC, as a record ends."""
    return data + zlib.crc32(data).to_bytes(4, "little")


def test_mistakes():
    """No record, a damaged one, one of another size, and a device that does not rectify."""
    record  = record_of(388)
    data    = bytearray(record.encode())
    data[5] ^= 1
    with native_device("--rectification", "64") as port, connect(f"tcp://127.0.0.1:{port}") as device:
        for wrong in (b"", b"LSCA", bytes(data)):
            with pytest.raises(GeometryError, match="does not end with its CRC: it is damaged"):
                device.write_calibration(wrong, keep=False)
        with pytest.raises(DeviceRefused, match="no calibration record that its firmware knows"):
            device.write_calibration(ended(b"\0"*100), keep=False)
        with pytest.raises(GeometryError, match="has 20228 bytes, the device has room for 20224"):
            device.write_calibration(ended(b"\0"*20224), keep=False)
        device.write_calibration(record.encode(), keep=False)
        wide = tuple(Grid(WIDTH + 1, HEIGHT, shifted(WIDTH + 1, HEIGHT, 0, 0)) for _ in range(2))
        assert "is for images of 112x90 pixels" in device.rectification_gap(wide)
    with native_device() as port, connect(f"tcp://127.0.0.1:{port}") as device:
        assert device.rectification_gap(record.grids) == "the device does not rectify"
        for call in (device.calibration, device.erase_calibration, lambda: device.write_calibration(b"")):
            with pytest.raises(UnsupportedError, match="was built without rectification: it keeps no calibration"):
                call()
    with connect("model:") as device:
        for call in (device.calibration, device.erase_calibration, lambda: device.write_calibration(b"")):
            with pytest.raises(UnsupportedError, match="reference model keeps no calibration"):
                call()


def test_bad_network():
    """With loss, duplicates, disorder and flipped bits both ways the calibration arrives, and so do all images."""
    record = record_of(389)
    ways   = [Faults(0.05, 0.05, 0.1, 0.01, rng=byte_generator(389, way)) for way in (0, 1)]
    with native_udp_device("--flash", "--rectification", "64") as port, \
            udp_proxied(port, *ways) as network, connect(network.url) as device:
        for number in range(3):
            device.streamed = number % 2 == 1
            device.write_calibration(record.encode())
            assert device.calibration() == record.encode()
            check(device, record.grids, count=6)
            device.erase_calibration()
    assert min(ways[0].lost, ways[1].lost) > 0


def test_closed():
    with native_device("--rectification", "64") as port:
        device = connect(f"tcp://127.0.0.1:{port}")
        device.close()
        with pytest.raises(DeviceError, match="closed"):
            device.calibration()
