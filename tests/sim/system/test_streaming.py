#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Streamed frames through SoC, firmware and host tools in litex_sim: images are not stored, no map is lost."""

from __future__ import annotations

import numpy as np
import pytest

from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.host_tools.devices.connect import connect
from litestereo.host_tools.protocol.messages import CHUNK_BYTES
from litestereo.sim.system.simulation import start_simulation
from support.assert_stream import check_small_frame
from support.expected import expected_map
from support.pairs import byte_generator, generator, textured_pair
from support.settings import SettingDraws
from support.terminal import counters
from support.udp_faults import Faults
from support.udp_proxy import udp_proxied

pytestmark = pytest.mark.system

SETTINGS = MatcherSettings(32, 7)


@pytest.fixture(scope="module")
def device():
    """Return a running system on integrated RAM."""
    with start_simulation() as simulation:
        yield simulation


@pytest.fixture
def url(device):
    return f"udp://127.0.0.1:{device.udp_port}"


def check(host, pairs, settings):
    """Match pairs, and compare each map with the model's."""
    for pair, result in zip(pairs, host.stream(pairs, settings), strict=True):
        assert np.array_equal(result.disparity, expected_map(*pair, settings))


def growth(device, before):
    return {name: value - before[name] for name, value in counters(device.port).items()}


@pytest.mark.long
def test_frames_of_all_sizes_and_settings(device, url):
    """Without loss, nothing is sent twice, and only parts that found no room are read."""
    rng    = generator(80)
    draws  = SettingDraws(rng, block_size=15)
    before = counters(device.port)
    chunks = 0
    with connect(f"{url}?mode=streamed") as host:
        for width, height, disparities, block_size in [(20, 5, 16, 5), (81, 15, 64, 15), (33, 11, 16, 9),
                                                       (640, 480, 64, 9)]:
            pairs   = [textured_pair(width, height, rng, shift) for shift in (3, 9)]
            chunks += 2*-(-2*width*height // CHUNK_BYTES)
            check(host, pairs, MatcherSettings(disparities, block_size))
        for _ in range(12):
            settings      = draws.settings()
            width, height = (least + more for least, more in zip(settings.minimum_size, (9, 4), strict=True))
            chunks       += -(-2*width*height // CHUNK_BYTES)
            check(host, [textured_pair(width, height, rng, 5)], settings)
        sent = host.link_counters
    change = growth(device, before)
    assert sent.chunks_sent == change["chunks_received"] == chunks
    assert sent.chunks_sent_again == change["chunks_repeated"] == change["uploads_unfit"] == 0
    assert change["datagrams_overrun"] == change["frames_failed"] == 0
    assert change["frames_matched"] == change["frames_released"] == 2*4 + 12
    draws.check()


def test_streamed_and_stored_frames_alternate(device, url):
    """The matcher alternates between stream and memory, and the two kinds of frames do not mix."""
    rng = generator(81)
    with connect(url) as host:
        for number in range(6):
            host.streamed = number % 2 == 0
            check(host, [textured_pair(120, 40, rng, shift) for shift in (3, 9, 15)], SETTINGS)


@pytest.mark.long
def test_bad_network(device, url):
    """With loss, duplicates, disorder and flipped bits both ways, what follows a loss is sent once more."""
    rng    = generator(82)
    pairs  = [textured_pair(64 + 8*(index % 5), 20 + index, rng, 3 + index) for index in range(20)]
    ways   = [Faults(0.05, 0.05, 0.1, 0.01, rng=byte_generator(83, way)) for way in (0, 1)]
    before = counters(device.port)
    with udp_proxied(device.udp_port, *ways) as network, connect(f"{network.url}?mode=streamed") as host:
        check(host, pairs, SETTINGS)
        assert host.link_counters.chunks_sent_again > 0 and host.link_counters.parts_asked_again > 0
    for way in ways:
        assert min(way.lost, way.duplicated, way.reordered, way.flipped) > 0
    assert growth(device, before)["frames_failed"] == 0
    check_small_frame(url)


@pytest.mark.long
def test_stream_dropped_half_way(device, url):
    """All frames in flight are aborted, also the one being matched; the next ones are correct."""
    rng   = generator(84)
    pairs = [textured_pair(320, 200, rng, shift) for shift in (3, 9, 15)]
    with connect(f"{url}?mode=streamed") as host:
        for _ in range(3):
            results = host.stream(pairs, SETTINGS)
            assert np.array_equal(next(results).disparity, expected_map(*pairs[0], SETTINGS))
            results.close()
        check(host, pairs, SETTINGS)
    check_small_frame(url)
