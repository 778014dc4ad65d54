/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* A session whose memory detects stray writes, and helpers that send it requests. */

#ifndef FIXTURE_H
#define FIXTURE_H

#include "lib/bytes.h"
#include "link/session.h"

#define SLOTS   3
#define CANARY  0xa5

/** The session under test. */
extern session_t session;
/** Its frames. */
extern frame_pool_t pool;
/** Its counters. */
extern counters_t counters;
/** Its description of the device; change it before set_up(). */
extern device_info_t device_info;
/** Number of matches that it stopped. */
extern unsigned stops;
/** Token in requests. */
extern uint32_t token;
/** The last reply and its payload. */
extern message_t reply;
/** Sender of requests; the serial line after set_up(). */
extern peer_t peer;
/** Clock of the last request; each is 1000 clocks after the previous one. */
extern uint64_t uptime;

/** A new session server, without a session; memory is all canaries. */
void set_up(void);

/** Sends a HELLO and keeps the token. */
void hello(uint32_t nonce);

/** Sends a request; returns whether there is a reply, which is in `reply`. */
bool request(uint8_t type, uint32_t frame_id, uint32_t offset, const void *payload, uint32_t length);

/** Sends a request that has a reply; returns the type of the reply, which is in `reply`. */
uint8_t ask(uint8_t type, uint32_t frame_id, uint32_t offset, const void *payload, uint32_t length);

/** Opens a frame of this size; returns the type of the reply. */
uint8_t open_frame(uint32_t frame_id, uint16_t width, uint16_t height);

/** Brings a new frame of 61 x 43 pixels to a state. */
frame_t *make_frame(uint32_t frame_id, frame_state_t state);

/** Requires that the last reply was this error. */
void require_error(enum protocol_error code, uint32_t detail);

/** Requires that the memory of all slots is as at the last save_memory(). */
void require_untouched(void);

/** Saves the memory of all slots for require_untouched(). */
void save_memory(void);

#endif
