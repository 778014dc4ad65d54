#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""A bad network: a UDP proxy that loses, doubles, delays and changes datagrams, in both directions."""

from __future__ import annotations

import contextlib
import selectors
import socket
import threading
from collections.abc import Iterator

from .udp_faults import HOLD_S, Faults

_BUFFER_BYTES = 4 << 20


def udp_socket() -> socket.socket:
    """Return a socket at a free port of this computer, with room for many datagrams."""
    one = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    for option in (socket.SO_RCVBUF, socket.SO_SNDBUF):
        one.setsockopt(socket.SOL_SOCKET, option, _BUFFER_BYTES)
    one.bind(("127.0.0.1", 0))
    one.setblocking(False)
    return one


class UdpProxy(threading.Thread):
    """Carries datagrams between a device and any number of hosts; the device sees each of them as another peer.

    `to_device` and `to_host` are the faults of the two directions, and count them.
    """

    def __init__(self, device_port: int, to_device: Faults, to_host: Faults) -> None:
        super().__init__(daemon=True)
        self.to_device = to_device
        self.to_host   = to_host
        self._device   = ("127.0.0.1", device_port)
        self._front    = udp_socket()
        self._backs:  dict[tuple[str, int], socket.socket] = {}
        self._hosts:  dict[socket.socket, tuple[str, int]] = {}
        self._ended    = threading.Event()
        self.url       = f"udp://127.0.0.1:{self._front.getsockname()[1]}"

    def run(self) -> None:
        """Carry datagrams until `stop` is called."""
        with selectors.DefaultSelector() as selector:
            selector.register(self._front, selectors.EVENT_READ)
            while not self._ended.is_set():
                for key, _ in selector.select(HOLD_S/4):
                    self._carry(selector, key.fileobj)
                self._send_to_device(self.to_device.overdue())
                self._send_to_hosts(self.to_host.overdue())
        for one in (self._front, *self._backs.values()):
            one.close()

    def _carry(self, selector: selectors.BaseSelector, one: socket.socket) -> None:
        # A socket reports that the device has gone when something is sent to it; hosts notice its silence.
        with contextlib.suppress(BlockingIOError, ConnectionError):
            for _ in range(64):
                datagram, sender = one.recvfrom(4096)
                if one is self._front:
                    if sender not in self._backs:
                        back = self._backs[sender] = udp_socket()
                        self._hosts[back] = sender
                        selector.register(back, selectors.EVENT_READ)
                    self._send_to_device(self.to_device.carry(self._backs[sender], datagram))
                elif sender == self._device:
                    self._send_to_hosts(self.to_host.carry(self._hosts[one], datagram))

    def _send_to_device(self, datagrams: list[tuple[socket.socket, bytes]]) -> None:
        for back, datagram in datagrams:
            with contextlib.suppress(BlockingIOError, ConnectionError):
                back.sendto(datagram, self._device)

    def _send_to_hosts(self, datagrams: list[tuple[tuple[str, int], bytes]]) -> None:
        for host, datagram in datagrams:
            with contextlib.suppress(BlockingIOError, ConnectionError):
                self._front.sendto(datagram, host)

    def plug_in(self, device_port: int) -> None:
        """Replace the device by another one; hosts notice only by its replies."""
        self._device = ("127.0.0.1", device_port)

    def stop(self) -> None:
        """Stop the proxy, and wait until it has stopped."""
        self._ended.set()
        self.join(5)


@contextlib.contextmanager
def udp_proxied(device_port: int, to_device: Faults | None = None, to_host: Faults | None = None) -> Iterator[UdpProxy]:
    """Connect a device by a network with these faults; by default the network has none."""
    proxy = UdpProxy(device_port, to_device or Faults(), to_host or Faults())
    proxy.start()
    try:
        yield proxy
    finally:
        proxy.stop()
