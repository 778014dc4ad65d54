/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* A SPI flash at the pins that the CPU drives: erasing sets bits, programming can only clear bits, both take
 * time and need the write enable latch; and the power may fail during them. */

#ifndef FAKE_FLASH_H
#define FAKE_FLASH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define FAKE_FLASH_BYTES (2u << 20)

/** Effect of an operation during which the power fails. */
enum fake_flash_cut { CUT_BEFORE, CUT_MIDWAY, CUT_AFTER };

/** Tests may change the members. */
typedef struct {
    bool     present;     /**< The flash is there; else nothing answers. */
    uint32_t id;          /**< JEDEC id. */
    unsigned busy_polls;  /**< Duration of an operation in polls of the status. */
    bool     locked;      /**< The write enable latch is never set. */
    bool     protect;     /**< Its protection bits are set: it accepts commands, but does not execute them. */
    bool     stuck;       /**< Operations never end. */
    uint32_t worn;        /**< Address of a byte that stays erased; 0 for none. */
    unsigned operations;  /**< Erases and programs so far. */
    unsigned operations_to_cut;  /**< Operations until the power fails: 1 for the next one; 0 for never. */
    enum fake_flash_cut cut;   /**< Effect of that operation. */
    bool     dead;        /**< The power has failed. */
    unsigned random;      /**< Random state, for half-done operations; not 0. */
    unsigned selects;     /**< Commands so far. */
    uint8_t  contents[FAKE_FLASH_BYTES];  /**< Its bytes. */
} fake_flash_t;

/** The only flash. */
extern fake_flash_t fake_flash;

/** Resets it to an erased flash that works. */
void fake_flash_reset(void);

/** Restores the power; the contents stay. */
void fake_flash_power_up(void);

/** Whether it is selected, or its clock is high. */
bool fake_flash_in_use(void);

/** Stores an image at an address: a firmware of `length` bytes, not 0, with its header. */
void fake_flash_put_image(uint32_t address, const uint8_t *firmware, uint32_t length);

#endif
