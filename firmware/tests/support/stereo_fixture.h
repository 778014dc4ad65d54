/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* A matcher of mock registers, and a job for it. */

#ifndef STEREO_FIXTURE_H
#define STEREO_FIXTURE_H

#include "litestereo/stereo.h"

/** Of the register `status`. */
#define BUSY 1u

extern stereo_t     stereo;    /**< The driver's handle. */
extern stereo_job_t job;       /**< A valid job of 320 x 240 pixels. */
extern uint32_t     features;  /**< Stages of the matcher. */

/** Expects the accesses that read the capabilities. */
void expect_capabilities(uint32_t version, uint32_t width, uint32_t disparities, uint32_t sizes, uint32_t alignment);

/** Initialises driver and job. */
void set_up(void);

/** Submits the job. */
void submit(uint64_t clock);

/** An interrupt with these events pending. */
void interrupt(uint32_t pending);

/** Expects the accesses at the end of a job that is done. */
void expect_end(uint32_t clocks, uint32_t first_row_clocks);

#endif
