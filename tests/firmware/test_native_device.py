#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The native device as a program: connections that come and go, and its end."""

import contextlib
import random
import signal
import socket
import subprocess
import time

from support.native_device import build, native_device


def talk(port, text, until, limit_s=30.0):
    """Send text again and again until the answer arrives."""
    end = time.monotonic() + limit_s
    with socket.create_connection(("127.0.0.1", port)) as connection:
        # Longer than the timeout of a frame: an earlier client may have left one open, and text inside it is ignored.
        connection.settimeout(1.2)
        answer = b""
        while until not in answer:
            assert time.monotonic() < end, answer
            connection.sendall(text)
            with contextlib.suppress(TimeoutError):
                answer += connection.recv(65536)


def test_clients_that_leave_at_any_moment():
    rng = random.Random(1)
    with native_device() as port:
        for _ in range(100):
            with socket.create_connection(("127.0.0.1", port)) as connection:
                connection.sendall(rng.choice([b"help\r", b"", bytes(5), b"\0\5LS", rng.randbytes(3000)]))
                if rng.random() < 0.5:
                    # The client leaves with a reset instead of a shutdown.
                    connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
        talk(port, b"\r", b"litestereo> ")


def test_text_is_heard_again_after_a_second_in_a_frame():
    with native_device() as port, socket.create_connection(("127.0.0.1", port)) as connection:
        connection.settimeout(0.3)
        connection.sendall(b"\0\5LS")
        time.sleep(0.3)
        connection.sendall(b"\r")
        with contextlib.suppress(TimeoutError):
            assert not connection.recv(100)
        time.sleep(1.1)
        connection.sendall(b"\r")
        assert connection.recv(100) == b"\r\nlitestereo> "


def test_ends_when_told_so_even_if_the_client_does_not_read():
    with subprocess.Popen([build()], stdout=subprocess.PIPE, text=True) as process:
        port = int(process.stdout.readline().rsplit(":", 1)[1])
        with socket.create_connection(("127.0.0.1", port)) as connection:
            connection.settimeout(0.5)
            try:
                while True:
                    connection.sendall(b"help\r" * 1000)
            except TimeoutError:
                pass
            process.send_signal(signal.SIGTERM)
            assert process.wait(timeout=10) == 0


def test_unknown_options_are_refused():
    done = subprocess.run([build(), "--no-such-option"], capture_output=True, text=True, check=False)
    assert done.returncode == 2 and "--hang-matcher" in done.stderr
