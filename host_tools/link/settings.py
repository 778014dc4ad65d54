#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Limits of a link, and its counters."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class LinkSettings:
    """Limits of a link.

    Parameters
    ----------
    window_bytes
        Most bytes of requests in flight, and of their replies.
    window_requests
        Most requests in flight: a device has room for as many that wait.
    timeout_floor_s
        Serial line only: seconds without any reply after which a request is sent again, in addition to the time that
        the bytes in flight may take.
    initial_bytes_per_s
        Serial line only: assumed speed until it has been measured, that of a slow simulation.
    silence_limit_s
        Seconds without a reply, even a broken one, after which the link gives up. Time in which the program was
        suspended does not count.
    hello_limit_s
        The same while a session begins, and the longest wait for a device that another host uses.
    max_tries
        Number of times that one request is sent before the link gives up.
    """

    window_bytes:        int   = 4096
    window_requests:     int   = 8
    timeout_floor_s:     float = 1.0
    initial_bytes_per_s: float = 2000.0
    silence_limit_s:     float = 30.0
    hello_limit_s:       float = 15.0
    max_tries:           int   = 20


@dataclass
class LinkCounters:
    """What happened on the host's side of a link.

    Parameters
    ----------
    requests, retransmissions
        Requests, and how often one of them was sent again.
    timeouts
        Time limits that passed without a reply.
    stale_replies
        Replies to no request that is waiting for one.
    chunks_sent, chunks_sent_again
        UDP only: chunks of images, and how often one of them was sent again.
    parts_received, parts_repeated, parts_asked_again
        UDP only: parts of maps, those of them that came once more, and those that were requested once more.
    bytes_uploaded, bytes_downloaded, upload_s, download_s
        Bytes of images and maps that arrived, and the seconds that this took.
    """

    requests:          int   = 0
    retransmissions:   int   = 0
    timeouts:          int   = 0
    stale_replies:     int   = 0
    chunks_sent:       int   = 0
    chunks_sent_again: int   = 0
    parts_received:    int   = 0
    parts_repeated:    int   = 0
    parts_asked_again: int   = 0
    bytes_uploaded:    int   = 0
    bytes_downloaded:  int   = 0
    upload_s:          float = 0.0
    download_s:        float = 0.0

    @property
    def repairs(self) -> int:
        """Return how often something had to be sent again, or requested again."""
        return self.retransmissions + self.chunks_sent_again + self.parts_asked_again
