#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Where a recording for Rerun goes: a new viewer, a running one, browsers, or a file."""

from __future__ import annotations

import os
import socket
import sys
import urllib.parse
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..core.errors import ViewerError
from ..core.extras import import_extra
from ..core.outputs import finish, partial_of

#: Where Rerun's viewer listens by default.
DEFAULT_URL = "rerun+http://127.0.0.1:9876/proxy"

#: Longest wait for a viewer in seconds.
_CONNECT_S = 3.0

#: Longest wait until all logged data has arrived, in seconds.
_FLUSH_S = 30.0


@dataclass(frozen=True)
class Target:
    """Where a recording goes: a file, the URL of a running viewer, a port for browsers; without any, a new viewer."""

    save:    Path | None = None
    connect: str | None  = None
    serve:   int | None  = None


class Recording:
    """A recording that goes to `target`.

    Raises
    ------
    MissingExtraError
        Rerun is not installed.
    ViewerError
        The file cannot be written, no viewer listens at the URL, or there is no display to start a viewer on.
    """

    def __init__(self, target: Target) -> None:
        self.rerun  = import_extra("rerun", "view", "the viewer needs")
        self.stream = self.rerun.RecordingStream("litestereo")
        #: URL of the page for browsers; empty if there is none.
        self.page   = ""
        # The file has its name at the end, if there is a frame in it: until then an older recording is there.
        self._begun   = False
        self._save    = target.save
        self._partial: Path | None = None
        try:
            self._begin(target)
        except (RuntimeError, OSError, ValueError) as error:
            raise ViewerError(f"the viewer cannot be reached: {' '.join(str(error).split())}") from None

    def _begin(self, target: Target) -> None:
        if target.save is not None:
            try:
                target.save.parent.mkdir(parents=True, exist_ok=True)
                self._partial = partial_of(target.save)
                self.stream.save(self._partial)
            except (RuntimeError, OSError):
                raise ViewerError(f"{target.save}: cannot be written") from None
        elif target.connect is not None:
            _probe(target.connect)
            self.stream.connect_grpc(target.connect)
        elif target.serve is not None:
            url = self.stream.serve_grpc(grpc_port=target.serve)
            self.rerun.serve_web_viewer(web_port=target.serve + 1, open_browser=False, connect_to=url)
            self.page = f"http://127.0.0.1:{target.serve + 1}/?url={urllib.parse.quote(url, safe='')}"
        else:
            _check_display()
            self.stream.spawn()

    def log(self, path: str, what: Any, static: bool = False) -> None:
        """Log a value of Rerun under `path`, at the time that was set last, or for all times if `static`."""
        self._begun |= not static
        self.stream.log(path, what, static=static)

    def close(self) -> None:
        """Wait until everything has arrived, for a bounded time; raise ViewerError if it does not arrive."""
        try:
            self.stream.flush(timeout_sec=_FLUSH_S)
        except RuntimeError as error:
            raise ViewerError(f"the viewer is gone: {' '.join(str(error).split())}") from None
        finally:
            self.stream.disconnect()
            self._finish()

    def _finish(self) -> None:
        """Give the file its name; raise ViewerError if that is impossible."""
        if self._save is not None and self._partial is not None:
            try:
                if self._begun:
                    finish(self._partial, self._save)
                elif self._partial != self._save:
                    self._partial.unlink(missing_ok=True)
            except OSError as error:
                raise ViewerError(f"{self._save}: cannot be written: {error.strerror or error}") from None
            self._partial = None


def _probe(url: str) -> None:
    """Raise ViewerError if no viewer listens at a URL: Rerun itself would try for ever."""
    try:
        parts = urllib.parse.urlsplit(url)
        host, port = parts.hostname, parts.port
    except ValueError:
        host, port = None, None
    if not host or not port or not parts.scheme.startswith("rerun"):
        raise ViewerError(f"'{url}' is not the URL of a viewer, {DEFAULT_URL} is one")
    try:
        socket.create_connection((host, port), _CONNECT_S).close()
    except OSError:
        raise ViewerError(f"no viewer listens at {host}:{port}: start it with `rerun`, or name another with "
                          "--connect") from None


def _check_display() -> None:
    """Raise ViewerError if there is no display for a viewer."""
    if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise ViewerError("there is no display to start the viewer on: use --save, --serve, --connect or --montage")
