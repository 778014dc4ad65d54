#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The host tools against the real firmware over UDP: it runs on this computer, with gateware in C."""

import numpy as np
import pytest

from litestereo.host_tools.device import connect
from litestereo.host_tools.settings import MatcherSettings
from support.expected import expected_map
from support.native_device import native_udp_device
from support.pairs import generator, textured_pair

SETTINGS = MatcherSettings(32, 7)


def pairs(count, width=110, height=60, salt=70):
    rng = generator(salt)
    return [textured_pair(width, height, rng, shift) for shift in range(3, 3 + count)]


def chunk_count(width, height):
    return 2*-(-width*height//1024)


def expect(result, pair, settings=SETTINGS):
    assert np.array_equal(result.disparity, expected_map(*pair, settings))


@pytest.fixture(scope="module")
def shared_url():
    """A device for tests that leave it as it was."""
    with native_udp_device() as port:
        yield f"udp://127.0.0.1:{port}"


@pytest.mark.parametrize(("width", "height"), [(38, 7), (64, 16), (65, 33), (200, 101), (1024, 9), (640, 480)])
def test_maps_equal_the_model(shared_url, width, height):
    (pair,) = pairs(1, width, height)
    steps   = []
    with connect(shared_url) as device:
        result = device.compute(*pair, SETTINGS, lambda *step: steps.append(step))
    expect(result, pair)
    assert result.settings == SETTINGS
    assert result.clocks == width*height
    assert result.upload_s > 0 and result.match_s > 0 and result.download_s > 0
    chunks, parts = chunk_count(width, height), -(-2*width*height//1024)
    for phase, total in (("upload", chunks), ("match", 1), ("download", parts)):
        done = [step[1] for step in steps if step[0] == phase]
        assert done[0] == 0 and done[-1] == total and done == sorted(done)
        assert {step[2] for step in steps if step[0] == phase} == {total}


def test_a_stream_of_pairs_of_all_sizes_comes_back_in_order(shared_url):
    sent = pairs(3) + pairs(2, 90, 40) + pairs(1, 200, 20)
    with connect(shared_url) as device:
        before  = device.statistics()
        results = list(device.stream(sent, SETTINGS))
        after   = device.statistics()
        host    = device.link_counters
    for result, pair in zip(results, sent, strict=True):
        expect(result, pair)
    grown  = {name: after[name] - before[name] for name in after}
    chunks = sum(chunk_count(*left.shape) for left, _ in sent)
    assert (grown["frames_opened"], grown["frames_matched"], grown["frames_released"]) == (6, 6, 6)
    assert (grown["chunks_received"], grown["chunks_repeated"]) == (chunks, 0)
    assert (host.chunks_sent, host.chunks_sent_again, host.parts_asked_again) == (chunks, 0, 0)
    assert grown["requests_refused"] == grown["datagrams_malformed"] == 0
