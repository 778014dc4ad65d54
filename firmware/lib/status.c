/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "litestereo/status.h"

const char *status_name(status_t status)
{
    /* No default: the compiler misses a new status. */
    switch (status) {
    case STATUS_OK:
        return "ok";
    case STATUS_BAD_ARGUMENT:
        return "bad_argument";
    case STATUS_UNSUPPORTED:
        return "unsupported";
    case STATUS_IDLE:
        return "idle";
    case STATUS_BUSY:
        return "busy";
    case STATUS_STATE:
        return "state";
    case STATUS_SIZE:
        return "size";
    case STATUS_NO_SLOT:
        return "no_slot";
    case STATUS_OFFSET:
        return "offset";
    case STATUS_LENGTH:
        return "length";
    case STATUS_INCOMPLETE:
        return "incomplete";
    case STATUS_MATCHER:
        return "matcher";
    case STATUS_TIMEOUT:
        return "timeout";
    case STATUS_FRAMING:
        return "framing";
    case STATUS_HEADER:
        return "header";
    case STATUS_CRC:
        return "crc";
    case STATUS_PROTECTED:
        return "protected";
    case STATUS_NO_RECORD:
        return "no_record";
    case STATUS_ROWS:
        return "rows";
    }
    return "unknown";
}
