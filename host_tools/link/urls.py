#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Device URLs: where a device is, as one word of a command line."""

from __future__ import annotations

import ipaddress
import re
import urllib.parse
from collections.abc import Mapping
from dataclasses import dataclass, field

from ..core.errors import UrlError
from ..protocol.messages import UDP_PORT

#: Environment variable with the URL of the device if none is given.
DEVICE_VARIABLE = "LITESTEREO_DEVICE"

#: One example of each kind of device URL, for messages and help.
EXAMPLES = {
    "udp":    "udp://192.168.1.50",
    "tcp":    "tcp://127.0.0.1:2000",
    "serial": "serial:/dev/ttyUSB0?baud=1000000",
    "sim":    "sim:?ram=sdram",
    "cosim":  "cosim:?disparities=64",
    "model":  "model:",
}


@dataclass(frozen=True)
class DeviceUrl:
    """A device URL in parts.

    `text` is the whole of it. `host` and `port` are set for udp and tcp, `path` for serial; `options` are those of the
    query.
    """

    text:    str
    scheme:  str
    host:    str = ""
    port:    int = 0
    path:    str = ""
    options: Mapping[str, str] = field(default_factory=dict)

    def check_options(self, *names: str) -> None:
        """Raise UrlError if there is an option that is not one of `names`."""
        for name in self.options:
            if name not in names:
                known = f"the options are {', '.join(names)}" if names else f"{self.scheme}: takes none"
                raise UrlError(f"{self.text}: unknown option '{name}', {known}")

    def choice(self, name: str, default: str, *others: str) -> str:
        """Return the value of an option, `default` or one of `others`; raise UrlError if it is none of them."""
        value = self.options.get(name, default)
        if value not in (default, *others):
            raise UrlError(f"{self.text}: {name} is {' or '.join((default, *others))}, not '{value}'")
        return value

    def integer(self, name: str, default: int, minimum: int = 1) -> int:
        """Return the value of an option as a number; raise UrlError if it is none, or less than `minimum`."""
        text = self.options.get(name, str(default))
        if not text.isdecimal() or int(text) < minimum:
            raise UrlError(f"{self.text}: {name} must be a whole number of at least {minimum}, not '{text}'")
        return int(text)


def parse_url(text: str) -> DeviceUrl:
    """Return the parts of a device URL.

    Raises
    ------
    UrlError
        The scheme is unknown, host, port, path or an option is missing or malformed, or an IPv6 address has no
        brackets.
    """
    _check_brackets(text)
    try:
        parts   = urllib.parse.urlsplit(text)
        options = dict(urllib.parse.parse_qsl(parts.query, strict_parsing=True) if parts.query else [])
    except ValueError:
        example = EXAMPLES.get(text.partition(":")[0], EXAMPLES["tcp"])
        raise UrlError(f"'{text}' is not a device URL, write it like {example}") from None
    if parts.scheme not in EXAMPLES or not text.startswith(f"{parts.scheme}:"):
        raise UrlError(f"'{text}' is not a device URL, write it like one of: {', '.join(EXAMPLES.values())}")
    url = DeviceUrl(text, parts.scheme, path=parts.path, options=options)
    if parts.scheme in ("udp", "tcp"):
        return _parse_host(url, parts)
    if parts.netloc or bool(parts.path) != (parts.scheme == "serial"):
        raise UrlError(f"'{text}' is not a {parts.scheme} URL, write it like {EXAMPLES[parts.scheme]}")
    return url


def _is_ipv6(text: str) -> bool:
    try:
        ipaddress.IPv6Address(text)
    except ValueError:
        return False
    return True


def _check_brackets(text: str) -> None:
    """Raise UrlError for an IPv6 address without the brackets that its colons need, and for other text in brackets."""
    scheme, _, rest = text.partition("://")
    place           = re.split("[/?#]", rest, maxsplit=1)[0]
    if scheme not in ("udp", "tcp"):
        return
    if found := re.fullmatch(r"\[(.*)\](:.*)?", place):
        # urlsplit checks this from Python 3.11.4 on.
        if not _is_ipv6(found[1]):
            raise UrlError(f"'{text}': '{found[1]}' is not an IPv6 address, which is what brackets are for")
        return
    bare          = re.sub(r"[\[\]]", "", place)
    host, _, port = bare.rpartition(":")
    # The last part may be the port; over TCP there is always one.
    if _is_ipv6(host) and port.isdecimal() and (scheme == "tcp" or bare != place or not _is_ipv6(bare)):
        written = f"[{host}]:{port}"
    elif _is_ipv6(bare):
        written = f"[{bare}]:2000" if scheme == "tcp" else f"[{bare}]"
    else:
        return
    raise UrlError(f"'{text}': an IPv6 address is written in brackets, like {scheme}://{written}")


def _parse_host(url: DeviceUrl, parts: urllib.parse.SplitResult) -> DeviceUrl:
    try:
        host, port = parts.hostname, parts.port
    except ValueError:
        raise UrlError(f"'{url.text}': the port must be a number from 1 to 65535") from None
    if port is None and url.scheme == "udp" and not parts.netloc.endswith(":"):
        port = UDP_PORT
    if port == 0:
        raise UrlError(f"'{url.text}': the port must be a number from 1 to 65535")
    if not host or port is None or parts.path or re.search("\\][^:]", parts.netloc):
        raise UrlError(f"'{url.text}' is not a {url.scheme} URL, write it like {EXAMPLES[url.scheme]}")
    url.check_options(*(("mode",) if url.scheme == "udp" else ()))
    return DeviceUrl(url.text, url.scheme, host, port, options=url.options)
