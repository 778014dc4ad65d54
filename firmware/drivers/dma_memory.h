/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Which memory peripherals may be given: every driver checks its addresses here before it writes them to registers. */

#ifndef LITESTEREO_DRIVERS_DMA_MEMORY_H
#define LITESTEREO_DRIVERS_DMA_MEMORY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <generated/mem.h>

/** Whether `bytes` bytes, at least 1, begin at a multiple of `alignment` and are all in main RAM; null is not.
 *
 * An access elsewhere need not end with an error: LiteX's bus acknowledges it after a timeout of a million clocks, word
 * by word. In 64 bits, because RAM may end at 2**32.
 */
static inline bool dma_reaches(const void *memory, uint32_t bytes, uint32_t alignment)
{
    uint64_t first = (uintptr_t)memory;
    uint64_t base  = MAIN_RAM_BASE;
    uint64_t size  = MAIN_RAM_SIZE;

    return memory != NULL && first % alignment == 0 && bytes > 0 && first >= base && first - base < size
        && bytes <= size - (first - base);
}

#endif
