/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Driver of the matcher, for our firmware and for yours: docs/firmware.md is its guide.
 *
 * One frame at a time: stereo_init once, then stereo_submit, and stereo_poll (or stereo_wait) until the job has ended.
 * Every wait is bounded, caches are the driver's affair, and all state is in the handle. Functions are called from one
 * thread, stereo_isr from the interrupt. */

#ifndef LITESTEREO_STEREO_H
#define LITESTEREO_STEREO_H

#include <stdbool.h>
#include <stdint.h>

#include "litestereo/status.h"
#include "litestereo/stereo_settings.h"

/** Version of this interface: major x 256 + minor. */
#define STEREO_API_VERSION 0x0001u

/** Oldest register interface that the driver works with; a newer one has the same major version. */
#define STEREO_GATEWARE_VERSION 0x0003u

/** Largest DMA alignment that this firmware lays frames out for, in bytes. */
#define STEREO_MAX_ALIGNMENT 64u

/** For images and maps with a place of their own: `static STEREO_ALIGNED uint8_t left[320 * 240];` */
#define STEREO_ALIGNED _Alignas(STEREO_MAX_ALIGNMENT)

/** Most rows of a frame, whatever the gateware was built for. */
#define STEREO_MAX_HEIGHT 4095u

/** What the gateware was built for. */
typedef struct {
    uint16_t version;          /**< Of the registers: major x 256 + minor. */
    uint16_t max_width;        /**< Pixels. */
    uint16_t max_height;       /**< Pixels, STEREO_MAX_HEIGHT. */
    stereo_limits_t limits;    /**< Of the settings. */
    uint32_t dma_alignment;    /**< Bytes, a power of two: of base addresses, and what a map is padded to. */
} stereo_capabilities_t;

/** A frame to be matched: images and map in raster order, pitch = width, DMA-aligned.
 *
 * From stereo_submit to the end of the job images and map belong to the driver.
 */
typedef struct {
    const uint8_t    *left;      /**< width x height bytes, aligned. */
    const uint8_t    *right;     /**< width x height bytes, aligned. */
    void             *map;       /**< width x height int16, aligned; takes stereo_map_bytes(). */
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

/** What has happened since stereo_init; counts are modulo 2**32.
 *
 * Each job that was submitted is in one of done, config_errors, bus_errors, aborted and timeouts once its end was seen.
 */
typedef struct {
    uint32_t          submitted;        /**< Jobs that were started. */
    uint32_t          refused;          /**< Jobs that stereo_submit did not start. */
    uint32_t          done;             /**< Ended with a map. */
    uint32_t          config_errors;    /**< The gateware refused their settings. */
    uint32_t          bus_errors;       /**< Memory did not answer. */
    uint32_t          aborted;          /**< Stopped by stereo_abort. */
    uint32_t          timeouts;         /**< Stopped by the watchdog. */
    uint32_t          stuck;            /**< Times that the gateware did not stop when it had to. */
    uint32_t          lost_interrupts;  /**< Ends that no interrupt told of. */
    volatile uint32_t interrupts;       /**< Done and error interrupts taken. */
    uint32_t          longest_clocks;   /**< Of the jobs that were done. */
    uint64_t          clocks;           /**< Of the jobs that were done, all together. */
} stereo_statistics_t;

/** Called in the interrupt that tells of a job's end: wakes up who calls stereo_poll then. */
typedef void (*stereo_handler_t)(void *context);

/** Handle of the matcher; its members are the driver's, to be read only. */
typedef struct {
    stereo_capabilities_t capabilities;  /**< Read once by stereo_init. */
    stereo_statistics_t   statistics;    /**< What has happened. */
    bool                  busy;          /**< A job was submitted and its end not seen yet. */
    uint64_t              started;       /**< Clock when it was submitted, or given more time. */
    uint64_t              budget;        /**< Clocks that it may take from then on. */
    volatile bool         event;         /**< Set by the interrupt: something ended. */
    stereo_handler_t volatile handler;   /**< Called by the interrupt; null for none. */
    void                 *volatile context;  /**< Its argument. */
} stereo_t;

/** Reads what the gateware can do, stops what may be running, and enables its interrupt.
 *
 * STATUS_UNSUPPORTED if its version is none that the driver knows, or if the capabilities make no sense or ask for more
 * than STEREO_MAX_ALIGNMENT; STATUS_TIMEOUT if what runs does not stop.
 */
status_t stereo_init(stereo_t *stereo);

/** Has `handler` called at the end of each job from now on, in the interrupt; null for none. */
void stereo_on_end(stereo_t *stereo, stereo_handler_t handler, void *context);

/** Bytes of an image in memory, padded to the DMA's alignment. */
uint32_t stereo_image_bytes(const stereo_t *stereo, const stereo_settings_t *settings);

/** Bytes that a map takes in memory: the gateware fills up the last word that it writes. */
uint32_t stereo_map_bytes(const stereo_t *stereo, const stereo_settings_t *settings);

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

/** Polls until the job has ended, for as long as it may take at the utmost; returns what stereo_poll does, but not
 * STATUS_BUSY. Needs no interrupt to be attached. */
status_t stereo_wait(stereo_t *stereo, stereo_result_t *result);

/** Cancels the job that runs and waits until memory is left alone: STATUS_OK once idle, STATUS_TIMEOUT if the gateware
 * does not stop. Harmless when nothing runs. */
status_t stereo_abort(stereo_t *stereo);

/** Interrupt entry: to be attached to STEREO_INTERRUPT. */
void stereo_isr(stereo_t *stereo);

#endif
