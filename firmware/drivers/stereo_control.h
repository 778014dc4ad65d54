/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* What the parts of the matcher's driver share. */

#ifndef LITESTEREO_DRIVERS_STEREO_CONTROL_H
#define LITESTEREO_DRIVERS_STEREO_CONTROL_H

#include "litestereo/stereo.h"
#include "platform.h"

#define CONTROL_START (1u << 0)
#define CONTROL_ABORT (1u << 1)
#define STATE_BUSY    (1u << 0)

/** Whether the gateware is at work. */
static inline bool stereo_is_busy(void)
{
    return (stereo_status_read() & STATE_BUSY) != 0;
}

/** Forgets ends that were not seen. */
void stereo_clear_events(stereo_t *stereo);

/** Stops what runs; STATUS_TIMEOUT if it does not stop. */
status_t stereo_stop(stereo_t *stereo);

#endif
