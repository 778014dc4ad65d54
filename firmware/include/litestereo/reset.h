/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Why the SoC began anew, in two registers that a reset leaves alone: what is written there before a reset is read
 * after it. Without these registers the cause is always unknown. */

#ifndef LITESTEREO_RESET_H
#define LITESTEREO_RESET_H

#include <stdint.h>

/** Why the SoC began anew. */
typedef enum {
    RESET_POWER_UP  = 0,  /**< Power came, or a bitstream. */
    RESET_UNKNOWN   = 1,  /**< While a program ran, and it did not say why: a button, or a program that was deaf to interrupts. */
    RESET_REQUESTED = 2,  /**< Somebody wanted it. */
    RESET_WATCHDOG  = 3,  /**< The program did not come round; `place` is where it was. */
    RESET_ENSURE    = 4,  /**< A condition did not hold: see ensure.h. */
    RESET_MATCHER   = 5,  /**< The matcher neither ended nor stopped. */
} reset_cause_t;

/** What is known of the last reset. */
typedef struct {
    reset_cause_t cause;   /**< Why. */
    uint32_t      place;   /**< Address in the program; 0 if there is none. */
    uint16_t      line;    /**< Line of its source; 0 if there is none. */
    uint8_t       resets;  /**< Resets since power-up, at most 255. */
} reset_report_t;

/** Reads why the SoC began anew, and notes that a program runs; to be called once, first of all. */
void reset_begin(reset_report_t *report);

/** Notes why, and resets the SoC; does not return. */
void reset_now(reset_cause_t cause, uint32_t place, uint16_t line);

/** Name of a cause. */
const char *reset_cause_name(reset_cause_t cause);

#endif
