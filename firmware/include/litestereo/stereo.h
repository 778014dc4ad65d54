/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Driver of the matcher, for our firmware and for yours: docs/firmware.md is its guide.
 *
 * One frame at a time: stereo_init once, then stereo_submit, and stereo_poll (or stereo_wait) until the job has ended.
 * Every wait is bounded, the driver keeps caches coherent, and all state is in the handle. Call the functions from one
 * thread, and stereo_isr from the interrupt. */

#ifndef LITESTEREO_STEREO_H
#define LITESTEREO_STEREO_H

#include <stdbool.h>
#include <stdint.h>

#include "litestereo/status.h"
#include "litestereo/stereo_settings.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Version of this interface: major x 256 + minor. */
#define STEREO_API_VERSION 0x0001u

/** Oldest register interface that the driver works with; a newer one has the same major version. */
#define STEREO_GATEWARE_VERSION 0x0004u

/** Largest DMA alignment that this firmware lays frames out for, in bytes. */
#define STEREO_MAX_ALIGNMENT 64u

/** Aligns images and maps: `static STEREO_ALIGNED uint8_t left[320 * 240];` */
#ifdef __cplusplus
#define STEREO_ALIGNED __attribute__((aligned(STEREO_MAX_ALIGNMENT)))  /* Where C++ has no alignas: after static. */
#else
#define STEREO_ALIGNED _Alignas(STEREO_MAX_ALIGNMENT)
#endif

/** Capabilities of the gateware. */
typedef struct {
    uint16_t version;          /**< Of the registers: major x 256 + minor. */
    uint16_t max_width;        /**< Pixels. */
    uint16_t max_height;       /**< Pixels, STEREO_MAX_HEIGHT. */
    stereo_limits_t limits;    /**< Of the settings. */
    uint32_t dma_alignment;    /**< Bytes, a power of two: alignment of base addresses, and of the size of a map. */
} stereo_capabilities_t;

/** A frame to match: images and map in raster order, without gaps between rows, in main RAM, aligned for the DMA.
 *
 * They belong to the driver from stereo_submit to the end of the job.
 */
typedef struct {
    const uint8_t    *left;      /**< width x height bytes, aligned. */
    const uint8_t    *right;     /**< width x height bytes, aligned. */
    void             *map;       /**< width x height int16, aligned; stereo_map_bytes() bytes. */
    stereo_settings_t settings;  /**< Size and matching parameters. */
    bool              streamed;  /**< Pixels come from the frame link: images are not read, but must be aligned. */
    /* All 0 without the feature `rectification`; see rectification.h. */
    bool              rectified; /**< The pair is rectified. */
    uint8_t           grid;      /**< By this grid of gateware, 0 or 1. */
    void             *left_out;  /**< Gets the left image as the matcher does, aligned, stereo_image_bytes(); or null. */
    void             *right_out; /**< Gets the right one. */
} stereo_job_t;

/** Error codes of the status register. */
typedef enum {
    STEREO_ERROR_NONE    = 0,  /**< The map is valid. */
    STEREO_ERROR_CONFIG  = 1,  /**< The gateware refused the settings. */
    STEREO_ERROR_BUS     = 2,  /**< Bus error while reading or writing memory. */
    STEREO_ERROR_ABORTED = 3,  /**< Stopped by software. */
} stereo_error_t;

/** How a job ended. */
typedef struct {
    stereo_error_t error;             /**< The gateware's error code. */
    uint32_t       clocks;            /**< From the start to the last write; after STATUS_TIMEOUT, the clocks waited. */
    uint32_t       first_row_clocks;  /**< From the start to the end of the first row with disparities. */
    bool           row_gone;          /**< Rectified with too few rows: some pixels are black. */
    bool           folded;            /**< Rectified by a map that folds over. */
} stereo_result_t;

/** Counts since stereo_init, modulo 2**32.
 *
 * Each submitted job is counted in one of done, config_errors, bus_errors, aborted and timeouts when its end is
 * noticed.
 */
typedef struct {
    uint32_t          submitted;        /**< Jobs started. */
    uint32_t          refused;          /**< Jobs refused by stereo_submit. */
    uint32_t          done;             /**< Jobs that ended with a map. */
    uint32_t          config_errors;    /**< The gateware refused their settings. */
    uint32_t          bus_errors;       /**< Memory did not answer. */
    uint32_t          aborted;          /**< Stopped by stereo_abort. */
    uint32_t          timeouts;         /**< Stopped by the watchdog. */
    uint32_t          stuck;            /**< Times that the gateware did not stop. */
    uint32_t          lost_interrupts;  /**< Ends without an interrupt. */
    volatile uint32_t interrupts;       /**< Interrupts handled. */
    uint32_t          longest_clocks;   /**< Longest job that was done. */
    uint64_t          clocks;           /**< Sum over all jobs that were done. */
} stereo_statistics_t;

/** Called in the interrupt at the end of a job, to wake up the thread that calls stereo_poll. */
typedef void (*stereo_handler_t)(void *context);

/** Handle of the matcher; read-only for the caller. */
typedef struct {
    stereo_capabilities_t capabilities;  /**< Read once by stereo_init. */
    stereo_statistics_t   statistics;    /**< Counts of jobs. */
    bool                  busy;          /**< A job was submitted, and its end has not been noticed. */
    uint64_t              started;       /**< Clock of stereo_submit, or of stereo_allow after it. */
    uint64_t              budget;        /**< Clocks that the job may take from then on. */
    volatile bool         event;         /**< Set by the interrupt at the end of a job. */
    stereo_handler_t volatile handler;   /**< Called by the interrupt; null for none. */
    void                 *volatile context;  /**< Its argument. */
} stereo_t;

/** Reads the capabilities, stops a running job, and enables the interrupt.
 *
 * STATUS_UNSUPPORTED if the driver does not support the version, or if the capabilities are invalid or need an
 * alignment above STEREO_MAX_ALIGNMENT; STATUS_TIMEOUT if a running job does not stop.
 */
status_t stereo_init(stereo_t *stereo);

/** Has `handler` called in the interrupt at the end of each job; null for none. */
void stereo_on_end(stereo_t *stereo, stereo_handler_t handler, void *context);

/** Bytes of an image in memory, padded to the DMA's alignment. */
uint32_t stereo_image_bytes(const stereo_t *stereo, const stereo_settings_t *settings);

/** Bytes of a map in memory: the gateware pads the last word that it writes. */
uint32_t stereo_map_bytes(const stereo_t *stereo, const stereo_settings_t *settings);

/** First field of a job that the gateware does not allow, or STEREO_FIELD_NONE.
 *
 * Of a job that is otherwise valid, images and map must be in main RAM, with their padding: the peripheral may not get an
 * error from an address without memory.
 */
stereo_field_t stereo_check(const stereo_t *stereo, const stereo_job_t *job);

/** Starts a job at time `clock`: STATUS_BAD_ARGUMENT if stereo_check finds a bad field, STATUS_BUSY while a job
 * runs. */
status_t stereo_submit(stereo_t *stereo, const stereo_job_t *job, uint64_t clock);

/** Clocks that a job of this size may take if it waits for memory only. */
uint64_t stereo_budget(const stereo_settings_t *settings);

/** Allows the running job `budget` more clocks from time `clock` on. */
void stereo_allow(stereo_t *stereo, uint64_t clock, uint64_t budget);

/** Checks for the end of the submitted job. It costs a few clocks only; call it often.
 *
 * STATUS_OK      done, and the CPU sees the map
 * STATUS_BUSY    not yet
 * STATUS_MATCHER ended with `result->error`
 * STATUS_TIMEOUT exceeded its budget and was stopped
 * STATUS_IDLE    no job was submitted
 */
status_t stereo_poll(stereo_t *stereo, uint64_t clock, stereo_result_t *result);

/** Polls until the job has ended or exceeds its budget; returns what stereo_poll does, except STATUS_BUSY. Needs no
 * interrupt. */
status_t stereo_wait(stereo_t *stereo, stereo_result_t *result);

/** Aborts the running job and waits until the gateware no longer accesses memory: STATUS_OK once idle, STATUS_TIMEOUT
 * if it does not stop. Does nothing while no job runs. */
status_t stereo_abort(stereo_t *stereo);

/** Interrupt service routine, for STEREO_INTERRUPT. */
void stereo_isr(stereo_t *stereo);

#ifdef __cplusplus
}
#endif

#endif
