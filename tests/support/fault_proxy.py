#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""A bad serial line: a TCP proxy that changes bytes in both directions, drawn from a seeded generator."""

from __future__ import annotations

import contextlib
import queue
import random
import selectors
import socket
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field


@dataclass
class Faults:
    """Chance per byte that a fault begins there, and counts of each fault."""

    rate:     float = 0.0
    flipped:  int   = 0
    dropped:  int   = 0
    inserted: int   = 0
    repeated: int   = 0
    rng:      random.Random = field(default_factory=random.Random)

    #: Longest piece that is dropped or repeated; shorter than a message, so that no message comes twice.
    LONGEST_RUN = 20

    def apply(self, data: bytes) -> bytes:
        """Return `data` as it leaves the bad line."""
        out      = bytearray()
        position = 0
        while position < len(data):
            if self.rng.random() >= self.rate:
                out.append(data[position])
                position += 1
                continue
            run   = self.rng.randint(1, self.LONGEST_RUN)
            fault = self.rng.choice(("flipped", "dropped", "inserted", "repeated"))
            setattr(self, fault, getattr(self, fault) + 1)
            if fault == "flipped":
                out.append(data[position] ^ 1 << self.rng.randrange(8))
                position += 1
            elif fault == "dropped":
                position += run
            elif fault == "inserted":
                out += self.rng.randbytes(self.rng.randint(1, 3))
            else:
                out += data[position:position + run]*2
                position += run
        return bytes(out)


class Proxy(threading.Thread):
    """Carries bytes between one device and any number of hosts, which all hear it, as on a shared line."""

    def __init__(self, device_port: int, to_device: Faults, to_host: Faults) -> None:
        super().__init__(daemon=True)
        self._to_device = to_device
        self._to_host   = to_host
        self._device    = socket.create_connection(("127.0.0.1", device_port))
        self._plugged:  queue.SimpleQueue[int] = queue.SimpleQueue()
        self._server    = socket.create_server(("127.0.0.1", 0))
        self._hosts: set[socket.socket] = set()
        self._ended      = threading.Event()
        self.url        = f"tcp://127.0.0.1:{self._server.getsockname()[1]}"

    def run(self) -> None:
        """Carry bytes until `stop` is called or the device hangs up."""
        with selectors.DefaultSelector() as selector:
            selector.register(self._server, selectors.EVENT_READ)
            selector.register(self._device, selectors.EVENT_READ)
            while not self._ended.is_set():
                if not self._plugged.empty():
                    selector.unregister(self._device)
                    self._device.close()
                    self._device = socket.create_connection(("127.0.0.1", self._plugged.get()))
                    selector.register(self._device, selectors.EVENT_READ)
                for key, _ in selector.select(0.05):
                    self._carry(selector, key.fileobj)
        for line in (self._server, self._device, *self._hosts):
            line.close()

    def _carry(self, selector: selectors.BaseSelector, line: socket.socket) -> None:
        if line is self._server:
            host, _ = line.accept()
            host.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._hosts.add(host)
            selector.register(host, selectors.EVENT_READ)
            return
        try:
            data = line.recv(4096)
        except ConnectionError:
            data = b""
        if line is self._device:
            if not data:
                self._ended.set()
            data = self._to_host.apply(data)
            for host in self._hosts:
                # A host that has hung up is noticed when its socket is read.
                with contextlib.suppress(ConnectionError):
                    host.sendall(data)
        elif data:
            self._device.sendall(self._to_device.apply(data))
        else:
            selector.unregister(line)
            self._hosts.remove(line)
            line.close()

    def plug_in(self, device_port: int) -> None:
        """Replace the device by another one; hosts notice only by its replies."""
        self._plugged.put(device_port)
        while not self._plugged.empty():
            time.sleep(0.01)

    def stop(self) -> None:
        """Stop the proxy, and wait until it has stopped."""
        self._ended.set()
        self.join(5)


@contextlib.contextmanager
def proxied(device_port: int, to_device: Faults | None = None,
            to_host: Faults | None = None) -> Iterator[Proxy]:
    """Connect a device through a line with these faults; without any the line is a good one that hosts share."""
    proxy = Proxy(device_port, to_device or Faults(), to_host or Faults())
    proxy.start()
    try:
        yield proxy
    finally:
        proxy.stop()
