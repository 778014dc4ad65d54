/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "counters.h"

static const char *const names[COUNTERS] = {
    [COUNTER_MESSAGES_RECEIVED]     = "messages_received",
    [COUNTER_MESSAGES_SENT]         = "messages_sent",
    [COUNTER_BYTES_RECEIVED]        = "bytes_received",
    [COUNTER_FRAMING_ERRORS]        = "framing_errors",
    [COUNTER_CRC_ERRORS]            = "crc_errors",
    [COUNTER_HEADER_ERRORS]         = "header_errors",
    [COUNTER_REQUESTS_REFUSED]      = "requests_refused",
    [COUNTER_RECEIVE_TIMEOUTS]      = "receive_timeouts",
    [COUNTER_SESSIONS]              = "sessions",
    [COUNTER_FRAMES_OPENED]         = "frames_opened",
    [COUNTER_FRAMES_MATCHED]        = "frames_matched",
    [COUNTER_FRAMES_FAILED]         = "frames_failed",
    [COUNTER_FRAMES_RELEASED]       = "frames_released",
    [COUNTER_FRAMES_RECLAIMED]      = "frames_reclaimed",
    [COUNTER_CHUNKS_RECEIVED]       = "chunks_received",
    [COUNTER_CHUNKS_REPEATED]       = "chunks_repeated",
    [COUNTER_CHUNKS_WHILE_MATCHING] = "chunks_while_matching",
    [COUNTER_MATCHER_INTERRUPTS]    = "matcher_interrupts",
    [COUNTER_MATCHER_TIMEOUTS]      = "matcher_timeouts",
    [COUNTER_CONSOLE_LINES]         = "console_lines",
    [COUNTER_SESSIONS_REFUSED]      = "sessions_refused",
    [COUNTER_DATAGRAMS_RECEIVED]    = "datagrams_received",
    [COUNTER_DATAGRAMS_SENT]        = "datagrams_sent",
    [COUNTER_DATAGRAMS_MALFORMED]   = "datagrams_malformed",
    [COUNTER_DATAGRAMS_OVERRUN]     = "datagrams_overrun",
    [COUNTER_MAILBOX_OVERRUN]       = "mailbox_overrun",
    [COUNTER_UPLOADS_FOREIGN]       = "uploads_foreign",
    [COUNTER_UPLOADS_UNFIT]         = "uploads_unfit",
};

const char *counter_name(enum counter counter)
{
    return names[counter];
}
