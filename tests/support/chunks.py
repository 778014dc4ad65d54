#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The number of chunks of a frame."""

from __future__ import annotations

from litestereo.host_tools.protocol.messages import CHUNK_BYTES


def image_chunks(width: int, height: int) -> int:
    """Return the number of chunks of a stored frame, whose images each start a new chunk."""
    return 2*-(-width*height // CHUNK_BYTES)


def pair_chunks(width: int, height: int) -> int:
    """Return the number of chunks of a streamed frame's pixel pairs, or of a map's parts: 2 bytes per pixel."""
    return -(-2*width*height // CHUNK_BYTES)
