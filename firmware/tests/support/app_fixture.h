/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The whole firmware on a fake accelerator and a scripted line. */

#ifndef APP_FIXTURE_H
#define APP_FIXTURE_H

#include <string.h>

#include "app/app.h"
#include "fake_stereo.h"
#include "require.h"

/** The firmware. */
extern app_t         app;
extern app_buffers_t app_buffers;

/** Time in clocks of a microsecond; each read advances it, so that every bounded wait ends. */
extern uint64_t now;

/** Bytes of memory for frames. */
extern size_t frame_memory;

/** Report that the firmware gets at its start, and the resets that it requested since; the SoC is not reset here. */
extern reset_report_t found_reset;
extern reset_cause_t  last_reset;
extern unsigned       resets;
extern unsigned       forgotten_starts;  /**< Calls of reset_forget_starts(). */

/** What the firmware sent since the last call of type(), as text. */
extern char out[1 << 16];

/** Allocates the firmware's memory, with an inaccessible page on either side. To be called once. */
void make_memory(void);

/** Starts the firmware with a sound accelerator. */
void boot(void);

/** Queues a frame of 40 x 20 pixels for the matcher. */
frame_t *load_frame(uint32_t id);

/** Passes bytes from the line to the firmware. */
void receive(const void *bytes, size_t length);

/** Passes text from the line to the firmware, and returns what it sends in reply. */
const char *type(const char *text);

/** Requires that the reply of the firmware to a typed text contains another text. */
#define REQUIRE_TYPE(text, answer) REQUIRE(strstr(type(text), answer) != NULL)

#endif
