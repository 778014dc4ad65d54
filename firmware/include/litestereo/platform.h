/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* What the firmware needs of the SoC beside its peripherals. */

#ifndef LITESTEREO_PLATFORM_H
#define LITESTEREO_PLATFORM_H

#include <stddef.h>
#include <stdint.h>

/** Clocks since the SoC began; not to be called in an interrupt, as its two halves are read one after the other. */
uint64_t clock_now(void);

/** Clocks in a second. */
uint32_t clock_hz(void);

/** What the device calls itself, ASCII. */
const char *platform_name(void);

/** Makes all that the CPU wrote visible to a peripheral that reads memory. */
void memory_to_device(void);

/** Makes all that a peripheral wrote in memory visible to the CPU. */
void memory_from_device(void);

/** Calls `handler` at each interrupt of the matcher from now on, and takes no other interrupt. */
void platform_attach_stereo(void (*handler)(void));

/** Calls `handler` when the watchdog has not been fed; it resets the SoC in the end (see reset.h). To be called after
 * platform_attach_stereo, which switches other interrupts off. */
void platform_attach_watchdog(void (*handler)(void));

/** In an interrupt: the address at which the program was. */
uint32_t platform_interrupted_at(void);

/** Marks the stack as far as nobody uses it, for platform_stack_used; to be called first of all, interrupts off. */
void platform_stack_mark(void);

/** Most bytes of the stack that have been in use since it was marked; writes to `size` what it has. */
size_t platform_stack_used(size_t *size);

/** Memory between the program and the end of main RAM; writes its size in bytes to `size`. */
void *platform_frame_memory(size_t *size);

#endif
