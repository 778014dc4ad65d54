#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Updates of the firmware compiled for this computer, in front of a flash in software: over both links, with loss, and
what is refused."""

import contextlib
import itertools
import json
import random
import types

import numpy as np
import pytest

from litestereo.host_tools.core.errors import DeviceError, DeviceRefused, FirmwareError, LinkTimeout, UnsupportedError
from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.host_tools.devices import updating
from litestereo.host_tools.devices.connect import connect
from litestereo.host_tools.devices.firmware_image import read_firmware
from litestereo.host_tools.link.settings import LinkSettings
from litestereo.host_tools.protocol import payloads
from litestereo.host_tools.protocol.messages import ErrorCode, MessageType
from litestereo.host_tools.protocol.payloads import Trial, UpdateProgress, UpdateState
from support.command import error_line, run
from support.expected import expected_map
from support.fault_proxy import Faults, proxied
from support.firmware import image, with_header
from support.native_device import native_device, native_ports, native_udp_device
from support.pairs import generator, textured_pair
from support.udp_faults import Faults as UdpFaults
from support.udp_proxy import udp_proxied


@contextlib.contextmanager
def native_url(link, *options):
    """URL of a native device by one of its links."""
    with native_ports("--flash", *options) as (tcp, udp):
        yield f"tcp://127.0.0.1:{tcp}" if link == "tcp" else f"udp://127.0.0.1:{udp}"


@pytest.mark.parametrize("link", ["tcp", "udp"])
@pytest.mark.parametrize("length", [32, 1024, 1025, 50000, 256*1024 - 8])
def test_update(link, length):
    """The device comes back with the new version and works as before; the next host finds it too."""
    steps = []
    with native_url(link) as url:
        with connect(url) as device:
            assert device.info().firmware_version == "0.1"
            info = device.update_firmware(image(length), progress=lambda *step: steps.append(step))
            assert info.firmware_version == device.info().firmware_version == "1.2"
            assert device.statistics()["sessions"] == 1
            left, right = textured_pair(120, 50, generator(1))
            settings    = MatcherSettings(disparities=16, block_size=5)
            assert np.array_equal(device.compute(left, right, settings).disparity, expected_map(left, right, settings))
        with connect(url) as device:
            assert device.info().firmware_version == "1.2"
    chunks = -(-length // 1024)
    assert [step for step in steps if step[0] == "upload"][-1] == ("upload", chunks, chunks)
    assert steps[-1] == ("write", 3*(length + 8), 3*(length + 8))


def test_no_restart():
    """The device continues as it is; the same firmware again is no work, and a restart starts it."""
    with native_url("udp") as url, connect(url) as device:
        for _ in range(2):
            assert device.update_firmware(image(), restart=False).firmware_version == "0.1"
        assert device.update_firmware(image()).firmware_version == "1.2"
        assert device.update_firmware(image(version=0x0203)).firmware_version == "2.3"


@pytest.mark.parametrize("link", ["tcp", "udp"])
def test_a_firmware_is_tried(link):
    """The session confirms it; until then it is on trial."""
    with native_url(link) as url:
        with connect(url) as device:
            assert device.trial() == Trial.UNKNOWN
            device.update_firmware(image(), restart=False)
            assert device.trial() == Trial.RUNNING
            # A second firmware replaces the one that waits.
            device.update_firmware(image(version=0x0203), restart=False)
            assert device.update_firmware(image(version=0x0304)).firmware_version == "3.4"
            assert device.trial() == Trial.CONFIRMED
        with connect(url) as device:
            assert device.info().firmware_version == "3.4"
            assert "newest firmware: confirmed" in device.console("info") if link == "tcp" else True
            device.update_firmware(image(confirms=False), restart=False)
            assert device.trial() == Trial.CONFIRMED


@pytest.mark.parametrize("link", ["tcp", "udp"])
def test_a_firmware_that_fails(link, tmp_path, capfd):
    """The old one is back, also after another restart, and takes another update."""
    path = tmp_path / "firmware.bin"
    path.write_bytes(image())
    with native_url(link, "--bad-updates") as url:
        for _ in range(2):
            assert run("update", path, "--device", url) == 1
            line = error_line(capfd)
            assert "firmware 1.2 did not work" in line and "runs firmware 0.1 again" in line
        with connect(url) as device:
            with pytest.raises(DeviceError, match="did not work"):
                device.update_firmware(image(version=0x0203))
            assert device.info().firmware_version == "0.1"
            assert device.trial() == Trial.FELL_BACK
            # One that is not tried is started in any case.
            assert device.update_firmware(image(confirms=False)).firmware_version == "1.2"


def test_a_settings_change_survives_the_restart():
    """The device has forgotten its settings, and gets them again."""
    left, right = textured_pair(120, 50, generator(2))
    settings    = MatcherSettings(disparities=32, block_size=11)
    for link in ("tcp", "udp"):
        with native_url(link) as url, connect(url) as device:
            for _ in range(2):
                result = device.compute(left, right, settings)
                assert np.array_equal(result.disparity, expected_map(left, right, settings))
                device.update_firmware(image())


def test_a_bad_line():
    """Bytes get lost, changed and repeated."""
    faults = [Faults(1e-4, rng=random.Random(seed)) for seed in (3, 4)]
    with native_device("--flash") as port, proxied(port, *faults) as line, \
            connect(line.url, LinkSettings(timeout_floor_s=0.1)) as device:
        assert device.update_firmware(image(50000)).firmware_version == "1.2"
        assert device.link_counters.retransmissions > 0


def test_a_bad_network():
    """Datagrams get lost, doubled, changed, and change places."""
    faults = [UdpFaults(0.05, 0.05, 0.05, 0.05, rng=random.Random(seed)) for seed in (5, 6)]
    with native_udp_device("--flash") as port, udp_proxied(port, *faults) as network, \
            connect(network.url) as device:
        assert device.update_firmware(image(50000)).firmware_version == "1.2"
        assert device.link_counters.retransmissions > 0


def test_an_update_that_another_session_began():
    """It continues without its host; the next host that wants the same finds it in progress."""
    firmware = read_firmware(image(200000))
    with native_url("tcp", "--flash-busy", "20") as url:
        with connect(url) as device:
            link = device._link
            link.call(MessageType.UPDATE, payloads.pack_update(len(firmware.program), firmware.crc))
            link.wait([link.submit(MessageType.IMAGE, firmware.program[at:at + 1024], offset=at)
                       for at in range(0, len(firmware.program), 1024)])
            link.call(MessageType.WRITE)
        with connect(url) as device:
            link     = device._link
            progress = UpdateProgress.unpack(link.call(MessageType.PROGRESS).payload)
            assert progress.state in (UpdateState.CHECKING, UpdateState.WRITING)
            for kind, payload in ((MessageType.RESTART, b""), (MessageType.UPDATE, payloads.pack_update(100, 1))):
                with pytest.raises(DeviceRefused, match="an update is") as refused:
                    link.call(kind, payload)
                assert refused.value.code == ErrorCode.STATE
            # While it writes it matches.
            left, right = textured_pair(120, 50, generator(3))
            settings    = MatcherSettings(disparities=16, block_size=5)
            result      = device.compute(left, right, settings)
            assert np.array_equal(result.disparity, expected_map(left, right, settings))
            assert UpdateProgress.unpack(link.call(MessageType.PROGRESS).payload).state == UpdateState.WRITING
            assert device.update_firmware(image(200000)).firmware_version == "1.2"


class StuckLink:
    """A link to a device whose update goes as scripted, on a clock that only `idle` moves."""
    def __init__(self, replies):
        self.replies = replies
        self.now     = 1000.0

    def call(self, _kind, _payload=b""):
        return types.SimpleNamespace(payload=next(self.replies).pack())

    def idle(self, seconds):
        self.now += seconds


def progress_of(state, done):
    return UpdateProgress(state, 0, done, 1000, 1 << 20)


def written(monkeypatch, steps):
    """Seconds that `write_firmware` waits for a device that is already writing; steps are (polls, state, done)."""
    first   = progress_of(UpdateState.WRITING, 0)
    replies = itertools.chain([first, first], (progress_of(state, done) for polls, state, done in steps
                                               for _ in range(polls)))
    link    = StuckLink(replies)
    monkeypatch.setattr(updating, "time", types.SimpleNamespace(monotonic=lambda: link.now))
    updating.write_firmware(link, read_firmware(image(1000)), None)
    return link.now - 1000


@pytest.mark.parametrize("state", [UpdateState.CHECKING, UpdateState.WRITING])
@pytest.mark.parametrize("done", [0, 999, 1000])
def test_no_progress(monkeypatch, state, done):
    """A stuck device is reported after ten minutes, by one line: in any state, before and after the last byte."""
    with pytest.raises(LinkTimeout, match="^the device has made no progress with the firmware for 600 s: restart it, "
                                          "and try again$"):
        written(monkeypatch, [(1 << 20, state, done)])


def test_slow_progress(monkeypatch):
    """Less than ten minutes from each step to the next: of the bytes, or of the state alone."""
    polls = round(0.99*updating._STUCK_LIMIT_S/updating._POLL_S)
    steps = [(polls, UpdateState.WRITING, 0), (polls, UpdateState.CHECKING, 0), (polls, UpdateState.WRITING, 0),
             *((polls, UpdateState.WRITING, done) for done in range(1, 6)), (1, UpdateState.DONE, 1000)]
    assert written(monkeypatch, steps) > 8*0.98*updating._STUCK_LIMIT_S


def test_a_protected_flash():
    with native_ports("--flash-protected") as (port, _), connect(f"tcp://127.0.0.1:{port}") as device:
        for _ in range(2):
            with pytest.raises(DeviceError, match="write-protected"):
                device.update_firmware(image())
    with native_ports("--flash-protected") as (_, port), connect(f"udp://127.0.0.1:{port}") as device, \
            pytest.raises(DeviceError, match="write-protected"):
        device.update_firmware(image())


def test_another_gateware():
    """What only the device knows is refused by it, before its flash is touched."""
    with native_url("udp") as url:
        with connect(url) as device, pytest.raises(DeviceError, match="another bitstream"):
            device.update_firmware(image(soc=1))
        with connect(url) as device:
            assert device.update_firmware(image()).firmware_version == "1.2"


@pytest.mark.parametrize("running", [native_device, native_udp_device])
def test_no_flash(running):
    scheme = "tcp" if running is native_device else "udp"
    with running() as port, connect(f"{scheme}://127.0.0.1:{port}") as device:
        with pytest.raises(UnsupportedError, match="has no flash"):
            device.update_firmware(image())
        with pytest.raises(DeviceRefused, match="no flash") as refused:
            device._link.call(MessageType.PROGRESS)
        assert refused.value.code == ErrorCode.TYPE


def test_a_matcher_without_firmware():
    with connect("model:") as device, pytest.raises(UnsupportedError, match="no firmware"):
        device.update_firmware(image())


GOOD = image()


@pytest.mark.parametrize(("data", "message"), [
    (b"", "has 0 bytes, too few"),
    (GOOD[:39], "too few"),
    (GOOD[:-1], "not all of one: its header announces 5000 bytes, 4999 follow"),
    (GOOD + b"\0", "not all of one"),
    (GOOD[8:], "is no firmware image"),
    (GOOD[:100] + b"?" + GOOD[101:], "is damaged"),
    (with_header(bytes(5000)), "does not say what device it is for"),
    (image(name="ulx3s"), "is firmware for ulx3s, the device is LiteStereo"),
    (image(256*1024 - 7), "the program has 262137 bytes, the device's flash has room for 262136"),
])
def test_files_that_are_refused(data, message, tmp_path, capfd):
    """One line each, and the device is as it was."""
    path = tmp_path / "firmware.bin"
    path.write_bytes(data)
    with native_url("udp") as url:
        assert run("update", path, "--device", url) == 1
        line = error_line(capfd)
        assert message in line and str(path) in line
        with connect(url) as device:
            assert device.info().firmware_version == "0.1"
            with pytest.raises(FirmwareError, match="the firmware: "):
                device.update_firmware(data)


def test_a_file_that_is_not_there(tmp_path, capfd):
    assert run("update", tmp_path / "none.bin", "--device", "model:") == 1
    assert "cannot be read: No such file" in error_line(capfd)


@pytest.mark.parametrize("link", ["tcp", "udp"])
def test_command(link, tmp_path, capfd):
    path = tmp_path / "firmware.bin"
    path.write_bytes(image())
    with native_url(link) as url:
        assert run("update", path, "--device", url, "--no-restart") == 0
        assert capfd.readouterr() == ("LiteStereo: firmware 0.1 -> 1.2, which is tried at its next restart\n", "")
        assert run("update", path, "--device", url) == 0
        assert capfd.readouterr() == ("LiteStereo: firmware 0.1 -> 1.2, confirmed\n", "")
        path.write_bytes(image(version=3))
        assert run("update", path, "--device", url, "--json") == 0
        printed = json.loads(capfd.readouterr().out)
        assert printed == {"device": "LiteStereo", "url": url, "before": "1.2", "after": "0.3", "bytes": 5000,
                           "restarted": True, "trial": "confirmed"}
        assert run("info", "--device", url) == 0
        out = capfd.readouterr().out
        assert "firmware 0.3" in out and "update" in out
