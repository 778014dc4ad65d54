#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""`connect`: from a URL to a device."""

from __future__ import annotations

import inspect
from dataclasses import replace
from typing import Protocol

from ..core.errors import DeviceError, UrlError
from ..link.settings import LinkSettings
from ..link.transports import open_transport
from ..link.udp_channel import UdpChannel
from ..link.urls import DeviceUrl, parse_url
from .base import Device, DeviceInfo, Result
from .local import exception_line, open_cosim, open_model
from .registry import load
from .serial.serial_device import SerialDevice
from .udp.udp_device import UdpDevice

__all__ = ["Device", "DeviceInfo", "Result", "connect"]

#: A simulated system boots while hello waits; seconds.
_SIMULATION_HELLO_LIMIT_S = 60.0


class _Simulation(Protocol):
    port:     int
    udp_port: int

    def close(self) -> None: ...


def connect(url: str, link_settings: LinkSettings | None = None) -> Device:
    """Return the device at `url`; a session with a remote one has begun. Use it as a context manager.

    `udp://host` is a device on a network; with `udp://host?mode=streamed` it matches pixels as they come.
    `tcp://host:port` and `serial:/dev/ttyUSB0?baud=1000000` are devices on a serial line. `sim:` starts the full system
    in simulation, `cosim:` is the gateware alone in Verilator, and `model:` the reference in NumPy.

    Parameters
    ----------
    url
        Where the device is.
    link_settings
        Limits of the link to a remote device; the default ones if None.

    Raises
    ------
    UrlError
        The URL cannot be understood.
    DeviceError
        There is no device, it is in use, or it does not answer.
    MissingExtraError
        `cosim:` or `sim:` without the packages of the extra `gateware`.
    UnsupportedError
        Frames are to be streamed, and the device was not built for that.
    ProtocolError
        The device speaks another version of the link protocol.
    """
    parsed = parse_url(url)
    if parsed.scheme == "model":
        return open_model(parsed)
    if parsed.scheme == "cosim":
        return open_cosim(parsed)
    if parsed.scheme == "sim":
        return _open_simulation(parsed, link_settings or LinkSettings())
    if parsed.scheme == "udp":
        streamed = _is_streamed(parsed)
        return UdpDevice(url, UdpChannel(parsed.host, parsed.port), link_settings, streamed=streamed)
    return SerialDevice(url, open_transport(parsed), link_settings)


def _is_streamed(url: DeviceUrl) -> bool:
    return url.choice("mode", "stored", "streamed") == "streamed"


def _open_simulation(url: DeviceUrl, link_settings: LinkSettings) -> Device:
    """Start the simulated system with the URL's options, and connect to it by the link that they name."""
    options    = {name: int(text) if text.isdecimal() else text for name, text in url.options.items()}
    link       = url.choice("link", "udp", "serial")
    streamed   = _is_streamed(url)
    if streamed and link != "udp":
        raise UrlError(f"{url.text}: frames can be streamed only with link=udp")
    for name in ("link", "mode"):
        options.pop(name, None)
    settings   = replace(link_settings, hello_limit_s=max(_SIMULATION_HELLO_LIMIT_S, link_settings.hello_limit_s))
    simulation = _start(url, options)
    try:
        if link == "udp":
            channel = UdpChannel("127.0.0.1", simulation.udp_port)
            return UdpDevice(url.text, channel, settings, simulation.close, streamed=streamed)
        line = open_transport(parse_url(f"tcp://127.0.0.1:{simulation.port}"))
    except BaseException:
        simulation.close()
        raise
    return SerialDevice(url.text, line, settings, simulation.close)


def _start(url: DeviceUrl, options: dict[str, int | str]) -> _Simulation:
    try:
        system = load("sim")
    except ImportError as error:
        raise DeviceError(f"{url.text} cannot be started: {exception_line(error)}") from error
    try:
        inspect.signature(system.start_simulation).bind(**options)
    except TypeError:
        known = ", ".join(["link", "mode", *inspect.signature(system.start_simulation).parameters])
        raise UrlError(f"{url.text}: unknown option, the options are {known}") from None
    try:
        simulation: _Simulation = system.start_simulation(**options)
    except (OSError, RuntimeError, ValueError, system.SimulationError) as error:
        raise DeviceError(f"{url.text} cannot be started: {exception_line(error)}") from error
    return simulation
