/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The trial of a firmware that an update has written to flash.
 *
 * The boot program starts the new firmware with the watchdog running, and counts its starts in a register that a reset
 * does not change. The firmware confirms itself when it works. If it is reset TRIAL_STARTS times before that, by a crash,
 * the watchdog or itself, the boot program starts the old firmware again, which is in another image, and records that
 * the new one has failed. A power failure clears the count.
 *
 * A program takes part if its tag says so (CONFIRMS=1 on the command line of make). It then has to feed the watchdog or to
 * pause it within TRIAL_WATCHDOG_S, and to call the functions below. Another program is started without a trial. */

#ifndef LITESTEREO_TRIAL_H
#define LITESTEREO_TRIAL_H

#include <stdbool.h>
#include <stdint.h>

#include "litestereo/records.h"
#include "litestereo/reset.h"
#include "litestereo/status.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Starts without a confirmation after which the old firmware is started. */
#define TRIAL_STARTS 3u

/** Seconds from its start on in which a firmware on trial has to feed the watchdog. */
#define TRIAL_WATCHDOG_S 5u

/** Seconds of a main loop that confirm a firmware. */
#define TRIAL_S 60u

/** What has become of the newest firmware, as the link protocol numbers it. */
typedef enum {
    TRIAL_NONE      = 0,  /**< Unknown: no firmware has been replaced, or there is no place for records. */
    TRIAL_RUNNING   = 1,  /**< It is on trial, or will be at the next start. */
    TRIAL_CONFIRMED = 2,  /**< It was confirmed. */
    TRIAL_FELL_BACK = 3,  /**< It has failed: the firmware before it is started. */
} trial_state_t;

/** The record of a trial in flash; little-endian. */
typedef struct {
    uint32_t state;  /**< A trial_state_t. */
    uint32_t image;  /**< Index of the image that it is about. */
    uint32_t crc32;  /**< Checksum in the header of that image: with another image there the record is void. */
} trial_record_t;

/** The trial of a device; read-only for the caller. */
typedef struct {
    records_t     *records;  /**< Where the record is; null if there is no place for it. */
    trial_record_t record;   /**< The newest record. */
    uint32_t       started;  /**< 1 + the image that runs; 0 if unknown. */
    bool           here;     /**< That image is the one on trial. */
    bool           wanted;   /**< `record` is to be written. */
    bool           writing;  /**< `record` is being written. */
    bool           insists;  /**< If that fails it is tried again every TRIAL_S. */
    status_t       status;   /**< How the last write of it ended. */
    uint64_t       since;    /**< Clock of the first poll, or of the last write that failed. */
    uint64_t       second;   /**< Clocks per second. */
} trial_t;

/** Finds out whether the running firmware is on trial, or runs again because another one has failed. `records` may be
 * null, and then there are no trials. */
void trial_init(trial_t *trial, records_t *records, const reset_report_t *report, uint32_t clock_hz);

/** What has become of the newest firmware. */
trial_state_t trial_state(const trial_t *trial);

/** Name of a state. */
const char *trial_state_name(trial_state_t state);

/** Confirms the running firmware, if it is on trial: trial_poll writes that to flash. Returns whether it is. */
bool trial_confirm(trial_t *trial);

/** Does the next piece of work, and confirms the running firmware after TRIAL_S. To be called once per round of the main
 * loop. */
void trial_poll(trial_t *trial, uint64_t clock);

/** Has trial_poll write another record, about an image that an update keeps or has written. STATUS_BUSY while one is
 * being written; STATUS_UNSUPPORTED without a place for it. */
status_t trial_record(trial_t *trial, trial_state_t state, uint32_t image, uint32_t crc32);

/** STATUS_BUSY while a record is being written, then how that ended. */
status_t trial_status(const trial_t *trial);

#ifdef __cplusplus
}
#endif

#endif
