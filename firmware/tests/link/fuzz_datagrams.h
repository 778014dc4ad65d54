/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Datagrams as friends, strangers and a bad network send them. All of it follows from a seed. */

#ifndef FUZZ_DATAGRAMS_H
#define FUZZ_DATAGRAMS_H

#include <stddef.h>
#include <stdint.h>

#include "link/protocol/peer.h"
#include "link/session.h"

/** Most bytes of a datagram. */
#define FUZZ_MAX 1200u

/** Frames that are talked about have ids from 1 to this. */
#define FUZZ_FRAMES 6u

/** A datagram and who sends it. */
typedef struct {
    peer_t  peer;
    uint8_t bytes[FUZZ_MAX];
    size_t  length;
} fuzz_datagram_t;

/** Makes the noise that chunks are cut from. */
void fuzz_prepare(unsigned *random);

/** What every chunk of that frame and offset holds, of images or of pairs, PROTOCOL_CHUNK_SIZE bytes: a misplaced one is seen. */
const uint8_t *fuzz_chunk(uint32_t frame_id, uint32_t offset);

/** Makes the next datagram, often one that does the session some good. */
void fuzz_datagram(unsigned *random, const session_t *session, fuzz_datagram_t *datagram);

#endif
