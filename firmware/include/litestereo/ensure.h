/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Conditions that only a mistake in the program violates. */

#ifndef LITESTEREO_ENSURE_H
#define LITESTEREO_ENSURE_H

#include <stdint.h>

/** Goes on if the condition holds. If not: says where on the UART, notes it for the next start, and resets the SoC. */
#define ENSURE(condition) ((condition) ? (void)0 : ensure_failed(__FILE__, __LINE__))

/** What ENSURE does if its condition does not hold. */
void ensure_failed(const char *file, unsigned line);

#endif
