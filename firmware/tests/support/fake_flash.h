/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* A SPI flash behind the pins that the CPU drives: erasing makes ones, programming can only make zeros, both take their
 * time and want the write enable latch; and the power may fail in the midst of it. */

#ifndef FAKE_FLASH_H
#define FAKE_FLASH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define FAKE_FLASH_BYTES (2u << 20)

/** What becomes of the operation in whose midst the power fails. */
enum fake_flash_cut { CUT_BEFORE, CUT_MIDWAY, CUT_AFTER };

/** To be changed by tests at will. */
typedef struct {
    bool     present;     /**< It is there; nothing answers otherwise. */
    uint32_t id;          /**< JEDEC's. */
    unsigned busy_looks;  /**< Looks at the status that an operation lasts. */
    bool     locked;      /**< The write enable latch is never set. */
    bool     protect;     /**< Its protection bits are set: it takes commands, and does not follow them. */
    bool     stuck;       /**< An operation that has begun does not end. */
    uint32_t worn;        /**< Address of a byte that stays erased; 0 for none. */
    unsigned operations;  /**< Erases and programs so far. */
    unsigned operations_left;  /**< Operations until the power fails: at 1 in the next one; 0 for never. */
    enum fake_flash_cut cut;   /**< What becomes of that one. */
    bool     dead;        /**< The power has failed. */
    unsigned random;      /**< Of what is left midway; not 0. */
    unsigned selects;     /**< Commands so far. */
    uint8_t  contents[FAKE_FLASH_BYTES];  /**< Its bytes. */
} fake_flash_t;

/** The one there is. */
extern fake_flash_t fake_flash;

/** A flash that is there, erased, sound, and under power. */
void fake_flash_reset(void);

/** Gives it its power back; what it holds stays. */
void fake_flash_power_up(void);

/** Whether it is selected, or its clock is high. */
bool fake_flash_in_use(void);

/** Puts an image at an address: a firmware of `length` bytes that is not 0, and its header. */
void fake_flash_put_image(uint32_t address, const uint8_t *firmware, uint32_t length);

#endif
