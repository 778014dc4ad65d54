/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Driver of the matcher. Works on one frame at a time; every wait in it is bounded. */

#ifndef LITESTEREO_STEREO_H
#define LITESTEREO_STEREO_H

#include <stdbool.h>
#include <stdint.h>

#include "litestereo/status.h"
#include "litestereo/stereo_settings.h"

/** Largest DMA alignment that this firmware lays frames out for, in bytes. */
#define STEREO_MAX_ALIGNMENT 64u

/** Most rows of a frame, whatever the gateware was built for. */
#define STEREO_MAX_HEIGHT 4095u

/** What the gateware was built for. */
typedef struct {
    uint16_t version;          /**< Major x 256 + minor. */
    uint16_t max_width;        /**< Pixels. */
    uint16_t max_height;       /**< Pixels, STEREO_MAX_HEIGHT. */
    stereo_limits_t limits;    /**< Of the settings. */
    uint32_t dma_alignment;    /**< Bytes, a power of two: of base addresses, and what a map is padded to. */
} stereo_capabilities_t;

/** A frame to be matched: images and map in raster order, pitch = width, DMA-aligned. */
typedef struct {
    const uint8_t    *left;      /**< width x height bytes, aligned. */
    const uint8_t    *right;     /**< width x height bytes, aligned. */
    uint8_t          *map;       /**< width x height int16, aligned. */
    stereo_settings_t settings;  /**< Size, and what to match with. */
    bool              streamed;  /**< The pixels come past memory: left and right are not read, but aligned. */
} stereo_job_t;

/** Error codes of the status register. */
typedef enum {
    STEREO_ERROR_NONE    = 0,  /**< The map is valid. */
    STEREO_ERROR_CONFIG  = 1,  /**< The gateware refused the settings. */
    STEREO_ERROR_BUS     = 2,  /**< A bus error while reading or writing memory. */
    STEREO_ERROR_ABORTED = 3,  /**< Stopped by software. */
} stereo_error_t;

/** How a job ended. */
typedef struct {
    stereo_error_t error;             /**< The gateware's error code. */
    uint32_t       clocks;            /**< Start to last write, or clocks waited in vain after STATUS_TIMEOUT. */
    uint32_t       first_row_clocks;  /**< Start to the end of the first row that has disparities. */
} stereo_result_t;

/** Handle of the matcher. */
typedef struct {
    stereo_capabilities_t capabilities;  /**< Read once by stereo_init. */
    bool                  busy;          /**< A job was submitted and its end not seen yet. */
    uint64_t              started;       /**< Clock when it was submitted, or given more time. */
    uint64_t              budget;        /**< Clocks that it may take from then on. */
    volatile bool         event;         /**< Set by the interrupt: something ended. */
    volatile uint32_t     interrupts;    /**< Done and error interrupts taken. */
    uint32_t              timeouts;      /**< Jobs stopped by the watchdog. */
} stereo_t;

/** Reads what the gateware can do, stops what may be running, and enables its interrupt.
 *
 * STATUS_UNSUPPORTED if the capabilities make no sense or ask for more than STEREO_MAX_ALIGNMENT.
 */
status_t stereo_init(stereo_t *stereo);

/** First field of a job that the gateware cannot take, or STEREO_FIELD_NONE. */
stereo_field_t stereo_check(const stereo_t *stereo, const stereo_job_t *job);

/** Starts a job at time `clock`: STATUS_BAD_ARGUMENT if stereo_check minds, STATUS_BUSY while another runs. */
status_t stereo_submit(stereo_t *stereo, const stereo_job_t *job, uint64_t clock);

/** Clocks that a job of that size may take, once nothing but memory can hold it up. */
uint64_t stereo_budget(const stereo_settings_t *settings);

/** Gives the job that runs `budget` clocks from the time `clock` on, whatever it has taken until then. */
void stereo_allow(stereo_t *stereo, uint64_t clock, uint64_t budget);

/** Asks for the end of the job that was submitted; to be called often, as it costs next to nothing.
 *
 * STATUS_OK      done, and the CPU sees the map
 * STATUS_BUSY    not yet
 * STATUS_MATCHER ended with `result->error`
 * STATUS_TIMEOUT took too long and was stopped
 * STATUS_IDLE    nothing was submitted
 */
status_t stereo_poll(stereo_t *stereo, uint64_t clock, stereo_result_t *result);

/** Stops what runs and waits for it: STATUS_OK once idle, STATUS_TIMEOUT if the gateware does not stop. */
status_t stereo_abort(stereo_t *stereo);

/** Interrupt entry: to be attached to STEREO_INTERRUPT. */
void stereo_isr(stereo_t *stereo);

#endif
