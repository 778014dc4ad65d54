#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The full system, SoC and firmware, as a running litex_sim process."""

from __future__ import annotations

import itertools
import json
import math
import os
import re
import shutil
import socket
import subprocess
import tempfile
import time
import zlib
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

from ...soc.boards import BOARDS
from ...soc.build.paths import build_directory
from .build import SimulationError, build_boot, build_example, build_firmware, build_program, build_soc, examples

PROMPT = b"litestereo> "

#: Clock of the simulated SoC; sim/socs/simulated_soc.py says the same.
SYS_CLK_HZ = 1_000_000

#: What the Ethernet of the SoC can be tied to, and the litex_sim module for each.
WIRES = {"socket": "ethernet2socket", "tap": "ethernet"}

#: Numbers of the simulations of this process.
_numbers = itertools.count(1)

#: Makes Linux kill the command that follows when its parent ends, for any reason. (A preexec_fn could hang if there are
#: threads.)
DIE_WITH_PARENT = ("setpriv", "--pdeathsig", "KILL")


@dataclass(frozen=True)
class Stranger:
    """A station on the simulated wire that sends the same datagram again and again, and answers nothing, not even ARP.

    Parameters
    ----------
    payload
        What each datagram carries, at most 1472 bytes.
    clocks
        Clocks of the wire from one datagram to the next, at least 1.
    """
    payload: bytes
    clocks:  int


class Simulation:
    """A running simulation: a process, the TCP port of its UART and the UDP port of its Ethernet.

    Use as a context manager, or call `close`.
    """
    def __init__(self, process: subprocess.Popen[bytes], folder: Path) -> None:
        self.port     = 0        #: TCP, of 127.0.0.1
        self.udp_port = 0        #: UDP, of 127.0.0.1; 0 if the wire is not a socket
        self.paced    = ""       #: name of the abstract socket of a host in the device's time; empty if there is none
        self.folder   = folder   #: where it runs
        self._process = process

    def __enter__(self) -> Simulation:
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None,
                 trace: TracebackType | None) -> None:
        self.close()

    def running(self) -> bool:
        """Return whether the process is running."""
        return self._process.poll() is None

    def log(self) -> str:
        """Return what the simulator has printed."""
        return (self.folder / "simulation.log").read_text(errors="replace")

    def wait(self) -> None:
        """Return when the process has ended."""
        self._process.wait()

    def close(self) -> None:
        """End the process and remove its folder."""
        self._process.kill()
        self._process.wait()
        shutil.rmtree(self.folder, ignore_errors=True)


def start_simulation(ram: str = "integrated-ram", port: int = 0, udp_port: int = 0, wire: str = "socket",
                     byte_clock_hz: int = SYS_CLK_HZ, capture: Path | None = None, timeout_s: float = 300.0,
                     example: str | None = None, stranger: Stranger | None = None,
                     paced_latency: int | None = None, memory_counts: Path | None = None,
                     matcher_clock_hz: int = 0, program: Path | None = None) -> Simulation:
    """Build what is missing, start the simulation and wait for the firmware's prompt.

    Parameters
    ----------
    ram
        Main memory of the SoC: `integrated-ram` or `sdram`; `rectifying` for a SoC on integrated RAM that rectifies,
        `cameras` for the same with cameras; or a board, for its SoC, which boots from its flash.
    port
        TCP port of 127.0.0.1 for the UART; 0 picks a free one.
    udp_port
        UDP port of 127.0.0.1 for the Ethernet; 0 picks a free one.
    wire
        What the Ethernet is tied to: `socket`, or `tap`, LiteX's module, for a network interface tap0.
    byte_clock_hz
        Clock of the wire in Hz, which carries a byte per clock; that of the SoC is 1000000.
    capture
        File for all frames on the wire, for Wireshark or `read_capture`; of the wire `socket` only.
    timeout_s
        Longest wait for the prompt, in seconds.
    example
        One of `build.examples` in place of our firmware; there is no prompt to wait for then.
    stranger
        Another station on the wire `socket`.
    paced_latency
        Clocks of the wire until a datagram has reached a host in the time of the device, which the wire `socket`
        then waits for at `Simulation.paced`: see sim/socs/modules/ethernet2socket/paced.h. None: there is no such host.
    memory_counts
        File for what each master of the main memory does: `memory.json` of `build_soc` names the counts of a row, see
        sim/socs/modules/memory2file.
    matcher_clock_hz
        Clock of a matcher that has a separate one; 0: the SoC's own choice.
    program
        Source of another program in `firmware/`, in place of our firmware; there is no prompt to wait for then.

    Raises
    ------
    SimulationError
        A build failed, the port is in use, or the firmware did not start.
    """
    if wire not in WIRES:
        raise SimulationError(f"unknown wire {wire!r}: choose one of {', '.join(WIRES)}")
    if example and example not in examples():
        raise SimulationError(f"unknown example {example!r}: choose one of {', '.join(examples())}")
    soc      = build_soc(ram)
    binary   = (build_program(soc, program) if program else build_example(soc, example) if example
                else build_firmware(soc))
    firmware = binary.read_bytes()
    paced    = f"litestereo-{os.getpid()}-{next(_numbers)}" if paced_latency is not None else ""
    runs     = build_directory() / "run"
    runs.mkdir(parents=True, exist_ok=True)
    folder   = Path(tempfile.mkdtemp(prefix=f"{ram}-", dir=runs))
    contents = memory_contents(ram, soc, firmware)
    _prepare_memories(folder, soc / "gateware", contents)
    _prepare_modules(folder, soc / "gateware", {
        "serial2socket":   {"port": port},
        "ethernet2socket": {"port": udp_port, "clock": "eth_clk"} | ({"capture": str(capture)} if capture else {})
                           | ({"paced": paced, "paced_latency": paced_latency} if paced_latency is not None else {})
                           | ({"stranger_payload": stranger.payload.hex(), "stranger_clocks": stranger.clocks}
                              if stranger else {}),
        "ethernet":        {"interface": "tap0", "ip": "192.168.1.100"},
    } | ({"memory2file": {"file": str(memory_counts)}} if memory_counts else {}), wire,
    {"eth_clk": byte_clock_hz} | ({"matcher_clk": matcher_clock_hz} if matcher_clock_hz else {}))
    with open(folder / "simulation.log", "wb") as log:
        process = subprocess.Popen([*DIE_WITH_PARENT, soc / "gateware" / "obj_dir" / "Vsim"], cwd=folder, stdout=log,
                                   stderr=log, stdin=subprocess.DEVNULL)
    simulation = Simulation(process, folder)
    simulation.paced = paced
    try:
        deadline        = time.monotonic() + timeout_s
        simulation.port = _listening_port(simulation, "serial2socket", port, deadline)
        if wire == "socket":
            simulation.udp_port = _listening_port(simulation, "ethernet2socket", udp_port, deadline)
        if not (example or program):
            _wait_for_prompt(simulation, deadline)
    except BaseException:
        simulation.close()
        raise
    return simulation


def _prepare_modules(folder: Path, gateware: Path, arguments: dict[str, dict[str, int | str]], wire: str,
                     clocks_hz: dict[str, int]) -> None:
    """Put litex_sim's modules and their configuration into the folder that it runs in."""
    config = [module for module in json.loads((gateware / "sim_config.js").read_text())
              if module.get("module") != "memory2file" or "memory2file" in arguments]
    for module in config:
        name = module.get("module")
        if name == WIRES["socket"] and wire != "socket":
            # LiteX's module supports no other clock.
            module["module"]    = name = WIRES[wire]
            module["interface"] = ["sys_clk" if pads == "eth_clk" else pads for pads in module["interface"]]
        if name in arguments:
            module["args"] = arguments[name]
        elif name == "clocker" and module["interface"][0] in clocks_hz:
            module["args"]["freq_hz"] = clocks_hz[module["interface"][0]]
    # The step of time, in ps, whose multiples are the edges of all clocks.
    (step,) = (entry for entry in config if "timebase" in entry)
    clocks  = [module["args"]["freq_hz"] for module in config if module.get("module") == "clocker"]
    step["timebase"] = math.gcd(*(10**12//hz//2 for hz in clocks))
    (folder / "sim_config.js").write_text(json.dumps(config))
    modules = folder / "modules"
    modules.mkdir()
    for name in {module["module"] for module in config if "module" in module}:
        (modules / f"{name}.so").symlink_to(gateware / "modules" / f"{name}.so")


def memory_contents(ram: str, soc: Path, firmware: bytes) -> dict[str, tuple[bytes, int]]:
    """Return the contents of the memories that hold programs, and their bytes per word, by the names of their files."""
    if ram == "integrated-ram":
        return {"sim_main_ram.init": (firmware, 16)}
    if ram in ("rectifying", "cameras"):
        erased = b"\xff"*json.loads((soc / "flash.json").read_text())["bytes"]
        return {"sim_main_ram.init": (firmware, 16), "sim_flash.init": (erased, 4)}
    # The image that LiteX's BIOS and the boards' boot program read from flash: length, CRC-32, firmware.
    image    = len(firmware).to_bytes(4, "little") + zlib.crc32(firmware).to_bytes(4, "little") + firmware
    if ram not in BOARDS:
        return {"sim_flash.init": (image, 4)}
    # The same contents as after `make flash`.
    flash = json.loads((soc / "board.json").read_text())["flash"]
    return {"sim_flash.init": (image.ljust(flash["bytes"], b"\xff")*flash["images"] + b"\xff"*flash["records"], 4),
            "sim_rom.init":   (build_boot(soc).read_bytes(), 4)}


def _prepare_memories(folder: Path, gateware: Path, contents: dict[str, tuple[bytes, int]]) -> None:
    """Put the contents of the memories into the folder that litex_sim runs in."""
    for path in gateware.glob("*.init"):
        if path.name not in contents:
            (folder / path.name).symlink_to(path)
    for name, (data, word_bytes) in contents.items():
        data += bytes(-len(data) % word_bytes)
        words = (data[index:index + word_bytes][::-1].hex() for index in range(0, len(data), word_bytes))
        (folder / name).write_text("\n".join(words) + "\n")


def _listening_port(simulation: Simulation, module: str, port: int, deadline: float) -> int:
    while time.monotonic() < deadline:
        if match := re.search(rf"\[{module}\] listening on 127\.0\.0\.1:(\d+)", simulation.log()):
            return int(match[1])
        if not simulation.running():
            if "cannot listen" in simulation.log():
                raise SimulationError(f"port {port} is in use: choose another, or 0 for a free one")
            raise SimulationError(f"the simulator ended at once: {simulation.log().strip()[-200:]}")
        time.sleep(0.02)
    raise SimulationError("the simulator did not start in time")


def _wait_for_prompt(simulation: Simulation, deadline: float) -> None:
    """Read the console until the firmware's prompt, so that the next client finds no pending text."""
    text = b""
    with socket.create_connection(("127.0.0.1", simulation.port), timeout=10) as console:
        console.settimeout(1)
        while PROMPT not in text:
            if time.monotonic() > deadline:
                raise SimulationError(f"the firmware did not start in time; it printed: {text[-200:]!r}")
            try:
                received = console.recv(4096)
            except TimeoutError:
                continue
            if not received:
                raise SimulationError(f"the simulator ended: {simulation.log().strip()[-200:]}")
            text += received
