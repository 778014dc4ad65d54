/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* From the end of a job to its result. */

#include "litestereo/stereo.h"

#include <stddef.h>

#include "stereo_control.h"

static stereo_error_t read_error(void)
{
    return (stereo_error_t)((stereo_status_read() >> 8) & 0xf);
}

static status_t give_up(stereo_t *stereo, uint64_t clock, stereo_result_t *result)
{
    uint64_t waited = clock - stereo->started;

    stereo->statistics.timeouts++;
    stereo_stop(stereo);
    result->error  = read_error();
    result->clocks = waited < UINT32_MAX ? (uint32_t)waited : UINT32_MAX;
    return STATUS_TIMEOUT;
}

static status_t fail(stereo_t *stereo, stereo_error_t error)
{
    switch (error) {
    case STEREO_ERROR_CONFIG:  stereo->statistics.config_errors++; break;
    case STEREO_ERROR_ABORTED: stereo->statistics.aborted++;       break;
    default:                   stereo->statistics.bus_errors++;    break;
    }
    return STATUS_MATCHER;
}

static status_t succeed(stereo_t *stereo, stereo_result_t *result)
{
    stereo_statistics_t *statistics = &stereo->statistics;

    result->clocks           = stereo_clocks_read();
    result->first_row_clocks = stereo_first_row_clocks_read();
    statistics->done++;
    statistics->clocks += result->clocks;
    if (result->clocks > statistics->longest_clocks) {
        statistics->longest_clocks = result->clocks;
    }
    memory_from_device();
    return STATUS_OK;
}

/* Looks at the gateware itself. */
static status_t look(stereo_t *stereo, uint64_t clock, stereo_result_t *result)
{
    *result = (stereo_result_t){0};
    if (stereo_is_busy()) {
        return clock - stereo->started > stereo->budget ? give_up(stereo, clock, result) : STATUS_BUSY;
    }
    stereo->busy  = false;
    stereo->event = false;
    result->error = read_error();
    return result->error == STEREO_ERROR_NONE ? succeed(stereo, result) : fail(stereo, result->error);
}

status_t stereo_poll(stereo_t *stereo, uint64_t clock, stereo_result_t *result)
{
    bool     silent = !stereo->event;
    status_t status;

    if (!stereo->busy) {
        return STATUS_IDLE;
    }
    if (silent && clock - stereo->started <= stereo->budget) {
        return STATUS_BUSY;
    }
    status = look(stereo, clock, result);
    /* Late but not busy: the interrupt was lost, and the frame is there all the same. */
    if (silent && (status == STATUS_OK || status == STATUS_MATCHER)) {
        stereo->statistics.lost_interrupts++;
    }
    return status;
}

status_t stereo_wait(stereo_t *stereo, stereo_result_t *result)
{
    status_t status;

    do {
        status = stereo->busy ? look(stereo, clock_now(), result) : STATUS_IDLE;
    } while (status == STATUS_BUSY);
    return status;
}
