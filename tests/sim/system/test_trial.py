#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The trial of a new firmware on the Colorlight i5's SoC in litex_sim: one that hangs at once, one that crashes after a
second, and a good one; boot program, reset record, watchdog and flash are those of the board."""

from __future__ import annotations

import contextlib
import socket
import threading

import pytest

from litestereo.host_tools.core.errors import DeviceError
from litestereo.host_tools.devices.connect import connect
from litestereo.host_tools.protocol.payloads import Trial
from litestereo.sim.system.build import build_firmware, build_program, build_soc
from litestereo.sim.system.simulation import start_simulation
from litestereo.soc.flow.sources import flash_image
from support.paths import CHECKOUT

pytestmark = [pytest.mark.system, pytest.mark.long]

BOARD    = "colorlight_i5"
PROGRAMS = CHECKOUT / "firmware" / "tests" / "programs"

#: Seconds for the device to come back: a simulated boot takes minutes.
LIMIT_S = 3600


@contextlib.contextmanager
def serial_output(port):
    """Collect the bytes that the device prints on its serial line, in a list that grows."""
    received = []

    def receive(line):
        with contextlib.suppress(OSError):
            while data := line.recv(4096):
                received.append(data)

    with socket.create_connection(("127.0.0.1", port)) as line:
        thread = threading.Thread(target=receive, args=[line])
        thread.start()
        try:
            yield received
        finally:
            line.shutdown(socket.SHUT_RDWR)
            thread.join()


@pytest.mark.parametrize("name", ["hang", "crash"])
def test_a_firmware_that_fails(name):
    """After three starts the old firmware is back; it reports that, and accepts another update."""
    soc = build_soc(BOARD)
    bad = flash_image(build_program(soc, PROGRAMS / f"{name}.c", "CONFIRMS=1", "FIRMWARE_VERSION=0x0102").read_bytes())
    with start_simulation(BOARD, timeout_s=900) as simulation:
        with serial_output(simulation.port) as output, connect(f"udp://127.0.0.1:{simulation.udp_port}") as device:
            assert device.info().firmware_version == "0.1"
            with pytest.raises(DeviceError, match=r"firmware 1.2 did not work.*runs firmware 0.1 again"):
                device.update_firmware(bad, restart_limit_s=LIMIT_S)
        printed = b"".join(output).decode(errors="replace")
        # The old firmware greets; a program that hangs prints nothing.
        assert printed.count("crash: started") == (3 if name == "crash" else 0), printed
        assert printed.count("LiteStereo on colorlight_i5, firmware 0.1") == 1, printed
        with connect(f"tcp://127.0.0.1:{simulation.port}") as device:
            assert device.info().firmware_version == "0.1"
            assert "newest firmware: failed on trial" in device.console("info", 900)
            assert "confirm: no firmware is on trial" in device.console("confirm", 900)


def test_a_good_firmware():
    """A session confirms the new firmware, and a restart before the next update keeps it."""
    good = flash_image(build_firmware(build_soc(BOARD), 0x0102).read_bytes())
    with start_simulation(BOARD, timeout_s=900) as simulation:
        with connect(f"udp://127.0.0.1:{simulation.udp_port}") as device:
            device.update_firmware(good, restart=False)
            assert device.trial() == Trial.RUNNING
            assert device.update_firmware(good, restart_limit_s=LIMIT_S).firmware_version == "1.2"
        with connect(f"tcp://127.0.0.1:{simulation.port}") as device:
            assert device.info().firmware_version == "1.2"
            assert "newest firmware: confirmed" in device.console("info", 900)
            assert "confirm: no firmware is on trial" in device.console("confirm", 900)
