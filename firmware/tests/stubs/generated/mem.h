/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The tests' form of LiteX's generated mem.h. Main RAM is all that registers can address, until a test sets other limits. */

#ifndef GENERATED_MEM_H
#define GENERATED_MEM_H

#include <stdint.h>

extern uint64_t stub_ram_base, stub_ram_bytes;

/* Weak, so that every file that includes this may define them. */
__attribute__((weak)) uint64_t stub_ram_base;
__attribute__((weak)) uint64_t stub_ram_bytes = 1ull << 32;

#define MAIN_RAM_BASE stub_ram_base
#define MAIN_RAM_SIZE stub_ram_bytes

#endif
