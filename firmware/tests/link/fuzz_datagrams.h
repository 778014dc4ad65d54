/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Datagrams as the session's host, strangers and a bad network send them, drawn from a seed. */

#ifndef FUZZ_DATAGRAMS_H
#define FUZZ_DATAGRAMS_H

#include <stddef.h>
#include <stdint.h>

#include "link/protocol/peer.h"
#include "link/session.h"

/** Most bytes of a datagram. */
#define FUZZ_MAX 1200u

/** Largest id of frames in the datagrams; ids begin at 1. */
#define FUZZ_FRAMES 6u

/** A datagram and its sender. */
typedef struct {
    peer_t  peer;
    uint8_t bytes[FUZZ_MAX];
    size_t  length;
} fuzz_datagram_t;

/** Prepares the noise from which chunks are taken. */
void fuzz_prepare(unsigned *random);

/** Contents of the chunk of images or pairs at this offset of this frame: PROTOCOL_CHUNK_SIZE distinct bytes. */
const uint8_t *fuzz_chunk(uint32_t frame_id, uint32_t offset);

/** Draws the next datagram, often one that advances the session. */
void fuzz_datagram(unsigned *random, const session_t *session, fuzz_datagram_t *datagram);

#endif
