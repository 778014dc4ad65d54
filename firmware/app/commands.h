/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#ifndef LITESTEREO_APP_COMMANDS_H
#define LITESTEREO_APP_COMMANDS_H

#include "litestereo/console.h"

/** `selftest`: compares the accelerator with the CPU, pixel for pixel. */
bool command_selftest(console_t *console, char **argv);

/** `bench WIDTH HEIGHT DISPARITIES BLOCK_SIZE`: matches a fixed pattern and tells the clocks and the map's CRC. */
bool command_bench(console_t *console, char **argv);

/** Prints, as the last word of `command`, why a frame is FAILED. */
void print_failure(console_t *console, const char *command, const frame_t *frame);

#endif
