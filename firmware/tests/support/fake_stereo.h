/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* An accelerator in software, behind the functions of the stub csr.h. */

#ifndef FAKE_STEREO_H
#define FAKE_STEREO_H

#include <stdbool.h>
#include <stdint.h>

/** What can be set before the firmware starts. */
typedef struct {
    uint16_t max_width;         /**< Pixels. */
    uint16_t max_disparities;   /**< A multiple of 16. */
    uint8_t  max_block_size;    /**< Pixels, odd. */
    uint32_t features;          /**< enum stereo_feature. */
    uint32_t clocks_per_pixel;  /**< Simulated speed. */
    bool     hang;              /**< Never finishes, until it is aborted. */
    bool     stuck;             /**< Does not stop either. */
    uint32_t deaf;              /**< Stops that it does not hear yet. */
    bool     bus_error;         /**< Ends every frame with a bus error. */
    bool     wrong_pixel;       /**< The first pixel of every map is wrong. */
    uint64_t (*clock)(void);    /**< Simulated time in clocks. */
} fake_stereo_t;

/** The one accelerator. */
extern fake_stereo_t fake_stereo;

/** Attaches what the firmware wants called on an interrupt. */
void fake_stereo_attach(void (*handler)(void));

/** Lets time pass: ends a frame whose time has come and takes the interrupt. */
void fake_stereo_advance(void);

#endif
