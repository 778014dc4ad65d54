/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The soak's form of LiteX's generated mem.h: main RAM is the memory of the machine. */

#ifndef GENERATED_MEM_H
#define GENERATED_MEM_H

#include "machine.h"

#define MAIN_RAM_BASE MACHINE_MEMORY_BASE
#define MAIN_RAM_SIZE MACHINE_MEMORY_SIZE

#endif
