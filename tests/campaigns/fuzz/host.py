#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Fuzz targets of the host tools: each reads the bytes of a file; another error than the documented ones is a fault."""

from __future__ import annotations

from collections.abc import Callable

from . import host_cameras

#: All targets by their names. Another module of files has to add its own here, and its seeds to `SEEDS`.
TARGETS: dict[str, Callable[[bytes], None]] = {**host_cameras.TARGETS}

#: Valid files, from which the inputs are made.
SEEDS: dict[str, list[bytes]] = {**host_cameras.SEEDS}
