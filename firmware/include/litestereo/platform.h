/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Clock, caches, interrupts and memory of the SoC. */

#ifndef LITESTEREO_PLATFORM_H
#define LITESTEREO_PLATFORM_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/** Puts a variable that is used often into the fast RAM, if the SoC has one. No peripheral can read or write it there. */
#define FAST_DATA __attribute__((section(".fast_data")))

/** Clocks since reset. Not to be called in an interrupt: latching and reading the counter is not atomic. */
uint64_t clock_now(void);

/** Clocks per second. */
uint32_t clock_hz(void);

/** Name of the device, ASCII. */
const char *platform_name(void);

/** Makes everything that the CPU wrote visible to peripherals that read memory. */
void memory_to_device(void);

/** Makes everything that peripherals wrote to memory visible to the CPU. */
void memory_from_device(void);

/** Has `handler` called at each interrupt of the matcher, and disables all other interrupts. */
void platform_attach_stereo(void (*handler)(void));

/** Has `handler` called when the watchdog has not been fed; it ends with a reset of the SoC (see reset.h). To be called
 * after platform_attach_stereo, which disables other interrupts. */
void platform_attach_watchdog(void (*handler)(void));

/** In an interrupt: the address of the interrupted program. */
uint32_t platform_interrupted_at(void);

/** Marks the unused part of the stack for platform_stack_used; to be called first in main, with interrupts off. */
void platform_stack_mark(void);

/** Largest number of bytes of the stack in use since it was marked; writes its size in bytes to `size`. */
size_t platform_stack_used(size_t *size);

/** Memory between the program and the end of main RAM; writes its size in bytes to `size`. */
void *platform_frame_memory(size_t *size);

#ifdef __cplusplus
}
#endif

#endif
