#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Devices that follow a script of a test, for behaviour that the real firmware never shows."""

from __future__ import annotations

import contextlib
import socket
import threading
import time
from collections.abc import Callable, Iterator

from litestereo.host_tools.link.serial_framing import Demultiplexer, encode_frame
from litestereo.host_tools.protocol.messages import Message

#: From a request to the bytes that a scripted device sends.
Script = Callable[[Message], bytes]


def framed(message: Message) -> bytes:
    """Return a message as a serial line carries it."""
    return encode_frame(message.encode())


class ScriptedTransport:
    """A transport whose other end is a script in the same thread; `requests` are all that it received."""

    def __init__(self, script: Script) -> None:
        self.requests: list[Message] = []
        self.closed    = False
        self._script   = script
        self._demux    = Demultiplexer()
        self._answers: list[bytes] = []

    def write(self, data: bytes) -> None:
        """Give every message in `data` to the script."""
        for message in self._demux.feed(data):
            self.requests.append(message)
            self._answers.append(self._script(message))

    def read(self, timeout_s: float) -> bytes:
        """Return the next answer that is not empty; wait if there is none."""
        while self._answers:
            if answer := self._answers.pop(0):
                return answer
        time.sleep(timeout_s)
        return b""

    def close(self) -> None:
        """Record that the transport was closed."""
        self.closed = True


@contextlib.contextmanager
def scripted_server(script: Script | None) -> Iterator[str]:
    """Serve a script at a TCP port, one connection after the other, and return its URL.

    Without a script, connections are closed as soon as they are made.
    """
    with socket.create_server(("127.0.0.1", 0)) as server:
        thread = threading.Thread(target=_serve, args=(server, script), daemon=True)
        thread.start()
        yield f"tcp://127.0.0.1:{server.getsockname()[1]}"
        # Closing a listening socket does not wake a thread that accepts; a last connection does.
        server.settimeout(0)
        with contextlib.suppress(OSError):
            socket.create_connection(server.getsockname(), timeout=1).close()
    thread.join(5)


def _serve(server: socket.socket, script: Script | None) -> None:
    with contextlib.suppress(OSError):
        while True:
            connection, _ = server.accept()
            with connection, contextlib.suppress(ConnectionError):
                demux = Demultiplexer()
                while script is not None and (data := connection.recv(4096)):
                    for message in demux.feed(data):
                        connection.sendall(script(message))
