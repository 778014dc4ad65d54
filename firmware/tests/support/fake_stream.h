/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The way of streamed frames in the fake frame link: pairs to the matcher, and parts of its map to the wire. */

#ifndef FAKE_STREAM_H
#define FAKE_STREAM_H

#include <stdbool.h>
#include <stdint.h>

#include "link/protocol/message.h"
#include "link/protocol/peer.h"

/** What becomes of PAIRS. */
typedef enum {
    FAKE_STREAM_TAKEN,
    FAKE_STREAM_REPEATED,
    FAKE_STREAM_UNFIT,
} fake_stream_fate_t;

/** The staging registers. */
typedef struct {
    uint32_t frame_id, pixels, sequence;
} fake_stream_staged_t;

/** What the next frame will be. */
extern fake_stream_staged_t fake_stream_staged;

/** Forgets everything. */
void fake_stream_reset(void);

/** The pulses of the control register. */
void fake_stream_open(uint32_t token, const peer_t *peer);
void fake_stream_close(void);

/** The status register and the one of the offset. */
uint8_t fake_stream_status(void);
uint32_t fake_stream_offset(void);

/** Judges PAIRS of the session's peer, and takes them if they are the next ones. */
fake_stream_fate_t fake_stream_take(const message_t *message);

/** All pairs of the frame, left and right pixel alternating, once they are in; null until then. */
const uint8_t *fake_stream_pairs(void);

/** The matcher gives its map, `size` bytes, to be sent in parts; of no use if the way has been closed. */
void fake_stream_map(const void *map, uint32_t size);

/** Lets parts go out by `send`, which returns false while it cannot. */
void fake_stream_advance(bool (*send)(const peer_t *peer, const message_t *message));

/** Whether parts have not gone out. */
bool fake_stream_sending(void);

#endif
