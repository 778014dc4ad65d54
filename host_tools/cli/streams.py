#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The standard streams in any state: closed, full, a pipe that its reader has closed, or in ASCII.

A command prints as if all went well, and writes its files. What stdout did not accept is told at the end: one line on
stderr, and a status that is not 0. A closed stdout was closed on purpose, as of a daemon: it is no failure.
"""

from __future__ import annotations

import contextlib
import io
import os
import sys
from collections.abc import Iterator
from typing import Any, TextIO


def _open_descriptors() -> None:
    """Open descriptors 0 to 2 if they are closed: the next file would get that number, and foreign text written to it.
    """
    for number, flags in ((0, os.O_RDONLY), (1, os.O_WRONLY), (2, os.O_WRONLY)):
        try:
            os.fstat(number)
        except OSError:
            null = os.open(os.devnull, flags)
            if null != number: # pragma: no cover - the lowest closed number is taken, and lower ones are open now.
                os.dup2(null, number)
                os.close(null)


class GuardedStream(io.TextIOBase):
    """A text stream that keeps the first error of its writes in `error`, and discards what is written afterwards."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self.error: Exception | None = None
        # A name of a file may have characters that the encoding does not have.
        if stream.errors == "strict" and isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")

    def write(self, text: str) -> int:
        """Write a text, or keep the error."""
        if self.error is None:
            try:
                self._stream.write(text)
            except (OSError, ValueError) as error:
                self.error = error
        return len(text)

    def flush(self) -> None:
        """Flush, or keep the error."""
        if self.error is None:
            try:
                self._stream.flush()
            except (OSError, ValueError) as error:
                self.error = error

    def isatty(self) -> bool:
        """Return whether the stream is a terminal."""
        return self._stream.isatty()

    def fileno(self) -> int:
        """Return the descriptor of the stream."""
        return self._stream.fileno()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    @property
    def encoding(self) -> str: # type: ignore[override] # typeshed has a plain attribute
        """The encoding of the stream."""
        return self._stream.encoding

    @property
    def errors(self) -> str | None: # type: ignore[override] # the same
        """What happens to characters that the encoding does not have."""
        return self._stream.errors


class Streams:
    """Guarded stdout and stderr."""

    def __init__(self, stdout: GuardedStream, stderr: GuardedStream) -> None:
        self._stdout = stdout
        self._stderr = stderr

    @property
    def stdout_failed(self) -> bool:
        """Whether stdout has refused a text."""
        return self._stdout.error is not None

    def finish(self) -> bool:
        """Flush; return whether stdout has accepted all of it, and say on stderr why not."""
        self._stdout.flush()
        error = self._stdout.error
        # The reader of a pipe closes it on purpose: it has what it wanted.
        if error is not None and not isinstance(error, BrokenPipeError):
            reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
            print(f"litestereo: error: the output cannot be written to stdout: {reason}", file=self._stderr)
        self._stderr.flush()
        return error is None

    def discard_rest(self) -> None:
        """Point streams that have failed to /dev/null: Python flushes them at its end, and would fail again."""
        for stream in (self._stdout, self._stderr):
            if stream.error is not None:
                with contextlib.suppress(OSError, ValueError):
                    null = os.open(os.devnull, os.O_WRONLY)
                    os.dup2(null, stream.fileno())
                    os.close(null)


def stdout_failed() -> bool:
    """Return whether stdout has refused a text: a command that only prints has nothing more to do."""
    return isinstance(sys.stdout, GuardedStream) and sys.stdout.error is not None


@contextlib.contextmanager
def standard_streams() -> Iterator[Streams]:
    """Guard stdout and stderr in this context; a stream that is closed is /dev/null."""
    _open_descriptors()
    before = sys.stdout, sys.stderr
    with contextlib.ExitStack() as stack:
        def guarded(stream: TextIO | None) -> GuardedStream:
            if stream is None or stream.closed:
                stream = stack.enter_context(open(os.devnull, "w", encoding="utf-8"))
            return GuardedStream(stream)

        streams = Streams(guarded(sys.stdout), guarded(sys.stderr))
        sys.stdout, sys.stderr = streams._stdout, streams._stderr
        try:
            yield streams
        finally:
            sys.stdout, sys.stderr = before
            streams.discard_rest()
