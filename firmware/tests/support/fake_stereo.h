/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* An accelerator in software, as functions of the stub csr.h. */

#ifndef FAKE_STEREO_H
#define FAKE_STEREO_H

#include <stdbool.h>
#include <stdint.h>

/** Configuration; set it before the firmware starts. */
typedef struct {
    uint16_t max_width;         /**< Pixels. */
    uint16_t max_disparities;   /**< A multiple of 16. */
    uint8_t  max_block_size;    /**< Pixels, odd. */
    uint8_t  max_prefilter_cap; /**< Largest prefilter_cap. */
    uint32_t features;          /**< enum stereo_feature. */
    uint32_t clocks_per_pixel;  /**< Simulated speed. */
    bool     hang;              /**< Never finishes, until it is aborted. */
    bool     stuck;             /**< Does not stop either. */
    uint32_t deaf;              /**< Number of aborts that it ignores. */
    bool     bus_error;         /**< Ends every frame with a bus error. */
    bool     wrong_pixel;       /**< The first pixel of every map is wrong. */
    uint32_t flags;             /**< What the register `rectification` tells of every rectified frame. */
    uint64_t (*clock)(void);    /**< Simulated time in clocks. */
} fake_stereo_t;

/** The only accelerator. */
extern fake_stereo_t fake_stereo;

/** Attaches the firmware's interrupt handler. */
void fake_stereo_attach(void (*handler)(void));

/** Advances time: ends a frame that is due, and raises the interrupt. */
void fake_stereo_advance(void);

#endif
