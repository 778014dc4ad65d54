#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""A program for a network namespace: talks to the simulated SoC over a TAP, with the kernel's own ARP, IP and UDP.

    tap_host.py RAM

It prints its results as JSON.
"""

from __future__ import annotations

import json
import socket
import struct
import sys
from pathlib import Path

from litestereo.host_tools.protocol.messages import UDP_PORT, Message, MessageType
from litestereo.sim.system.simulation import start_simulation

ADDRESS = "192.168.1.50"
NONCE   = 0x1234abcd

#: Longest wait for an answer, and number of tries: a simulated clock takes microseconds.
TIMEOUT_S = 5.0
TRIES     = 6


def ask(socket_: socket.socket, question: bytes, address: tuple[str, int]) -> bytes | None:
    """Return the first answer from `address`, None if there is none."""
    socket_.settimeout(TIMEOUT_S)
    for _ in range(TRIES):
        try:
            socket_.sendto(question, address)
            answer, sender = socket_.recvfrom(2048)
        except (TimeoutError, OSError):
            # OSError: until ARP is answered, the kernel finds no route to the host.
            continue
        if sender == address:
            return answer
    return None


def ping(payload: bytes) -> bool:
    """Return whether the echo comes back whole; the kernel computes the checksum, and checks that of the answer."""
    # Groups that may open such a socket: root.
    Path("/proc/sys/net/ipv4/ping_group_range").write_text("0 0")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM, socket.IPPROTO_ICMP) as echo:
        answer = ask(echo, struct.pack(">BBHHH", 8, 0, 0, 0, 1) + payload, (ADDRESS, 0))
    return answer is not None and answer[0] == 0 and answer[8:] == payload


def hello() -> bool:
    """Return whether the device answers a hello at the socket that sent it."""
    request = Message(MessageType.HELLO, payload=struct.pack("<I", NONCE))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
        answer = ask(link, request.encode(), (ADDRESS, UDP_PORT))
    if answer is None:
        return False
    reply = Message.decode(answer)
    return reply.type == request.reply().type and struct.unpack_from("<I", reply.payload, 4) == (NONCE,)


def hardware_address() -> str | None:
    """Return the address that the kernel's ARP has found."""
    lines = [line.split() for line in Path("/proc/net/arp").read_text().splitlines()]
    return next((fields[3] for fields in lines if fields[0] == ADDRESS), None)


def main() -> None:
    """Start the simulation, talk to it, and print the results."""
    with start_simulation(ram=sys.argv[1], wire="tap"):
        print(json.dumps({"pings": [ping(bytes(range(length))) for length in (56, 1, 0)], "hello": hello(),
                          "hardware_address": hardware_address()}))


if __name__ == "__main__":
    main()
