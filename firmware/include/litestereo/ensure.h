/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Assertions that stay in the program. */

#ifndef LITESTEREO_ENSURE_H
#define LITESTEREO_ENSURE_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/** If the condition does not hold: prints where on the UART, records it for the next start, and resets the SoC. */
#define ENSURE(condition) ((condition) ? (void)0 : ensure_failed(__FILE__, __LINE__))

/** Called by ENSURE if its condition does not hold; does not return. */
void ensure_failed(const char *file, unsigned line);

#ifdef __cplusplus
}
#endif

#endif
