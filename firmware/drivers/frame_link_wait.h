/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Bounded waits for the gateware of the frame link. */

#ifndef LITESTEREO_DRIVERS_FRAME_LINK_WAIT_H
#define LITESTEREO_DRIVERS_FRAME_LINK_WAIT_H

#include <stdbool.h>

#include "litestereo/status.h"
#include "platform.h"

/* Clocks in which the gateware has to do what takes it microseconds. */
#define WAIT_BUDGET 100000u

/* Waits while `condition` holds; STATUS_TIMEOUT if it does for too long. */
static inline status_t wait_while(bool (*condition)(void))
{
    uint64_t begin = clock_now();

    while (condition()) {
        if (clock_now() - begin > WAIT_BUDGET) {
            return STATUS_TIMEOUT;
        }
    }
    return STATUS_OK;
}

#endif
