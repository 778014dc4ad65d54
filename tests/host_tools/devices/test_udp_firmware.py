#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The host tools against the real firmware over UDP: it runs on this computer, with gateware in C."""

import contextlib
import secrets
import threading

import pytest

from litestereo.host_tools.core.errors import DeviceError
from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.host_tools.devices.connect import connect
from litestereo.host_tools.link.settings import LinkSettings
from support.chunks import image_chunks, pair_chunks
from support.expected import SETTINGS, expect
from support.native_device import native_ports, native_udp_device
from support.pairs import pairs
from support.udp_faults import bad_ways
from support.udp_proxy import udp_proxied


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
    chunks, parts = image_chunks(width, height), pair_chunks(width, height)
    for phase, total in (("upload", chunks), ("match", 1), ("download", parts)):
        done = [step[1] for step in steps if step[0] == phase]
        assert done[0] == 0 and done[-1] == total and done == sorted(done)
        assert {step[2] for step in steps if step[0] == phase} == {total}


def test_a_stream_of_pairs_of_all_sizes_comes_back_in_order(shared_url, patient):
    sent = pairs(3) + pairs(2, 90, 40) + pairs(1, 200, 20)
    with connect(shared_url) as device:
        before  = device.statistics()
        results = list(device.stream(sent, SETTINGS))
        after   = device.statistics()
        host    = device.link_counters
    for result, pair in zip(results, sent, strict=True):
        expect(result, pair)
    grown  = {name: after[name] - before[name] for name in after}
    chunks = sum(image_chunks(*left.shape) for left, _ in sent)
    assert (grown["frames_opened"], grown["frames_matched"], grown["frames_released"]) == (6, 6, 6)
    assert (grown["chunks_received"], grown["chunks_repeated"]) == (chunks, 0)
    assert (host.chunks_sent, host.chunks_sent_again, host.parts_asked_again) == (chunks, 0, 0)
    assert grown["requests_refused"] == grown["datagrams_malformed"] == 0


@pytest.mark.parametrize(("seed", "frames"), [
    pytest.param(0, 2000, marks=pytest.mark.long), (1, 40), (2, 40), (3, 40)])
def test_many_small_frames_on_a_bad_network(seed, frames):
    """Datagrams are lost, doubled, delayed and changed on their way, in both directions."""
    sent = pairs(frames, 64, 20, 71)
    ways = bad_ways(72, seed)
    with native_udp_device() as port, udp_proxied(port, *ways) as network, connect(network.url) as device:
        for result, pair in zip(device.stream(sent, SETTINGS), sent, strict=True):
            expect(result, pair)
        host    = device.link_counters
        counted = device.statistics()
    for way in ways:
        assert min(way.lost, way.duplicated, way.reordered, way.flipped) > 0
    chunks = frames*image_chunks(64, 20)
    again  = counted["frames_opened"] - frames
    assert (counted["sessions"], counted["frames_matched"], counted["frames_failed"]) == (1, frames, 0)
    # A late copy of an OPEN opens a frame again, and late copies of its chunks may fill it.
    assert 0 <= again <= ways[0].duplicated
    assert chunks <= counted["chunks_received"] <= chunks + again*image_chunks(64, 20)
    assert (host.chunks_sent, host.parts_received) == (chunks, frames*pair_chunks(64, 20))
    assert counted["datagrams_malformed"] <= ways[0].flipped
    assert counted["datagrams_received"] <= ways[0].carried - ways[0].lost + ways[0].duplicated
    assert counted["datagrams_overrun"] == counted["mailbox_overrun"] == 0


@pytest.mark.parametrize("mode", ["stored", "streamed"])
@pytest.mark.parametrize("before", [1, 3, 20])
def test_sequences_begin_anew_at_2_32(monkeypatch, shared_url, mode, before):
    """Frames of a session whose sequences wrap at any of its messages: in the hello, among chunks, or between parts."""
    drawn = secrets.randbits
    monkeypatch.setattr(secrets, "randbits", lambda bits: 2**32 - before if bits == 31 else drawn(bits))
    sent = pairs(3, 64, 40, 75)
    with connect(f"{shared_url}?mode={mode}") as device:
        for result, pair in zip(device.stream(sent, SETTINGS), sent, strict=True):
            expect(result, pair)
        assert device.link_counters.requests + device.link_counters.chunks_sent > before


def test_settings_that_change_on_a_bad_network():
    sent = pairs(12, 64, 20, 73)
    ways = bad_ways(74, loss=0.02, duplication=0.3, reordering=0.3, flips=0.0)
    with native_udp_device() as port, udp_proxied(port, *ways) as network, connect(network.url) as device:
        for index, pair in enumerate(sent):
            settings = MatcherSettings(16, (5, 7, 9)[index % 3])
            expect(device.compute(*pair, settings), pair, settings)


def test_a_second_host_waits_until_the_first_has_gone():
    (pair,) = pairs(1)
    with native_udp_device() as port, udp_proxied(port) as network, contextlib.ExitStack() as first:
        expect(first.enter_context(connect(network.url)).compute(*pair, SETTINGS), pair)
        with pytest.raises(DeviceError, match="another host uses the device"):
            connect(network.url, LinkSettings(hello_limit_s=0.5))
        timer = threading.Timer(0.5, first.close)
        timer.start()
        with connect(network.url) as second:
            expect(second.compute(*pair, SETTINGS), pair)
            assert second.statistics()["sessions_refused"] > 0
        timer.join()


def test_the_serial_line_is_told_that_the_network_has_the_device():
    (pair,) = pairs(1)
    with native_ports() as (serial_port, udp_port), connect(f"udp://127.0.0.1:{udp_port}") as device:
        with pytest.raises(DeviceError, match="another host uses the device"):
            connect(f"tcp://127.0.0.1:{serial_port}", LinkSettings(hello_limit_s=0.5))
        expect(device.compute(*pair, SETTINGS), pair)
        device.close()
        with connect(f"tcp://127.0.0.1:{serial_port}") as line:
            expect(line.compute(*pair, SETTINGS), pair)
            assert "datagrams" in line.console("stats")
