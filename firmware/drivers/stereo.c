/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "litestereo/stereo.h"

#include <stddef.h>

#include "stereo_control.h"

#define EVENT_DONE    (1u << 0)
#define EVENT_ERROR   (1u << 1)

/* Clocks in which an abort has to come through: the longest burst, many times over. */
#define ABORT_BUDGET 100000u

void stereo_clear_events(stereo_t *stereo)
{
    stereo_ev_pending_write(EVENT_DONE | EVENT_ERROR);
    stereo->event = false;
}

status_t stereo_stop(stereo_t *stereo)
{
    uint64_t begin = clock_now();

    stereo->busy = false;
    while (stereo_is_busy()) {
        /* Again and again, as the gateware does not listen while it checks the settings of a frame. */
        stereo_control_write(CONTROL_ABORT);
        if (clock_now() - begin > ABORT_BUDGET) {
            stereo->statistics.stuck++;
            return STATUS_TIMEOUT;
        }
    }
    stereo_clear_events(stereo);
    return STATUS_OK;
}

static bool capabilities_make_sense(const stereo_capabilities_t *can)
{
    const stereo_limits_t *limits = &can->limits;

    return can->version >> 8 == STEREO_GATEWARE_VERSION >> 8 && can->version >= STEREO_GATEWARE_VERSION
        && can->max_width > 0 && limits->max_disparities >= 16 && limits->max_disparities % 16 == 0
        && limits->min_block_size % 2 == 1 && limits->max_block_size % 2 == 1
        && limits->min_block_size <= limits->max_block_size
        && (limits->features & (STEREO_FEATURE_XSOBEL | STEREO_FEATURE_RAW)) != 0
        && can->dma_alignment > 0 && STEREO_MAX_ALIGNMENT % can->dma_alignment == 0;
}

status_t stereo_init(stereo_t *stereo)
{
    uint32_t block_sizes;
    status_t status;

    if (stereo == NULL) {
        return STATUS_BAD_ARGUMENT;
    }
    block_sizes = stereo_block_sizes_read();
    *stereo = (stereo_t){
        .capabilities = {
            .version         = (uint16_t)stereo_version_read(),
            .max_width       = (uint16_t)stereo_max_width_read(),
            .max_height      = STEREO_MAX_HEIGHT,
            .limits          = {
                .max_disparities = (uint16_t)stereo_max_disparities_read(),
                .min_block_size  = (uint8_t)block_sizes,
                .max_block_size  = (uint8_t)(block_sizes >> 8),
                .features        = stereo_features_read(),
            },
            .dma_alignment   = stereo_dma_alignment_read(),
        },
    };
    if (!capabilities_make_sense(&stereo->capabilities)) {
        return STATUS_UNSUPPORTED;
    }
    status = stereo_stop(stereo);
    stereo_ev_enable_write(EVENT_DONE | EVENT_ERROR);
    return status;
}

void stereo_on_end(stereo_t *stereo, stereo_handler_t handler, void *context)
{
    /* The interrupt may come between any two of them, and finds no handler with the context of another. */
    stereo->handler = NULL;
    stereo->context = context;
    stereo->handler = handler;
}

status_t stereo_abort(stereo_t *stereo)
{
    if (stereo->busy) {
        stereo->statistics.aborted++;
    }
    return stereo_stop(stereo);
}

void stereo_isr(stereo_t *stereo)
{
    uint32_t         pending = stereo_ev_pending_read();
    stereo_handler_t handler = stereo->handler;

    /* Cleared before anything else, so that what happens meanwhile is pending again. */
    stereo_ev_pending_write(pending);
    if (pending == 0) {
        return;
    }
    stereo->event = true;
    stereo->statistics.interrupts++;
    if (handler != NULL) {
        handler(stereo->context);
    }
}
