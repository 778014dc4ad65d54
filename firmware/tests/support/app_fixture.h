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
extern app_t app;

/** Time in clocks of a microsecond; it goes on with each look at it, so that nothing can wait for ever. */
extern uint64_t now;

/** Bytes of memory that the firmware finds for frames. */
extern size_t frame_memory;

/** What the firmware finds when it boots, and the resets that it asked for since; the SoC does not reset here. */
extern reset_report_t found_reset;
extern reset_cause_t  last_reset;
extern unsigned       resets;

/** What the firmware sent since the last call of type(), as text. */
extern char out[1 << 16];

/** Gives the firmware its memory, with a page that must not be touched on either side. Once. */
void make_memory(void);

/** Starts the firmware with a sound accelerator. */
void boot(void);

/** Puts a frame of 40 x 20 pixels in line for the matcher. */
frame_t *load_frame(uint32_t id);

/** Lets the firmware take bytes from the line. */
void receive(const void *bytes, size_t length);

/** Forgets what was sent, lets the firmware take text from the line and returns what it sent. */
const char *type(const char *text);

/** Requires that the firmware, when a text is typed, answers with another among the rest. */
#define REQUIRE_TYPE(text, answer) REQUIRE(strstr(type(text), answer) != NULL)

#endif
