/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Formatted text, without a heap. */

#ifndef LITESTEREO_PRINT_H
#define LITESTEREO_PRINT_H

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include "litestereo/serial.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Most characters of one call. */
#define PRINT_MOST 199u

/** Receives the text. */
typedef void (*print_write_t)(void *context, const uint8_t *bytes, size_t length);

/** Prints as vprintf does, at most PRINT_MOST characters; a newline goes out as carriage return and newline. */
void print_to(print_write_t write, void *context, const char *format, va_list arguments);

/** Prints on the UART, as print_to does. */
void print(serial_t *serial, const char *format, ...) __attribute__((format(printf, 2, 3)));

#ifdef __cplusplus
}
#endif

#endif
