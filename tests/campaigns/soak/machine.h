/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The simulated SoC as its firmware sees it, and its faults. */

#ifndef SOAK_MACHINE_H
#define SOAK_MACHINE_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Address of the main memory for firmware and DMA: below 4 GiB, and above the addresses where the kernel may put a
 * heap. */
#define MACHINE_MEMORY_BASE 0x50000000u
#define MACHINE_MEMORY_SIZE (4u << 20)

/** What was done to the system, and for how long it ran. */
typedef struct {
    uint64_t clocks;       /**< Of `sys`. */
    uint64_t wire_clocks;  /**< Of `eth`. */
    uint64_t ratios;       /**< Times that the ratio of the two was changed. */
    uint64_t stalls;       /**< Accesses to memory that had to wait. */
    uint64_t freezes;      /**< Times that the memory did not answer for thousands of clocks. */
    uint64_t bus_errors;   /**< Accesses of the matcher that were answered with an error. */
    uint64_t resets;       /**< Resets at random. */
    uint64_t hangs;        /**< Times that the firmware hung until the watchdog reset it. */
} machine_counts_t;

extern machine_counts_t machine_counts;

/** Creates the memory and the SoC, and the wire at a free UDP port of this computer. Faults come `haste` times as often
 * as by default. */
void machine_begin(uint64_t seed, uint32_t haste);

/** Accesses a register over the SoC's bus. Does not return if the SoC is reset meanwhile. */
uint32_t machine_read(uint32_t address);
void     machine_write(uint32_t address, uint32_t value);

/** Runs the SoC without an access. */
void machine_run(uint32_t clocks);

/** Returns whether a fault strikes now that strikes once in so many clocks on average. */
int machine_strikes(unsigned fault, uint32_t clocks);

/* Supplied by the firmware's program: interrupts, and a restart after a reset of the SoC. */
void machine_stereo_interrupt(void);
void machine_watchdog_interrupt(void);
void machine_restart(void) __attribute__((noreturn));

#ifdef __cplusplus
}
#endif

#endif
