#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""A core in Verilator, in this process: the common base of its drivers."""

from __future__ import annotations

import ctypes
import itertools
import os
import weakref
from pathlib import Path

from ...soc.build.paths import build_directory
from .verilated import TRACE_OPTIONS, PortsTop, build_library

_numbers = itertools.count()


def coverage_directory() -> Path:
    """Return the folder of the models' coverage counters, with a folder per core, if `LITESTEREO_COVERAGE` is set."""
    return build_directory() / os.environ.get("LITESTEREO_COVERAGE_DIRECTORY", "coverage")


def waveform_file(core: str, trace: Path | None) -> Path | None:
    """Return the file for the waveform of a model, or None if none is wanted.

    Parameters
    ----------
    core
        Name of the core's class.
    trace
        The file that was asked for. If None, `LITESTEREO_TRACE` names a folder, which gets a file for each model,
        called after the core and numbered.

    Raises
    ------
    ValueError
        The file ends otherwise than those of `TRACE_OPTIONS`.
    OSError
        The file cannot be written.
    """
    folder = os.environ.get("LITESTEREO_TRACE")
    if trace is None and folder:
        trace = Path(folder) / f"{core}-{os.getpid()}-{next(_numbers)}.fst"
    if trace is not None:
        if trace.suffix not in TRACE_OPTIONS:
            raise ValueError(f"a waveform is a file that ends in {' or '.join(TRACE_OPTIONS)}, not {trace}")
        trace.parent.mkdir(parents=True, exist_ok=True)
        trace.open("wb").close() # Verilator would end the program if it could not open it.
    return trace


def _free(library: ctypes.CDLL, core: ctypes.c_void_p, counts: Path | None, process: int) -> None:
    # A forked process has copies of its parent's models: only the parent frees them.
    if os.getpid() != process:
        return
    if counts is None:
        library.core_free(core, b"")
    else:
        # Verilator would end the program if it could not open the file.
        counts.mkdir(parents=True, exist_ok=True)
        library.core_free(core, str(counts / f"{process}-{next(_numbers)}.dat").encode())


class VerilatedCore:
    """The model of a core. `close` frees it, or the end of this object or of the program.

    Parameters
    ----------
    top
        Top level around the core.
    header, bench
        See `build_library`.
    trace
        File for the waveform of all that the model does: see `waveform_file`. It is whole once the model is freed.
    """
    def __init__(self, top: PortsTop, header: str, bench: str, trace: Path | None = None) -> None:
        self.waveform = waveform_file(type(top.core).__name__, trace)
        path          = build_library(top, header, bench, self.waveform.suffix if self.waveform else "")
        self._library = ctypes.CDLL(str(path))
        self._library.core_new.restype   = ctypes.c_void_p
        self._library.core_new.argtypes  = [ctypes.c_char_p]
        self._library.core_free.argtypes = [ctypes.c_void_p, ctypes.c_char_p]
        self._core    = ctypes.c_void_p(self._library.core_new(str(self.waveform or "").encode()))
        # Whether a model counts is settled as it is built: the variable may be another when it is freed.
        counts        = coverage_directory() / type(top.core).__name__ / path.parents[1].name
        self._end     = weakref.finalize(self, _free, self._library, self._core,
                                         counts if os.environ.get("LITESTEREO_COVERAGE") else None, os.getpid())

    def close(self) -> None:
        """Free the model; it cannot be used afterwards."""
        self._end()
