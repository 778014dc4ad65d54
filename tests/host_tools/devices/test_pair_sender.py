#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Pairs in order, step by step, on a link that is a list."""

from collections import deque

import numpy as np
import pytest

from litestereo.host_tools.core.errors import LinkTimeout
from litestereo.host_tools.devices.udp.pair_sender import PairSender
from litestereo.host_tools.devices.udp.upload import UploadWindow
from litestereo.host_tools.link.link import Call
from litestereo.host_tools.link.settings import LinkCounters
from litestereo.host_tools.protocol.messages import NO_OFFSET, Message, MessageType
from litestereo.host_tools.protocol.payloads import FrameState, FrameStatus

WIDTH, HEIGHT = 100, 512
CHUNKS        = 2*WIDTH*HEIGHT // 1024

#: Chunks of a batch before anything has been learnt.
BATCH = 16


class ListLink:
    """Link and channel: `sent` holds the numbers of the chunks that were sent, `calls` the requests after them."""

    def __init__(self):
        self.session   = 1
        self.counters  = LinkCounters()
        self.max_tries = 5
        self.sent      = []
        self.calls     = deque()
        self.content   = {}

    def next_sequence(self):
        return 0

    def send_chunk(self, session, sequence, frame_id, offset, chunk, kind):
        assert (session, frame_id, kind, offset % 1024) == (1, 7, MessageType.PAIRS, 0)
        self.sent.append(offset // 1024)
        self.content[offset] = bytes(chunk)

    def submit(self, kind, frame_id, urgent):
        assert (kind, frame_id, urgent) == (MessageType.STATUS, 7, True)
        call = Call(Message(kind, frame_id=frame_id), b"", 0, None, ())
        self.calls.append(call)
        return call

    def drop(self, call):
        if call in self.calls:
            self.calls.remove(call)

    def flush(self):
        pass

    def take_sent(self):
        sent, self.sent = self.sent, []
        return sent

    def answer(self, wanted, state=FrameState.MATCHING, which=0):
        """Answer a request, by default the oldest: `wanted` is a chunk, or None."""
        call   = self.calls[which]
        offset = NO_OFFSET if wanted is None else 1024*wanted
        self.calls.remove(call)
        call.on_reply(call.request.reply(FrameStatus(state, 0, 0, 0, 0, offset).pack()))


@pytest.fixture
def link():
    return ListLink()


@pytest.fixture
def sender(link):
    rng  = np.random.default_rng(1)
    pair = tuple(rng.integers(0, 256, (HEIGHT, WIDTH), np.uint8) for _ in range(2))
    both = memoryview(np.stack(pair, axis=-1).tobytes())
    one  = PairSender(link, link, UploadWindow(), 7, both, None, lambda status: None)
    one.pair = pair
    one.fill()
    return one


def chunks(first, last):
    return list(range(first, last))


def test_three_batches_are_on_their_way_and_each_that_arrives_makes_room_for_another(link, sender):
    assert link.take_sent() == chunks(0, 3*BATCH) and len(link.calls) == 3
    sender.fill()
    assert link.take_sent() == []
    link.answer(BATCH)
    sender.fill()
    # A batch without a loss is followed by a larger one.
    assert link.take_sent() == chunks(3*BATCH, 4*BATCH + 2) and len(link.calls) == 3
    while not sender.done:
        link.answer(None if len(link.content) == CHUNKS and len(link.calls) == 1 else max(link.content) // 1024,
                    which=len(link.calls) - 1)
        sender.fill()
    left, right = sender.pair
    assert b"".join(link.content[offset] for offset in sorted(link.content)) \
        == np.stack([left, right], axis=-1).tobytes()
    assert not link.calls and link.counters.chunks_sent == CHUNKS


def test_the_reply_to_a_later_question_answers_the_earlier_ones(link, sender):
    link.take_sent()
    link.answer(3*BATCH, which=2)
    assert not link.calls
    sender.fill()
    assert link.take_sent()[0] == 3*BATCH


def test_after_a_loss_everything_is_sent_once_more_and_only_once(link, sender):
    link.take_sent()
    link.answer(5)
    sender.fill()
    # Half a batch, as much of it was lost.
    assert link.take_sent() == chunks(5, 5 + BATCH // 2)
    # What was on its way shows the same loss, which is known.
    link.answer(5)
    sender.fill()
    assert link.take_sent() == chunks(5 + BATCH // 2, 5 + BATCH)
    link.answer(5)
    sender.fill()
    assert link.take_sent() == chunks(5 + BATCH, 5 + 3*BATCH // 2)
    assert link.counters.chunks_sent_again == 3*BATCH // 2
    # And again, if it is lost again.
    link.answer(6)
    sender.fill()
    assert link.take_sent()[0] == 6


def test_what_arrives_late_is_not_sent_again(link, sender):
    link.take_sent()
    link.answer(5)
    link.answer(2*BATCH)
    sender.fill()
    assert link.take_sent()[0] == 2*BATCH


def test_the_end_of_the_frame_ends_all_questions(link, sender):
    link.answer(None, FrameState.DONE)
    assert sender.done and not link.calls
    sender.fill()
    assert max(link.take_sent()) < 3*BATCH


@pytest.mark.parametrize("state", [FrameState.READY, FrameState.FAILED])
def test_the_status_of_a_frame_that_is_not_matched_is_ignored(link, sender, state):
    link.answer(None, state)
    assert not sender.done


def test_a_network_that_carries_nothing_is_given_up(link, sender):
    with pytest.raises(LinkTimeout, match="datagrams of 1052 bytes"):
        for _ in range(100):
            link.answer(0)
            sender.fill()
    sender.forget()
    assert not link.calls
