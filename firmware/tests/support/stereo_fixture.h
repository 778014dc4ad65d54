/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* A matcher behind registers that expect accesses, and a job for it. */

#ifndef STEREO_FIXTURE_H
#define STEREO_FIXTURE_H

#include "litestereo/stereo.h"

/** Of the register `status`. */
#define BUSY 1u

extern stereo_t     stereo;    /**< The driver's handle. */
extern stereo_job_t job;       /**< 320 x 240, which the matcher takes. */
extern uint32_t     features;  /**< What the matcher is built for. */

/** The next accesses are those that read the capabilities. */
void expect_capabilities(uint32_t version, uint32_t width, uint32_t disparities, uint32_t sizes, uint32_t alignment);

/** Brings driver and job up. */
void set_up(void);

/** Submits the job. */
void submit(uint64_t clock);

/** An interrupt with these events pending. */
void interrupt(uint32_t pending);

/** The next accesses are those of the end of a job that is done. */
void expect_end(uint32_t clocks, uint32_t first_row_clocks);

#endif
