#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Matcher, host or device fails in mid-frame: the others notice and continue, over each link."""

import contextlib
import time

import pytest

from litestereo.host_tools.core.errors import DeviceError, DeviceRefused, SessionLost
from litestereo.host_tools.devices.connect import connect
from litestereo.host_tools.link.settings import LinkSettings
from litestereo.host_tools.protocol.messages import ErrorCode
from support.expected import SETTINGS, expect
from support.native_device import native_device, native_udp_device
from support.pairs import generator, textured_pair
from support.udp_faults import Faults
from support.udp_proxy import udp_proxied

#: What is added to a URL of Ethernet.
MODES = ("?mode=stored", "?mode=streamed")


def check_match(device, progress=None):
    """Match a pair that takes long to send, and compare the map with the model's."""
    pair = textured_pair(320, 200, generator(93), 12)
    expect(device.compute(*pair, SETTINGS, progress), pair)


@contextlib.contextmanager
def native_url(link, option):
    """Run a device with `option`, and give its URL on the link."""
    if link == "serial":
        with native_device(option) as port:
            yield f"tcp://127.0.0.1:{port}"
    else:
        with native_udp_device(option) as port:
            yield f"udp://127.0.0.1:{port}{link}"


@pytest.mark.parametrize("link", ["serial", *MODES])
@pytest.mark.parametrize(("option", "code"), [
    ("--bus-error", ErrorCode.MATCHER),
    ("--hang-matcher", ErrorCode.TIMEOUT),
])
def test_a_matcher_that_fails_is_reported_and_the_session_goes_on(link, option, code):
    pair = textured_pair(110, 60, generator(94), 3)
    with native_url(link, option) as url, connect(url) as device:
        for _ in range(6):
            with pytest.raises(DeviceRefused, match="could not match") as caught:
                device.compute(*pair, SETTINGS)
            assert caught.value.code == code
        counted = device.statistics()
    assert (counted["frames_failed"], counted["frames_released"], counted["frames_matched"]) == (6, 6, 0)


@pytest.mark.parametrize("mode", MODES)
def test_a_host_that_vanishes_holds_the_device_for_five_seconds(mode):
    vanished = Faults()

    def progress(phase, done, total):
        if phase == "upload" and done > 20:
            vanished.loss = 1.0

    with native_udp_device() as port, udp_proxied(port, vanished) as network:
        lost = connect(network.url + mode, LinkSettings(silence_limit_s=0.5))
        with pytest.raises(DeviceError, match="has not answered"):
            check_match(lost, progress)
        lost.close()
        begin = time.monotonic()
        with connect(f"udp://127.0.0.1:{port}{mode}") as device:
            assert 2 < time.monotonic() - begin < 8
            check_match(device)
            assert device.statistics()["frames_reclaimed"] == 1


@pytest.mark.parametrize("mode", MODES)
def test_a_device_that_restarts_in_mid_frame(mode):
    """Another device in its place does not know the session."""
    with native_udp_device() as first, native_udp_device() as second, udp_proxied(first) as network:
        def progress(phase, done, total):
            if phase == "upload" and done > 20:
                network.plug_in(second)

        with connect(network.url + mode) as device, pytest.raises(SessionLost, match="connect again"):
            check_match(device, progress)
        with connect(network.url + mode) as device:
            check_match(device)
