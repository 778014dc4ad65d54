/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The cause of the last reset, kept in two registers that a reset does not change: written before it, read after it.
 * Without these registers the cause is always unknown. */

#ifndef LITESTEREO_RESET_H
#define LITESTEREO_RESET_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/** Cause of a reset. */
typedef enum {
    RESET_POWER_UP  = 0,  /**< Power-up, or a bitstream was loaded. */
    RESET_UNKNOWN   = 1,  /**< The program recorded no cause: a button, or a hang with interrupts disabled. */
    RESET_REQUESTED = 2,  /**< A host or user asked for it. */
    RESET_WATCHDOG  = 3,  /**< The program did not feed the watchdog; `place` is where it was. */
    RESET_ENSURE    = 4,  /**< A condition did not hold: see ensure.h. */
    RESET_MATCHER   = 5,  /**< The matcher neither ended nor stopped. */
    RESET_START     = 6,  /**< The program could not start. */
} reset_cause_t;

/** Report of the last reset. */
typedef struct {
    reset_cause_t cause;   /**< Its cause. */
    uint32_t      place;   /**< Address in the program; 0 if there is none. */
    uint16_t      line;    /**< Line of its source; 0 if there is none. */
    uint8_t       resets;  /**< Resets since power-up, at most 255. */
    uint8_t       image;   /**< 1 + the image in flash that the boot program started; 0 if there is no boot program. */
} reset_report_t;

/** Reads the report, and records that a program runs; to be called once, first in main. */
void reset_begin(reset_report_t *report);

/** Records the cause and resets the SoC; does not return. */
void reset_now(reset_cause_t cause, uint32_t place, uint16_t line);

/** Forgets the starts of a firmware on trial, which the boot program counts: see trial.h. */
void reset_forget_starts(void);

/** Name of a cause. */
const char *reset_cause_name(reset_cause_t cause);

#ifdef __cplusplus
}
#endif

#endif
