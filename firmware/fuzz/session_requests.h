/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Requests drawn from an input: most fields fit the session's state, so that short inputs get far. */

#ifndef SESSION_REQUESTS_H
#define SESSION_REQUESTS_H

#include "fuzz.h"
#include "link/session.h"

/** The next request of the input; its payload, of at most PROTOCOL_CHUNK_SIZE bytes, goes to `payload`. */
message_t take_request(input_t *input, const session_t *session, uint8_t *payload);

#endif
