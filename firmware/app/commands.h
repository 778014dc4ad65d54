/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The console's commands that match frames, and their shared parts. */

#ifndef LITESTEREO_APP_COMMANDS_H
#define LITESTEREO_APP_COMMANDS_H

#include "console.h"

/** Words of scratch memory for the matcher on the CPU. */
#define CPU_SCRATCH_WORDS 16384u

/** That memory. */
extern uint32_t cpu_scratch[CPU_SCRATCH_WORDS];

/** `selftest`: compares the accelerator with the CPU, pixel for pixel. */
bool command_selftest(console_t *console, char **argv);

/** `bench WIDTH HEIGHT DISPARITIES BLOCK_SIZE sad|all`: matches a fixed pattern; prints the clocks and the map's
 * CRC. */
bool command_bench(console_t *console, char **argv);

/** `cpu_bench` with the same arguments: the same on the CPU. */
bool command_cpu_bench(console_t *console, char **argv);

/** Settings in which every stage that is built has something to do; width and height 0. */
stereo_settings_t settings_with_all_stages(const stereo_limits_t *limits);

/** Prints the last line of `command`: why the frame is FAILED. */
void print_failure(console_t *console, const char *command, const frame_t *frame);

#endif
