/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Text for people, without a heap. */

#ifndef LITESTEREO_PRINT_H
#define LITESTEREO_PRINT_H

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include "litestereo/serial.h"

/** Most characters that are printed at once. */
#define PRINT_MOST 199u

/** Takes text on its way. */
typedef void (*print_write_t)(void *context, const uint8_t *bytes, size_t length);

/** Prints as vprintf does, at most PRINT_MOST characters; a newline goes out as carriage return and newline. */
void print_to(print_write_t write, void *context, const char *format, va_list arguments);

/** Prints on the UART, likewise. */
void print(serial_t *serial, const char *format, ...) __attribute__((format(printf, 2, 3)));

#endif
