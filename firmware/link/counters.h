/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#ifndef LITESTEREO_LINK_COUNTERS_H
#define LITESTEREO_LINK_COUNTERS_H

#include <stdint.h>

/** Places of the counters in the reply to STATISTICS; docs/protocol.md says what each one counts. */
enum counter {
    COUNTER_MESSAGES_RECEIVED,
    COUNTER_MESSAGES_SENT,
    COUNTER_BYTES_RECEIVED,
    COUNTER_FRAMING_ERRORS,
    COUNTER_CRC_ERRORS,
    COUNTER_HEADER_ERRORS,
    COUNTER_REQUESTS_REFUSED,
    COUNTER_RECEIVE_TIMEOUTS,
    COUNTER_SESSIONS,
    COUNTER_FRAMES_OPENED,
    COUNTER_FRAMES_MATCHED,
    COUNTER_FRAMES_FAILED,
    COUNTER_FRAMES_RELEASED,
    COUNTER_FRAMES_RECLAIMED,
    COUNTER_CHUNKS_RECEIVED,
    COUNTER_CHUNKS_REPEATED,
    COUNTER_CHUNKS_WHILE_MATCHING,
    COUNTER_MATCHER_INTERRUPTS,
    COUNTER_MATCHER_TIMEOUTS,
    COUNTER_CONSOLE_LINES,
    COUNTER_SESSIONS_REFUSED,
    COUNTER_DATAGRAMS_RECEIVED,
    COUNTER_DATAGRAMS_SENT,
    COUNTER_DATAGRAMS_MALFORMED,
    COUNTER_DATAGRAMS_OVERRUN,
    COUNTER_MAILBOX_OVERRUN,
    COUNTER_UPLOADS_FOREIGN,
    COUNTER_UPLOADS_UNFIT,
    COUNTERS,
};

/** All counters of the device, each since reset, modulo 2**32. */
typedef struct {
    uint32_t value[COUNTERS];  /**< Indexed by enum counter. */
} counters_t;

/** Adds one to a counter. */
static inline void count(counters_t *counters, enum counter counter)
{
    counters->value[counter]++;
}

/** Name of a counter as docs/protocol.md spells it; `counter` is 0 to COUNTERS - 1. */
const char *counter_name(enum counter counter);

#endif
