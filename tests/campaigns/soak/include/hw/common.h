/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Replaces LiteX's header: registers are accessed over the bus of the simulated SoC. */

#ifndef SOAK_COMMON_H
#define SOAK_COMMON_H

#include "machine.h"

static inline uint32_t csr_read_simple(unsigned long address)
{
    return machine_read((uint32_t)address);
}

static inline void csr_write_simple(uint32_t value, unsigned long address)
{
    machine_write((uint32_t)address, value);
}

#endif
