#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Device URLs and the lines of bytes that they open."""

import errno
import ipaddress
import os
import pty
import socket
import tty

import pytest
import serial

from litestereo.host_tools.core.errors import DeviceError, UrlError
from litestereo.host_tools.link.transports import open_transport
from litestereo.host_tools.link.transports.serial_port import SerialTransport
from litestereo.host_tools.link.transports.tcp import TcpTransport
from litestereo.host_tools.link.urls import EXAMPLES, parse_url
from support.pairs import byte_generator


@pytest.mark.parametrize("text", EXAMPLES.values())
def test_examples_parse(text):
    assert parse_url(text).scheme == text.split(":")[0]


def test_parts_of_urls():
    url = parse_url("tcp://board.local:2000")
    assert (url.scheme, url.host, url.port) == ("tcp", "board.local", 2000)
    assert parse_url("tcp://[::1]:2000").host == "::1"
    url = parse_url("udp://board.local")
    assert (url.scheme, url.host, url.port) == ("udp", "board.local", 19539)
    assert parse_url("udp://10.0.0.7:1234").port == 1234
    url = parse_url("serial:/dev/ttyUSB0?baud=115200")
    assert (url.scheme, url.path, url.integer("baud", 1)) == ("serial", "/dev/ttyUSB0", 115200)
    url = parse_url("cosim:?disparities=32&max_width=320")
    assert dict(url.options) == {"disparities": "32", "max_width": "320"}


@pytest.mark.parametrize("text", [
    "", "tcp", "model", "foo:", "tcp:", "tcp://", "tcp://host", "tcp://host:", "tcp://host:0",
    "tcp://host:65536", "tcp://host:x", "tcp://:2000", "tcp://host:1/path", "tcp://host:1?baud=1",
    "tcp://[::1:2000", "serial:", "serial://x", "serial:?baud=1", "model:/x", "model:?disparities", "sim://host",
    "/dev/ttyUSB0", "http://host:1", "udp:", "udp://", "udp://host:", "udp://host:0", "udp://host:x", "udp://:1",
    "udp://host/path", "udp://host?baud=1", "udp://[::1]x", "tcp://[::1]x:1", "udp://[", "udp://[1.2.3.4]",
])
def test_malformed_urls_are_refused_in_one_line(text):
    with pytest.raises(UrlError) as caught:
        parse_url(text)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text, written", [
    ("udp://::1",                "udp://[::1]"),
    ("udp://::1?mode=streamed",  "udp://[::1]"),
    ("udp://fe80::1:19539",      "udp://[fe80::1]:19539"),
    ("tcp://fe80::1:19539",      "tcp://[fe80::1]:19539"),
    ("tcp://::1",                "tcp://[::1]:2000"),
    ("tcp://[::1:2000",          "tcp://[::1]:2000"),
    ("udp://::1]:5",             "udp://[::1]:5"),
    ("udp://fe80::1%eth0",       "udp://[fe80::1%eth0]"),
])
def test_an_ipv6_address_without_brackets_is_refused_with_the_way_to_write_it(text, written):
    with pytest.raises(UrlError) as caught:
        parse_url(text)
    assert str(caught.value) == f"'{text}': an IPv6 address is written in brackets, like {written}"


@pytest.mark.parametrize("number", range(40))
def test_drawn_ipv6_addresses(number):
    """In brackets an address is read back; without them it is refused, and what the error shows is its URL."""
    rng     = byte_generator(831, number)
    address = ipaddress.IPv6Address(rng.choice([rng.getrandbits(128), rng.getrandbits(16), 0xfe80 << 112 | 1]))
    text    = rng.choice([address.compressed, address.exploded])
    port    = rng.randrange(10000, 65536)
    scheme  = rng.choice(["udp", "tcp"])
    whole   = f"{scheme}://[{text}]:{port}"
    url     = parse_url(whole)
    assert (ipaddress.IPv6Address(url.host), url.port) == (address, port)
    with pytest.raises(UrlError, match="brackets") as caught:
        parse_url(f"{scheme}://{text}:{port}")
    assert str(caught.value).endswith(f"like {whole}")


@pytest.mark.parametrize("option", ["baud=fast", "baud=0", "parity=1"])
def test_bad_serial_options_are_refused(option):
    with pytest.raises(UrlError):
        open_transport(parse_url(f"serial:/dev/null?{option}"))


def test_tcp_carries_bytes_both_ways_and_tells_the_end():
    with socket.create_server(("127.0.0.1", 0)) as server:
        line    = open_transport(parse_url(f"tcp://127.0.0.1:{server.getsockname()[1]}"))
        peer, _ = server.accept()
        assert line.read(0.01) == b""
        line.write(b"abc")
        assert peer.recv(10) == b"abc"
        peer.sendall(b"\0xyz")
        assert line.read(1.0) == b"\0xyz"
        peer.close()
        with pytest.raises(DeviceError, match="closed the connection"):
            line.read(1.0)
        line.close()
        line.close()


def test_tcp_sends_small_messages_at_once():
    with socket.create_server(("127.0.0.1", 0)) as server:
        line = TcpTransport(*server.getsockname())
        assert line._socket.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)
        line.close()


def test_refused_and_unknown_hosts_are_told_apart():
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    with pytest.raises(DeviceError, match="refused the connection"):
        TcpTransport("127.0.0.1", port)
    with pytest.raises(DeviceError, match="cannot connect"):
        TcpTransport("no-such-host.invalid", 1)


def test_serial_carries_bytes_both_ways_and_tells_the_end():
    master, slave = pty.openpty()
    tty.setraw(slave)
    path = os.ttyname(slave)
    line = open_transport(parse_url(f"serial:{path}"))
    line.write(b"abc")
    assert os.read(master, 10) == b"abc"
    os.write(master, b"\0xyz")
    received = b""
    while len(received) < 4:
        received += line.read(1.0)
    assert received == b"\0xyz"
    assert line.read(0.01) == b""
    os.close(slave)
    os.close(master)
    with pytest.raises(DeviceError, match="is gone"):
        line.write(b"more")
        line.read(1.0)
    line.close()


def test_missing_busy_and_improper_serial_ports_are_told_apart(tmp_path, monkeypatch):
    with pytest.raises(DeviceError, match="no such port"):
        SerialTransport(str(tmp_path / "ttyUSB0"), 115200)
    (tmp_path / "file").write_text("")
    with pytest.raises(DeviceError, match="no serial port"):
        SerialTransport(str(tmp_path / "file"), 115200)
    master, slave = pty.openpty()
    first = SerialTransport(os.ttyname(slave), 115200)
    with pytest.raises(DeviceError, match="busy"):
        SerialTransport(os.ttyname(slave), 115200)
    first.close()
    os.close(slave)
    os.close(master)

    def refuse(*_, **__):
        raise serial.SerialException(errno.EACCES, "denied")

    monkeypatch.setattr(serial, "Serial", refuse)
    with pytest.raises(DeviceError, match="permission"):
        SerialTransport("/dev/ttyUSB0", 115200)
