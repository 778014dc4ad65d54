/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* A session under any sequence of requests from a serial line and two UDP peers, of noise on both, of time
 * that passes and of matches that end. At the end the device still answers a new host. */

#include <string.h>

#include "fake_frame_link.h"
#include "link/protocol/message.h"
#include "session_bench.h"
#include "session_requests.h"

static const peer_t peers[] = {
    {.udp = true, .address = 0xc0a80164, .port = 5000}, {.udp = true, .address = 0xc0a80165, .port = 5000},
};

/* A request on a line between two frames is answered once, unless it is no request, or the device is about to
 * restart. */
static void ask(const message_t *request)
{
    static uint8_t plain[PROTOCOL_MESSAGE_MAX], framed[COBS_ENCODED_MAX(PROTOCOL_MESSAGE_MAX) + 2];
    size_t   length = 1 + cobs_encode(plain, message_build(request, plain), framed + 1);
    unsigned before = replies;
    bool     fresh  = !line.in_frame;
    bool     heard  = !session.restarting || request->type == TYPE_RESTART;

    framed[length++] = 0;
    serial_link_receive(&line, ticks, framed, length);
    if (fresh) {
        HOLDS(replies == before + (heard && (request->type & PROTOCOL_REPLY_BIT) == 0));
    }
    if (replies > before && fresh) {
        HOLDS(reply.sequence == request->sequence && reply.frame_id == request->frame_id);
        HOLDS(reply.type == (request->type | PROTOCOL_REPLY_BIT)
            || (reply.type == TYPE_ERROR && reply.payload[2] == request->type));
    }
}

static void post(const peer_t *peer, const message_t *request)
{
    static uint8_t bytes[PROTOCOL_MESSAGE_MAX];

    fake_frame_link_receive(peer, bytes, message_build(request, bytes));
    bench_poll();
}

static void take_noise(input_t *input, const peer_t *peer)
{
    size_t         length = take(input);
    const uint8_t *bytes  = input->bytes;

    length = length < input->length ? length : input->length;
    input->bytes  += length;
    input->length -= length;
    if (peer == NULL) {
        serial_link_receive(&line, ticks, bytes, length);
    } else if (length > 0) {
        fake_frame_link_receive(peer, bytes, length);
    }
    bench_poll();
}

static void step(input_t *input)
{
    static uint8_t payload[PROTOCOL_CHUNK_SIZE];
    uint8_t        what = take(input);
    message_t      request;

    switch (what % 8) {
    case 0:
        take_noise(input, NULL);
        break;
    case 1:
        take_noise(input, &peers[what / 8 % 2]);
        break;
    case 2:
    case 3:
        request = take_request(input, &session, payload);
        ask(&request);
        break;
    case 4:
    case 5:
        request = take_request(input, &session, payload);
        post(&peers[what / 8 % 2], &request);
        break;
    case 6:
        ticks += what / 8 * (HZ / 4);
        bench_poll();
        break;
    default:
        bench_match(what / 8 != 1);
        bench_poll();
        break;
    }
}

/* In any case the device is free for another host after a silence, with all its slots. */
static void require_life(void)
{
    static const uint8_t nonce[4] = {1, 2, 3, 4};
    const message_t      hello    = {.version = PROTOCOL_VERSION, .type = TYPE_HELLO, .length = 4, .payload = nonce};

    for (unsigned round = 0; round < 8 * (PROTOCOL_SILENCE_S + 1); round++) {
        ticks += HZ / 8;
        bench_poll();
    }
    HOLDS(!line.in_frame);
    ask(&hello);
    HOLDS(reply.type == (TYPE_HELLO | PROTOCOL_REPLY_BIT) && session.open && !session.peer.udp);
    for (unsigned slot = 0; slot < FRAME_POOL_SLOTS; slot++) {
        HOLDS(pool.frame[slot].state == FRAME_EMPTY);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    input_t input = {data, size};

    bench_reset();
    while (input.length > 0) {
        step(&input);
        bench_check();
    }
    require_life();
    return 0;
}
