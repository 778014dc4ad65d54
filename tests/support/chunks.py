#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""In how many chunks a frame travels."""

from __future__ import annotations

from litestereo.host_tools.protocol.messages import CHUNK_BYTES


def image_chunks(width: int, height: int) -> int:
    """Return the chunks of a stored frame, whose two images begin with a chunk each."""
    return 2*-(-width*height // CHUNK_BYTES)


def pair_chunks(width: int, height: int) -> int:
    """Return the chunks of a streamed frame's pixel pairs, and the parts of any frame's map: 2 bytes per pixel."""
    return -(-2*width*height // CHUNK_BYTES)
