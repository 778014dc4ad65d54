/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The path of streamed frames in the fake frame link: pairs to the matcher, and parts of its map to the wire. */

#ifndef FAKE_STREAM_H
#define FAKE_STREAM_H

#include <stdbool.h>
#include <stdint.h>

#include "link/protocol/message.h"
#include "link/protocol/peer.h"

/** Outcome of PAIRS. */
typedef enum {
    FAKE_STREAM_TAKEN,
    FAKE_STREAM_REPEATED,
    FAKE_STREAM_UNFIT,
} fake_stream_fate_t;

/** The staging registers. */
typedef struct {
    uint32_t frame_id, pixels, sequence;
} fake_stream_staged_t;

/** Staged for the next frame. */
extern fake_stream_staged_t fake_stream_staged;

/** Resets it. */
void fake_stream_reset(void);

/** The pulses of the control register. */
void fake_stream_open(uint32_t token, const peer_t *peer);
void fake_stream_close(void);

/** The registers of status and offset. */
uint8_t fake_stream_status(void);
uint32_t fake_stream_offset(void);

/** Checks PAIRS of the session's peer, and accepts them if they are the next ones. */
fake_stream_fate_t fake_stream_take(const message_t *message);

/** All pairs of the frame, left and right pixel alternating, once they have arrived; null until then. */
const uint8_t *fake_stream_pairs(void);

/** Passes the matcher's map, `size` bytes, to be sent in parts; dropped if the path has been closed. */
void fake_stream_map(const void *map, uint32_t size);

/** Sends parts by `send`, which returns false while it cannot send. */
void fake_stream_advance(bool (*send)(const peer_t *peer, const message_t *message));

/** Whether parts remain to be sent. */
bool fake_stream_sending(void);

#endif
