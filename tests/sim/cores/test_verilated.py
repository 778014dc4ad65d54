#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""How models are built."""

from __future__ import annotations

from pathlib import Path

from litex.soc.interconnect import stream

from litestereo.sim.cores.stream_core import StreamCore


def test_runtime_is_compiled_once():
    """Verilator's runtime comes from another build: no file compiled here depends on its sources."""
    core   = StreamCore(stream.SyncFIFO([("data", 7)], 3), [])
    folder = Path(core._library._name).parent
    assert (folder / "verilated.o").is_file()
    assert (folder / "Vcore__ALL.d").is_file()
    assert not (folder / "verilated.d").exists()
